//! A surface that a motion sweeps of a profile.

use nalgebra::Vector3;
use nurbs::PiecewiseCubic;

use super::motion::{Motion, Sweep};

/// Steps of Newton's method.
const MOST_STEPS: usize = 60;
/// Distance at which a point lies on a surface, millimetres.
const NEAR_ENOUGH_MM: f64 = 1e-10;
/// Cosine between z and the normal below which a surface is seen edge on.
const LEAST_FACING: f64 = 0.01;

/// A surface of extrusion or revolution, in the part frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Swept {
    /// The motion.
    pub sweep: Sweep,
    /// t over s in the profile plane, millimetres; straight at both ends, where nothing was seen.
    pub profile: PiecewiseCubic<1>,
    /// A revolution that is seen from within.
    pub is_hollow: bool,
}

impl Swept {
    /// How far a point lies off the surface, millimetres, positive on the side that was seen: exact
    /// on it, and to first order beside it.
    #[must_use]
    pub fn distance_mm(&self, point_mm: &Vector3<f64>) -> f64 {
        let placed = self.sweep.place(point_mm);
        let [value, slope] = self.profile_at(placed.s_mm);
        let off = (placed.t_mm - value) / (1.0 + slope * slope).sqrt();
        if self.is_hollow { -off } else { off }
    }

    /// Unit normal beside a point, towards the side that was seen.
    #[must_use]
    pub fn normal(&self, point_mm: &Vector3<f64>) -> Vector3<f64> {
        let placed = self.sweep.place(point_mm);
        let normal = placed.normal(self.profile_at(placed.s_mm)[1]);
        if self.is_hollow { -normal } else { normal }
    }

    /// As [`crate::Shape::z_mm`].
    #[must_use]
    pub fn z_mm(&self, x_mm: f64, y_mm: f64, near_mm: f64) -> Option<f64> {
        let mut point_mm = Vector3::new(x_mm, y_mm, near_mm);
        for _ in 0..MOST_STEPS {
            let off_mm = self.distance_mm(&point_mm);
            let facing = self.normal(&point_mm).z;
            if off_mm.abs() < NEAR_ENOUGH_MM {
                return (facing > LEAST_FACING).then_some(point_mm.z);
            }
            if facing.is_nan() || facing <= LEAST_FACING {
                return None;
            }
            point_mm.z -= off_mm / facing;
        }
        None
    }

    /// What is swept, in space: in the half plane from the axis towards a unit vector square to it.
    #[must_use]
    pub fn generatrix(&self, towards: &Vector3<f64>) -> PiecewiseCubic<3> {
        let pieces = self.profile.breaks.iter().zip(&self.profile.pieces);
        let pieces = pieces.map(|(start, [t])| {
            let s = [*start, 1.0, 0.0, 0.0];
            let origin = self.sweep.point_mm([0.0; 2], towards);
            let at = |k: usize| {
                let from = self.sweep.point_mm([s[k], t[k]], towards);
                if k == 0 { from } else { from - origin }
            };
            let all: [Vector3<f64>; 4] = core::array::from_fn(at);
            core::array::from_fn(|d| core::array::from_fn(|k| all[k][d]))
        });
        PiecewiseCubic {
            breaks: self.profile.breaks.clone(),
            pieces: pieces.collect(),
        }
    }

    /// A point of the surface in the middle of its profile, beside that of the axis that its motion is
    /// told by.
    #[must_use]
    pub fn point_mm(&self) -> Vector3<f64> {
        let (first, last) = self.profile.domain();
        let s_mm = (first + last) / 2.0;
        let [_, up] = self.sweep.across();
        self.sweep.point_mm([s_mm, self.profile_at(s_mm)[0]], &up)
    }

    /// The profile and its slope. Beyond its ends it goes on straight.
    fn profile_at(&self, s_mm: f64) -> [f64; 2] {
        [0, 1].map(|order| self.profile.derivative(s_mm, order)[0])
    }

    /// Its name in reports.
    #[must_use]
    pub fn as_str(&self) -> &'static str {
        match self.sweep.motion {
            Motion::Extrusion => "extrusion",
            Motion::Revolution => "revolution",
        }
    }
}
