//! From device counts to millimetres: the only place where the two meet.

use crate::correction::Correction;
use crate::frame::{Part, Position, Sensor};

/// How a scanner's counts map to the part frame. The device announces it; how it deviates from
/// that as it is mounted, a [`Correction`] tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// x of the part frame at table position 0, millimetres.
    pub table_origin_mm: f64,
    /// Travel of the table per count, millimetres.
    pub table_count_mm: f64,
    /// What a sample's two numbers mean.
    pub head: Head,
    /// What is known of how the mounted scanner deviates from the rest; `None` leaves every bit
    /// as the device announced it.
    pub correction: Option<Correction>,
}

/// What the measuring head delivers for a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Head {
    /// An angle of the ray and a distance along it.
    Polar {
        /// y of the camera's centre in the part frame, millimetres.
        camera_y_mm: f64,
        /// z of the camera's centre in the part frame, millimetres.
        camera_z_mm: f64,
        /// Angle per count, radians; positive angles look up.
        angle_count_rad: f64,
        /// Distance along the ray per count, millimetres.
        range_count_mm: f64,
    },
    /// Height and depth in the part frame, as profile sensors deliver them.
    Cartesian {
        /// y and z per count, millimetres.
        count_mm: f64,
    },
}

impl Calibration {
    /// Where in a column's plane its rays come from, y and z in the part frame, millimetres; `None`
    /// where the device does not tell. With a correction this is the place where the table says
    /// x = 0; it moves with the table's skew, some hundredths of a millimetre for each of x.
    #[must_use]
    pub fn camera_mm(&self) -> Option<[f64; 2]> {
        let Head::Polar {
            camera_y_mm,
            camera_z_mm,
            ..
        } = self.head
        else {
            return None;
        };
        let [_, y_mm, z_mm] = self.correction.map_or([0.0; 3], |c| c.camera_mm);
        Some([camera_y_mm + y_mm, camera_z_mm + z_mm])
    }

    /// The calibration as the device announced it.
    #[must_use]
    pub fn as_announced(&self) -> Self {
        Self {
            correction: None,
            ..*self
        }
    }

    /// x of the part frame at a table position, millimetres.
    #[must_use]
    pub fn x_mm(&self, table_counts: i32) -> f64 {
        let x_mm = self.announced_x_mm(table_counts);
        match &self.correction {
            None => x_mm,
            Some(correction) => correction.camera_mm[0] + x_mm * correction.travel()[0],
        }
    }

    /// x where the table says it is, millimetres.
    fn announced_x_mm(&self, table_counts: i32) -> f64 {
        self.table_origin_mm + f64::from(table_counts) * self.table_count_mm
    }

    /// A sample in the part frame.
    ///
    /// `lateral_counts` is the ray's angle, or y; `range_counts` the distance along the
    /// ray, or z, as [`Head`] says.
    #[must_use]
    pub fn position(
        &self,
        table_counts: i32,
        lateral_counts: i32,
        range_counts: i32,
    ) -> Position<Part> {
        if let Some(correction) = &self.correction {
            return self.corrected(correction, table_counts, lateral_counts, range_counts);
        }
        let x_mm = self.announced_x_mm(table_counts);
        match self.head {
            Head::Polar {
                camera_y_mm,
                camera_z_mm,
                angle_count_rad,
                range_count_mm,
            } => {
                let seen = ray(
                    f64::from(lateral_counts) * angle_count_rad,
                    f64::from(range_counts) * range_count_mm,
                );
                Position::new(x_mm, camera_y_mm + seen.y_mm, camera_z_mm - seen.z_mm)
            }
            Head::Cartesian { count_mm } => Position::new(
                x_mm,
                f64::from(lateral_counts) * count_mm,
                f64::from(range_counts) * count_mm,
            ),
        }
    }

    fn corrected(
        &self,
        correction: &Correction,
        table_counts: i32,
        lateral_counts: i32,
        range_counts: i32,
    ) -> Position<Part> {
        let lateral = f64::from(lateral_counts) * (1.0 + correction.angle_scale);
        let range = f64::from(range_counts) * (1.0 + correction.range_scale);
        let turn_rad = correction.angle_offset_rad;
        // From the camera, in the plane of the rays; of a Cartesian head from the frame's origin.
        let (from, seen) = match self.head {
            Head::Polar {
                camera_y_mm,
                camera_z_mm,
                angle_count_rad,
                range_count_mm,
            } => {
                let seen = ray(
                    turn_rad + lateral * angle_count_rad,
                    correction.range_offset_mm + range * range_count_mm,
                );
                ([camera_y_mm, camera_z_mm], [seen.y_mm, -seen.z_mm])
            }
            Head::Cartesian { count_mm } => {
                let (sin, cos) = libm::sincos(turn_rad);
                let (y, z) = (lateral * count_mm, range * count_mm);
                ([0.0; 2], [y * cos - z * sin, y * sin + z * cos])
            }
        };
        let announced_mm = self.announced_x_mm(table_counts);
        let travel = correction.travel();
        let [dx, dy, dz] = correction.camera_mm;
        Position::new(
            dx + announced_mm * travel[0],
            from[0] + dy + announced_mm * travel[1] + seen[0],
            from[1] + dz + announced_mm * travel[2] + seen[1],
        )
    }
}

