//! Scans of references by the simulated scanner, in counts.

use metrology::{RawSample, Scan};
use range_image::Calibration;
use range_image::calibration::Head;
use sim_scanner::Vec3;
use sim_scanner::config::{Object, SimConfig};
use sim_scanner::preset::Overrides;
use sim_scanner::scene::artefacts::Artefact;
use sim_scanner::source::Source;

/// What is scanned, and how.
#[derive(Debug, Clone)]
pub(crate) struct Taken {
    pub(crate) object: &'static str,
    pub(crate) artefact: Artefact,
    pub(crate) mount: &'static str,
    pub(crate) seed: u64,
    pub(crate) overrides: Overrides,
}

impl Taken {
    pub(crate) fn of(object: &'static str, mount: &'static str, seed: u64) -> Self {
        Self {
            object,
            artefact: Artefact::default(),
            mount,
            seed,
            overrides: Overrides {
                outliers: Some(0.01),
                ..Overrides::default()
            },
        }
    }

    pub(crate) fn at(mut self, places: &[[f64; 3]]) -> Self {
        self.artefact.at_mm = places
            .iter()
            .map(|&place| Vec3::from_array(place))
            .collect();
        self
    }

    /// The scan that the device proposes.
    pub(crate) fn scan(&self) -> Scan {
        let config = SimConfig {
            object: Object::BuiltIn(self.object.into()),
            artefact: self.artefact.clone(),
            overrides: Overrides {
                mount: self.mount.parse().unwrap(),
                ..self.overrides
            },
            seed: self.seed,
            ..SimConfig::default()
        };
        let source = config.source().unwrap();
        let calibration = announced(&source);
        let Source::Simulated { scanner, proposed } = source else {
            panic!("it is no recording");
        };
        let columns = (0..proposed.columns)
            .map(|index| {
                let column = scanner.column(&proposed, self.seed, index);
                let seen = column.samples.iter().filter(|sample| !sample.no_return);
                seen.map(|sample| RawSample {
                    table_counts: column.table_counts,
                    lateral_counts: sample.lateral_counts,
                    range_counts: sample.range_counts,
                })
                .collect()
            })
            .collect();
        Scan {
            calibration,
            columns,
        }
    }
}

fn announced(source: &Source) -> Calibration {
    let wire = source.calibration();
    Calibration {
        table_origin_mm: wire.table_origin_nm as f64 / 1e6,
        table_count_mm: f64::from(wire.table_count_pm) / 1e9,
        head: match wire.head {
            scanner_protocol::Head::Polar {
                camera_y_nm,
                camera_z_nm,
                angle_count_prad,
                range_count_pm,
            } => Head::Polar {
                camera_y_mm: camera_y_nm as f64 / 1e6,
                camera_z_mm: camera_z_nm as f64 / 1e6,
                angle_count_rad: f64::from(angle_count_prad) / 1e12,
                range_count_mm: f64::from(range_count_pm) / 1e9,
            },
            scanner_protocol::Head::Cartesian { count_pm } => Head::Cartesian {
                count_mm: f64::from(count_pm) / 1e9,
            },
        },
        correction: None,
    }
}
