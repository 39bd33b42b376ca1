//! Rigid motions.

use glam::{DMat3, DVec3};

/// A rigid motion `p -> R p + t`. In this crate it takes the scan's frame to the nominal's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    rotation: DMat3,
    translation_mm: DVec3,
}

impl Default for Pose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Pose {
    /// No motion.
    pub const IDENTITY: Self = Self {
        rotation: DMat3::IDENTITY,
        translation_mm: DVec3::ZERO,
    };

    /// Turns about an axis through the origin, by the length of `rotation_vector_rad` and in the
    /// right-handed sense about its direction, then shifts.
    #[must_use]
    pub fn new(rotation_vector_rad: [f64; 3], translation_mm: [f64; 3]) -> Self {
        Self {
            rotation: turning(DVec3::from_array(rotation_vector_rad)),
            translation_mm: DVec3::from_array(translation_mm),
        }
    }

    /// Turns about an axis through `centre_mm`, then shifts.
    pub(crate) fn about(centre_mm: DVec3, rotation_vector_rad: DVec3, shift_mm: DVec3) -> Self {
        let rotation = turning(rotation_vector_rad);
        Self {
            rotation,
            translation_mm: centre_mm - rotation * centre_mm + shift_mm,
        }
    }

    /// This motion, then another.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        Self {
            rotation: orthonormal(next.rotation * self.rotation),
            translation_mm: next.rotation * self.translation_mm + next.translation_mm,
        }
    }

    /// The motion back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self {
            rotation,
            translation_mm: -(rotation * self.translation_mm),
        }
    }

    /// Where a point goes.
    #[must_use]
    pub fn apply(&self, point_mm: [f64; 3]) -> [f64; 3] {
        self.point(DVec3::from_array(point_mm)).to_array()
    }

    pub(crate) fn point(&self, point_mm: DVec3) -> DVec3 {
        self.rotation * point_mm + self.translation_mm
    }

    pub(crate) fn direction(&self, direction: DVec3) -> DVec3 {
        self.rotation * direction
    }

    /// Where the origin goes, millimetres.
    #[must_use]
    pub fn translation_mm(&self) -> [f64; 3] {
        self.translation_mm.to_array()
    }

    /// Axis of the turning times its angle, 0 to pi, radians.
    #[must_use]
    pub fn rotation_vector_rad(&self) -> [f64; 3] {
        let m = self.rotation;
        let twice_sine_axis = DVec3::new(
            m.y_axis.z - m.z_axis.y,
            m.z_axis.x - m.x_axis.z,
            m.x_axis.y - m.y_axis.x,
        );
        let cosine = (m.x_axis.x + m.y_axis.y + m.z_axis.z - 1.0) / 2.0;
        let sine = twice_sine_axis.length() / 2.0;
        let angle_rad = libm::atan2(sine, cosine);
        if sine > 1e-7 {
            return (twice_sine_axis * (angle_rad / (2.0 * sine))).to_array();
        }
        if cosine > 0.0 {
            return (twice_sine_axis / 2.0).to_array();
        }
        // Half a turn: R + 1 is twice the projection onto the axis.
        let columns = [
            m.x_axis + DVec3::X,
            m.y_axis + DVec3::Y,
            m.z_axis + DVec3::Z,
        ];
        let longest = columns.into_iter().fold(DVec3::ZERO, |longest, column| {
            if column.length_squared() > longest.length_squared() {
                column
            } else {
                longest
            }
        });
        (longest.normalize_or_zero() * angle_rad).to_array()
    }

    /// Rows of the homogeneous 4 x 4 matrix, lengths in millimetres.
    #[must_use]
    pub fn matrix(&self) -> [[f64; 4]; 4] {
        let m = self.rotation;
        let t = self.translation_mm;
        [
            [m.x_axis.x, m.y_axis.x, m.z_axis.x, t.x],
            [m.x_axis.y, m.y_axis.y, m.z_axis.y, t.y],
            [m.x_axis.z, m.y_axis.z, m.z_axis.z, t.z],
            [0.0, 0.0, 0.0, 1.0],
        ]
    }
}

/// Rodrigues' formula; sine and cosine from libm, for the same bits on every machine.
fn turning(vector_rad: DVec3) -> DMat3 {
    let angle_rad = vector_rad.length();
    if angle_rad == 0.0 || !angle_rad.is_finite() {
        return DMat3::IDENTITY;
    }
    let a = vector_rad / angle_rad;
    let (sine, cosine) = libm::sincos(angle_rad);
    let turned = |v: DVec3| v * cosine + a.cross(v) * sine + a * (a.dot(v) * (1.0 - cosine));
    DMat3::from_cols(turned(DVec3::X), turned(DVec3::Y), turned(DVec3::Z))
}

/// Many small motions in a row must not bend the frame.
fn orthonormal(matrix: DMat3) -> DMat3 {
    let x = matrix.x_axis.normalize_or(DVec3::X);
    let y = (matrix.y_axis - x * x.dot(matrix.y_axis)).normalize_or(DVec3::Y);
    DMat3::from_cols(x, y, x.cross(y))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: [f64; 3], b: [f64; 3], within: f64) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= within)
    }

    #[test]
    fn a_quarter_turn_takes_x_to_y() {
        let pose = Pose::new([0.0, 0.0, core::f64::consts::FRAC_PI_2], [1.0, 2.0, 3.0]);
        assert!(near(pose.apply([1.0, 0.0, 0.0]), [1.0, 3.0, 3.0], 1e-15));
        let back = pose.then(&pose.inverse());
        assert!(near(back.apply([4.0, 5.0, 6.0]), [4.0, 5.0, 6.0], 1e-14));
    }

    #[test]
    fn the_rotation_vector_comes_back() {
        let pi = core::f64::consts::PI;
        for vector in [
            [0.0, 0.0, 0.0],
            [1e-9, 0.0, -2e-9],
            [0.3, -0.4, 1.2],
            [0.0, 0.0, pi - 1e-9],
            [pi, 0.0, 0.0],
        ] {
            let found = Pose::new(vector, [0.0; 3]).rotation_vector_rad();
            assert!(near(found, vector, 1e-7), "{vector:?} {found:?}");
        }
    }
}