/// The point at a distance along the ray with this elevation, seen from the camera.
fn ray(angle_rad: f64, range_mm: f64) -> Position<Sensor> {
    let (sin, cos) = libm::sincos(angle_rad);
    Position::new(0.0, range_mm * sin, range_mm * cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polar_head_looks_along_minus_z() {
        let calibration = Calibration {
            table_origin_mm: -60.0,
            table_count_mm: 0.01,
            head: Head::Polar {
                camera_y_mm: 5.0,
                camera_z_mm: 750.0,
                angle_count_rad: 1e-6,
                range_count_mm: 0.1,
            },
            correction: None,
        };
        let ahead = calibration.position(6_000, 0, 7_500);
        assert_eq!((ahead.x_mm, ahead.y_mm, ahead.z_mm), (0.0, 5.0, 0.0));
        let up = calibration.position(0, 523_599, 1_000);
        assert!((up.y_mm - 55.0).abs() < 1e-4, "{up:?}");
        assert!((up.z_mm - (750.0 - 86.602_54)).abs() < 1e-4, "{up:?}");
    }

    #[test]
    fn a_cartesian_head_only_scales() {
        let calibration = Calibration {
            table_origin_mm: 1.0,
            table_count_mm: 0.5,
            head: Head::Cartesian { count_mm: 0.25 },
            correction: None,
        };
        assert_eq!(
            calibration.position(3, -8, 20),
            Position::new(2.5, -2.0, 5.0)
        );
    }

    /// A polar scanner whose deviations can be followed by hand.
    fn mounted(correction: Correction) -> Calibration {
        Calibration {
            table_origin_mm: -60.0,
            table_count_mm: 0.01,
            head: Head::Polar {
                camera_y_mm: 5.0,
                camera_z_mm: 750.0,
                angle_count_rad: 1e-6,
                range_count_mm: 0.1,
            },
            correction: Some(correction),
        }
    }

    #[test]
    fn no_deviation_changes_nothing_but_rounding() {
        let corrected = mounted(Correction::default());
        let announced = corrected.as_announced();
        assert_eq!(announced.correction, None);
        for (table, angle, range) in [(0, 0, 7_500), (12_345, 40_000, 7_011), (9, -1, 1)] {
            let (a, b) = (
                announced.position(table, angle, range),
                corrected.position(table, angle, range),
            );
            let off = [a.x_mm - b.x_mm, a.y_mm - b.y_mm, a.z_mm - b.z_mm];
            assert!(off.iter().all(|mm| mm.abs() < 1e-12), "{off:?}");
            assert_eq!(announced.x_mm(table), a.x_mm);
            assert_eq!(corrected.x_mm(table), b.x_mm);
        }
    }

    #[test]
    fn a_mounted_scanner_sees_where_it_looks() {
        // The ray at 29.9 degrees and 0.1 degrees of offset, 1 mm of range offset.
        let degrees = core::f64::consts::PI / 180.0;
        let calibration = mounted(Correction {
            angle_offset_rad: 0.1 * degrees,
            range_offset_mm: 1.0,
            camera_mm: [0.5, 2.0, -3.0],
            ..Correction::default()
        });
        let counts = libm::round(29.9 * degrees * 1e6) as i32;
        let seen = calibration.position(6_000, counts, 990);
        assert!((seen.x_mm - 0.5).abs() < 1e-12);
        assert!((seen.y_mm - (7.0 + 50.0)).abs() < 1e-4, "{seen:?}");
        assert!((seen.z_mm - (747.0 - 86.602_54)).abs() < 1e-4, "{seen:?}");
        assert_eq!(calibration.camera_mm(), Some([7.0, 747.0]));
    }

    #[test]
    fn a_table_that_moves_askew_takes_the_part_along() {
        let (sin, cos) = (0.6, 0.8);
        let calibration = mounted(Correction {
            table_y_rad: libm::atan2(sin, cos),
            table_scale: 0.01,
            ..Correction::default()
        });
        // 10 mm to the right of x = 0, as the table says.
        let seen = calibration.position(7_000, 0, 7_500);
        assert!((seen.x_mm - 10.1 * cos).abs() < 1e-12, "{seen:?}");
        assert!((seen.y_mm - (5.0 + 10.1 * sin)).abs() < 1e-12, "{seen:?}");
        assert!(seen.z_mm.abs() < 1e-12);
    }

    #[test]
    fn a_turned_cartesian_head_is_turned_back() {
        let quarter = core::f64::consts::FRAC_PI_2;
        let calibration = Calibration {
            table_origin_mm: 0.0,
            table_count_mm: 1.0,
            head: Head::Cartesian { count_mm: 0.25 },
            correction: Some(Correction {
                angle_offset_rad: quarter,
                angle_scale: 0.1,
                range_scale: -0.1,
                ..Correction::default()
            }),
        };
        let seen = calibration.position(3, -8, 20);
        assert!((seen.y_mm + 4.5).abs() < 1e-12, "{seen:?}");
        assert!((seen.z_mm + 2.2).abs() < 1e-12, "{seen:?}");
    }
}
