//! How the head is mounted against what the device announces: never quite as it should be.

use std::str::FromStr;

use glam::DMat3;

use crate::Vec3;
use crate::optics::{Optics, Turn};

/// Deviations of the mounted head and table. The device goes on announcing what it was built for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Mount {
    /// Beams leave at an angle greater than told by this, radians.
    pub angle_offset_rad: f64,
    /// Angles are greater than told by this share.
    pub angle_scale: f64,
    /// Ranges are longer than told by this, millimetres.
    pub range_offset_mm: f64,
    /// Ranges are longer than told by this share.
    pub range_scale: f64,
    /// The laser's pivot is higher than told by this, millimetres.
    pub camera_y_mm: f64,
    /// The laser's pivot is farther from the object than told by this, millimetres.
    pub camera_z_mm: f64,
    /// The plane of the beams is turned about y by this, radians.
    pub plane_about_y_rad: f64,
    /// The plane of the beams is turned about z by this, radians.
    pub plane_about_z_rad: f64,
    /// The camera travels along the object askew, from x towards y, radians.
    pub table_y_rad: f64,
    /// The camera travels along the object askew, from x towards z, radians.
    pub table_z_rad: f64,
    /// The table moves farther than told by this share.
    pub table_scale: f64,
}

/// Where the head is while a column is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stand {
    pub(crate) laser_mm: Vec3,
    pub(crate) turn: Turn,
}

impl Mount {
    /// Where the head is at the x that the table tells, before an object that has been moved.
    pub(crate) fn stand(&self, optics: &Optics, x_mm: f64, part_offset_mm: Vec3) -> Stand {
        if *self == Self::default() {
            // Operation by operation as for a device that is as it says.
            let mut moved = *optics;
            moved.camera_y_mm -= part_offset_mm.y;
            moved.camera_z_mm -= part_offset_mm.z;
            return Stand {
                laser_mm: moved.laser_mm(x_mm - part_offset_mm.x),
                turn: Turn::None,
            };
        }
        let (sin_y, cos_y) = libm::sincos(self.table_y_rad);
        let (sin_z, cos_z) = libm::sincos(self.table_z_rad);
        let way = Vec3::new(cos_y * cos_z, sin_y * cos_z, sin_z);
        let at_zero = optics.laser_mm(0.0) + Vec3::new(0.0, self.camera_y_mm, self.camera_z_mm);
        Stand {
            laser_mm: at_zero + way * (x_mm * (1.0 + self.table_scale)) - part_offset_mm,
            turn: Turn::By(self.rotation()),
        }
    }

    /// From the head's own directions to the part frame: about y, then about z.
    fn rotation(&self) -> DMat3 {
        let (sin_y, cos_y) = libm::sincos(self.plane_about_y_rad);
        let (sin_z, cos_z) = libm::sincos(self.plane_about_z_rad);
        let about_y = DMat3::from_cols(
            Vec3::new(cos_y, 0.0, -sin_y),
            Vec3::Y,
            Vec3::new(sin_y, 0.0, cos_y),
        );
        let about_z = DMat3::from_cols(
            Vec3::new(cos_z, sin_z, 0.0),
            Vec3::new(-sin_z, cos_z, 0.0),
            Vec3::Z,
        );
        about_z * about_y
    }

    /// Angle at which a beam leaves that is told to leave at another, radians.
    pub(crate) fn angle_rad(&self, told_rad: f64) -> f64 {
        if self.angle_offset_rad == 0.0 && self.angle_scale == 0.0 {
            return told_rad;
        }
        self.angle_offset_rad + (1.0 + self.angle_scale) * told_rad
    }

    /// What is told of a range, millimetres.
    pub(crate) fn told_range_mm(&self, range_mm: f64) -> f64 {
        if self.range_offset_mm == 0.0 && self.range_scale == 0.0 {
            return range_mm;
        }
        (range_mm - self.range_offset_mm) / (1.0 + self.range_scale)
    }

    /// Whether a scanner can be mounted so badly.
    ///
    /// # Errors
    /// The first deviation that is out of its range, with the range.
    pub fn validate(&self) -> Result<(), String> {
        for (key, value, most) in self.numbers() {
            if !(-most..=most).contains(&value) {
                return Err(format!(
                    "mount: {key} must lie between -{most} and {most}, not {value}"
                ));
            }
        }
        Ok(())
    }

