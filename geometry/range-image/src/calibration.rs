//! From device counts to millimetres: the only place where the two meet.

use crate::frame::{Part, Position, Sensor};

/// How a scanner's counts map to the part frame. The device announces it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// x of the part frame at table position 0, millimetres.
    pub table_origin_mm: f64,
    /// Travel of the table per count, millimetres.
    pub table_count_mm: f64,
    /// What a sample's two numbers mean.
    pub head: Head,
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

impl Head {
    /// Where in a column's plane its rays come from, y and z in the part frame, millimetres; `None`
    /// where the device does not tell.
    #[must_use]
    pub fn camera_mm(&self) -> Option<[f64; 2]> {
        match *self {
            Self::Polar {
                camera_y_mm,
                camera_z_mm,
                ..
            } => Some([camera_y_mm, camera_z_mm]),
            Self::Cartesian { .. } => None,
        }
    }
}

impl Calibration {
    /// x of the part frame at a table position, millimetres.
    #[must_use]
    pub fn x_mm(&self, table_counts: i32) -> f64 {
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
        let x_mm = self.x_mm(table_counts);
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
        };
        assert_eq!(
            calibration.position(3, -8, 20),
            Position::new(2.5, -2.0, 5.0)
        );
    }
}
