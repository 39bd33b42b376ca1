//! Faults in words: rates of what goes wrong on the line and in the device.
//!
//! A list of `key=value` pairs joined by commas. On the line:
//!
//! | key | value | meaning |
//! | --- | --- | --- |
//! | `flip` | rate per bit | a bit is turned over |
//! | `lose` | rate per byte | a byte is lost |
//! | `double` | rate per byte | a byte comes twice |
//! | `garbage` | rate per byte | 1 to 64 random bytes are put in |
//! | `flood` | rate per byte | 1 to 16 KiB of random bytes are put in |
//! | `stall` | rate per byte | nothing passes for `stall-ms` |
//! | `stall-ms` | milliseconds, 200 if left out | length of a stall |
//! | `cut` | rate per frame | a frame is cut off somewhere |
//! | `replay` | rate per frame | a frame comes once more, up to 200 frames later |
//! | `delay` | rate per frame | a frame comes up to `delay-ms` late |
//! | `delay-ms` | milliseconds, 500 if left out | longest delay |
//! | `reorder` | rate per frame | up to 40 others overtake a frame, so that columns mix |
//! | `to` | `host`, `device` or `both` (the default) | direction that suffers |
//! | `seed` | number, 0 if left out | seed of all faults |
//!
//! In the device, each at the rate of its key per measured column:
//!
//! | key | what happens |
//! | --- | --- |
//! | `reset` | the firmware starts anew |
//! | `table-stall` | the table stops following its motor; its position is lost |
//! | `limit-switch` | the table runs into a limit switch; its position is lost |
//! | `over-temperature` | the head gets too hot |
//! | `laser` | the laser does not light |
//! | `interlock` | the safety interlock opens, and closes again |
//! | `move-part` | somebody moves the object by `move-mm` (1 if left out) |
//! | `clock-jump` | the device's clock jumps forward, back, or to just before its end |
//! | `unplug` | the cable is pulled, and put back |
//! | `wrong-serial` | the same, and first another device is plugged in |
//! | `babble` | rate per start of the firmware: random bytes come before the banner |
//! | `hold-ms` | how long a cause stays, or the cable is out; 2000 if left out |
//!
//! Example: `flip=1e-5,reset=0.001,seed=7`.

mod strikes;

use core::str::FromStr;
use core::time::Duration;

use thiserror::Error;

pub use strikes::Strikes;

use crate::device::Mishaps;
use crate::line::LineFaults;

/// Faults of a line and of the device at its end.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FaultSpec {
    /// What goes wrong on the line.
    pub line: LineFaults,
    /// What goes wrong in the device.
    pub device: Mishaps,
}

/// Why a text is no list of faults.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum FaultSpecError {
    /// A part is not `key=value`.
    #[error("{0:?} is not of the form key=value")]
    NoPair(String),
    /// A key is not known.
    #[error("unknown fault {key:?}; known are {known}", known = KEYS.join(", "))]
    UnknownKey {
        /// The key.
        key: String,
    },
    /// A value does not suit its key.
    #[error("{key}: {value:?} is not {wanted}")]
    Value {
        /// The key.
        key: String,
        /// What was given.
        value: String,
        /// What is wanted.
        wanted: &'static str,
    },
}

/// All keys, for messages.
const KEYS: [&str; 27] = [
    "flip",
    "lose",
    "double",
    "garbage",
    "flood",
    "stall",
    "stall-ms",
    "cut",
    "replay",
    "delay",
    "delay-ms",
    "reorder",
    "to",
    "seed",
    "reset",
    "table-stall",
    "limit-switch",
    "over-temperature",
    "laser",
    "interlock",
    "move-part",
    "move-mm",
    "clock-jump",
    "unplug",
    "wrong-serial",
    "babble",
    "hold-ms",
];

impl FromStr for FaultSpec {
    type Err = FaultSpecError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut spec = Self::default();
        for part in text.split(',').map(str::trim).filter(|p| !p.is_empty()) {
            let (key, value) = part
                .split_once('=')
                .ok_or_else(|| FaultSpecError::NoPair(part.into()))?;
            spec.set(key, value)?;
        }
        Ok(spec)
    }
}