    /// Each deviation by its key, in the key's unit, with the most that is allowed.
    fn numbers(&self) -> [(&'static str, f64, f64); 11] {
        const ANGLE_DEG: f64 = 10.0;
        const LENGTH_MM: f64 = 100.0;
        const SCALE: f64 = 0.1;
        let degrees = f64::to_degrees;
        [
            (
                "angle-offset-deg",
                degrees(self.angle_offset_rad),
                ANGLE_DEG,
            ),
            ("angle-scale", self.angle_scale, SCALE),
            ("range-offset-mm", self.range_offset_mm, LENGTH_MM),
            ("range-scale", self.range_scale, SCALE),
            ("camera-y-mm", self.camera_y_mm, LENGTH_MM),
            ("camera-z-mm", self.camera_z_mm, LENGTH_MM),
            (
                "plane-about-y-deg",
                degrees(self.plane_about_y_rad),
                ANGLE_DEG,
            ),
            (
                "plane-about-z-deg",
                degrees(self.plane_about_z_rad),
                ANGLE_DEG,
            ),
            ("table-y-deg", degrees(self.table_y_rad), ANGLE_DEG),
            ("table-z-deg", degrees(self.table_z_rad), ANGLE_DEG),
            ("table-scale", self.table_scale, SCALE),
        ]
    }
}

impl FromStr for Mount {
    type Err = String;

    /// From `key=value,...`; what is left out is as it should be.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut mount = Self::default();
        for part in text.split(',').filter(|part| !part.trim().is_empty()) {
            let (key, value) = part
                .split_once('=')
                .ok_or_else(|| format!("{part:?} is not key=value"))?;
            let value: f64 = value
                .trim()
                .parse()
                .map_err(|_| format!("{value:?} is not a number"))?;
            let rad = value.to_radians();
            match key.trim() {
                "angle-offset-deg" => mount.angle_offset_rad = rad,
                "angle-scale" => mount.angle_scale = value,
                "range-offset-mm" => mount.range_offset_mm = value,
                "range-scale" => mount.range_scale = value,
                "camera-y-mm" => mount.camera_y_mm = value,
                "camera-z-mm" => mount.camera_z_mm = value,
                "plane-about-y-deg" => mount.plane_about_y_rad = rad,
                "plane-about-z-deg" => mount.plane_about_z_rad = rad,
                "table-y-deg" => mount.table_y_rad = rad,
                "table-z-deg" => mount.table_z_rad = rad,
                "table-scale" => mount.table_scale = value,
                other => {
                    let known: Vec<_> = mount.numbers().map(|(key, ..)| key).to_vec();
                    return Err(format!(
                        "{other:?} is no deviation of a mount; known: {}",
                        known.join(", ")
                    ));
                }
            }
        }
        mount.validate()?;
        Ok(mount)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mount_is_read_from_its_keys() {
        let mount: Mount = "angle-offset-deg=0.5,camera-y-mm=-2,angle-scale=0.005"
            .parse()
            .expect("as in the contract");
        assert!((mount.angle_offset_rad - 0.5_f64.to_radians()).abs() < 1e-15);
        assert_eq!((mount.camera_y_mm, mount.angle_scale), (-2.0, 0.005));
        assert_eq!("".parse(), Ok(Mount::default()));
        for wrong in ["angle=1", "camera-y-mm", "camera-y-mm=x", "angle-scale=0.5"] {
            assert!(wrong.parse::<Mount>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_head_turns_about_y_and_then_about_z() {
        let mount = Mount {
            plane_about_y_rad: 0.1,
            plane_about_z_rad: 0.2,
            ..Mount::default()
        };
        // The normal of the plane of the beams.
        let normal = mount.rotation() * Vec3::X;
        let expected = Vec3::new(
            libm::cos(0.1) * libm::cos(0.2),
            libm::cos(0.1) * libm::sin(0.2),
            -libm::sin(0.1),
        );
        assert!(normal.distance(expected) < 1e-15, "{normal}");
    }
}
