//! What stands before the simulated scanner.

use std::path::PathBuf;

use sim_scanner::config::{Object, SimConfig};
use sim_scanner::device::DeviceSettings;
use sim_scanner::preset::Overrides;

/// The house in few columns, so that tests are quick; the table is at once where it should
/// be.
#[must_use]
pub fn small_house() -> SimConfig {
    SimConfig {
        overrides: Overrides {
            columns: Some(60),
            samples: Some(64),
            ..Overrides::default()
        },
        seed: 1,
        device: quick(),
        ..SimConfig::default()
    }
}

/// The house in so many columns, at so leisurely a pace, that a scan can be found at work
/// and ended there: ten seconds for the whole.
#[must_use]
pub fn leisurely_house() -> SimConfig {
    let house = small_house();
    SimConfig {
        overrides: Overrides {
            columns: Some(2_000),
            ..house.overrides
        },
        device: DeviceSettings {
            line_rate_hz: Some(200.0),
            ..house.device
        },
        ..house
    }
}

/// A recorded scan, sent as fast as the service takes it.
#[must_use]
pub fn recording(file: PathBuf) -> SimConfig {
    SimConfig {
        object: Object::Recording(file),
        seed: 1,
        device: quick(),
        ..SimConfig::default()
    }
}

fn quick() -> DeviceSettings {
    DeviceSettings {
        table_speed_mm_s: f64::INFINITY,
        ..DeviceSettings::default()
    }
}
