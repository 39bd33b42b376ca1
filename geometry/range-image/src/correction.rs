//! How a mounted scanner deviates from what it announces.

/// Deviations of a mounted scanner from its own calibration, as `relief calibrate` finds them.
///
/// All are zero for a scanner that is mounted as it says. Parts are told in the frame of the laser
/// plane, which is x = const: a plane that leans against the table is told by the direction in
/// which the table then travels. Every distance and angle on a part is the same in either frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Correction {
    /// Added to every ray's angle: the camera's roll about x, radians.
    pub angle_offset_rad: f64,
    /// By how much more than announced an angle count turns the ray, as a share; of a
    /// [Cartesian head](crate::calibration::Head::Cartesian) by how much longer y is.
    pub angle_scale: f64,
    /// Added to every range, millimetres; nothing of a Cartesian head, where it is the camera's z.
    pub range_offset_mm: f64,
    /// By how much longer than announced a range count is, as a share.
    pub range_scale: f64,
    /// Added to the camera's place, millimetres.
    pub camera_mm: [f64; 3],
    /// Direction of travel of the table, from x towards y, radians.
    pub table_y_rad: f64,
    /// Direction of travel of the table, from x towards z, radians.
    pub table_z_rad: f64,
    /// By how much farther than announced the table moves, as a share.
    pub table_scale: f64,
}

/// Deviations that a [`Correction`] tells.
pub const DEVIATIONS: usize = 10;

impl Correction {
    /// The deviations in the order of their declaration.
    #[must_use]
    pub fn to_array(&self) -> [f64; DEVIATIONS] {
        let [x, y, z] = self.camera_mm;
        [
            self.angle_offset_rad,
            self.angle_scale,
            self.range_offset_mm,
            self.range_scale,
            x,
            y,
            z,
            self.table_y_rad,
            self.table_z_rad,
            self.table_scale,
        ]
    }

    /// The correction with these deviations, in that order.
    #[must_use]
    pub fn from_array(deviations: [f64; DEVIATIONS]) -> Self {
        let [
            angle_offset_rad,
            angle_scale,
            range_offset_mm,
            range_scale,
            rest @ ..,
        ] = deviations;
        let [x, y, z, table_y_rad, table_z_rad, table_scale] = rest;
        Self {
            angle_offset_rad,
            angle_scale,
            range_offset_mm,
            range_scale,
            camera_mm: [x, y, z],
            table_y_rad,
            table_z_rad,
            table_scale,
        }
    }

    /// The first deviation that no mounted scanner has, in words; `None` if all are believable.
    ///
    /// A scale may be off by a fifth, an angle by half a right angle, a length by a metre: such
    /// numbers come from a damaged or a foreign file.
    #[must_use]
    pub fn implausible(&self) -> Option<&'static str> {
        let beyond = |value: f64, most: f64| value.is_nan() || value.abs() > most;
        const SCALE: f64 = 0.2;
        const ANGLE_RAD: f64 = core::f64::consts::FRAC_PI_4;
        const LENGTH_MM: f64 = 1000.0;
        let scales = [self.angle_scale, self.range_scale, self.table_scale];
        if scales.into_iter().any(|scale| beyond(scale, SCALE)) {
            return Some("a scale is off by more than 0.2");
        }
        let angles = [self.angle_offset_rad, self.table_y_rad, self.table_z_rad];
        if angles.into_iter().any(|angle| beyond(angle, ANGLE_RAD)) {
            return Some("an angle is off by more than 45 degrees");
        }
        let [x, y, z] = self.camera_mm;
        let lengths = [x, y, z, self.range_offset_mm];
        if lengths.into_iter().any(|length| beyond(length, LENGTH_MM)) {
            return Some("a length is off by more than 1000 mm");
        }
        None
    }

    /// How the object moves against the camera for each millimetre that the table says it moves.
    #[must_use]
    pub fn travel(&self) -> [f64; 3] {
        let (sin_y, cos_y) = libm::sincos(self.table_y_rad);
        let (sin_z, cos_z) = libm::sincos(self.table_z_rad);
        let scale = 1.0 + self.table_scale;
        [
            scale * (cos_y * cos_z),
            scale * (sin_y * cos_z),
            scale * sin_z,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_array_is_in_order_of_declaration() {
        let numbers = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0];
        let correction = Correction::from_array(numbers);
        assert_eq!(correction.to_array(), numbers);
        assert_eq!(correction.camera_mm, [5.0, 6.0, 7.0]);
        assert_eq!(correction.table_scale, 10.0);
    }

    #[test]
    fn what_no_scanner_has_is_told() {
        assert_eq!(Correction::default().implausible(), None);
        for index in 0..DEVIATIONS {
            for odd in [f64::NAN, f64::INFINITY, -1001.0] {
                let mut numbers = [0.0; DEVIATIONS];
                numbers[index] = odd;
                assert!(Correction::from_array(numbers).implausible().is_some());
            }
        }
    }
}