impl FaultSpec {
    fn set(&mut self, key: &str, value: &str) -> Result<(), FaultSpecError> {
        let wrong = |wanted| FaultSpecError::Value {
            key: key.into(),
            value: value.into(),
            wanted,
        };
        let number = |low: f64, high: f64, wanted| match value.parse::<f64>() {
            Ok(number) if (low..=high).contains(&number) => Ok(number),
            _ => Err(wrong(wanted)),
        };
        let rate = || number(0.0, 0.5, "a rate from 0 to 0.5");
        let time = || {
            let ms = value.parse().ok().filter(|ms| *ms <= 60_000);
            ms.map(Duration::from_millis)
                .ok_or_else(|| wrong("a number of milliseconds up to 60000"))
        };
        let (line, device) = (&mut self.line, &mut self.device);
        match key {
            "flip" => line.flip = rate()?,
            "lose" => line.lose = rate()?,
            "double" => line.double = rate()?,
            "garbage" => line.garbage = rate()?,
            "flood" => line.flood = rate()?,
            "stall" => line.stall = rate()?,
            "stall-ms" => line.stall_time = time()?,
            "cut" => line.cut = rate()?,
            "replay" => line.replay = rate()?,
            "delay" => line.delay = rate()?,
            "delay-ms" => line.delay_time = time()?,
            "reorder" => line.reorder = rate()?,
            "to" => {
                (line.to_host, line.to_device) = match value {
                    "host" => (true, false),
                    "device" => (false, true),
                    "both" => (true, true),
                    _ => return Err(wrong("host, device or both")),
                }
            }
            "seed" => {
                let seed = value.parse().map_err(|_| wrong("a whole number"))?;
                (line.seed, device.seed) = (seed, seed);
            }
            "reset" => device.reset = rate()?,
            "table-stall" => device.table_stall = rate()?,
            "limit-switch" => device.limit_switch = rate()?,
            "over-temperature" => device.over_temperature = rate()?,
            "laser" => device.laser = rate()?,
            "interlock" => device.interlock = rate()?,
            "move-part" => device.move_part = rate()?,
            "move-mm" => device.move_mm = number(-100.0, 100.0, "a way from -100 to 100 mm")?,
            "clock-jump" => device.clock_jump = rate()?,
            "unplug" => device.unplug = rate()?,
            "wrong-serial" => device.wrong_serial = rate()?,
            "babble" => device.babble = number(0.0, 1.0, "a rate from 0 to 1")?,
            "hold-ms" => device.hold = time()?,
            _ => return Err(FaultSpecError::UnknownKey { key: key.into() }),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_faults_reads_as_documented() {
        let spec: FaultSpec = "flip=1e-5,lose=2e-5, to=host,stall-ms=50,seed=7,reset=0.01"
            .parse()
            .expect("well formed");
        let faults = spec.line;
        assert_eq!((faults.flip, faults.lose, faults.seed), (1e-5, 2e-5, 7));
        assert!(faults.to_host && !faults.to_device);
        assert_eq!(faults.stall_time, Duration::from_millis(50));
        assert_eq!((spec.device.reset, spec.device.seed), (0.01, 7));
        assert_eq!("".parse(), Ok(FaultSpec::default()));
        for (wrong, says) in [
            ("flip", "not of the form"),
            ("flap=1", "unknown fault"),
            ("flip=2", "a rate from 0 to 0.5"),
            ("to=me", "host, device or both"),
            ("seed=-1", "whole number"),
            ("move-mm=nan", "a way from"),
            ("hold-ms=1e9", "milliseconds"),
        ] {
            let error = wrong.parse::<FaultSpec>().expect_err(wrong).to_string();
            assert!(error.contains(says), "{error}");
        }
    }

    #[test]
    fn every_key_is_known() {
        for key in KEYS {
            let value = if key == "to" { "host" } else { "0" };
            assert!(FaultSpec::default().set(key, value).is_ok(), "{key}");
        }
    }
}
