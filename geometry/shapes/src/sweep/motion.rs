//! The motion that sweeps a profile over a surface, and the plane that the profile lies in.

use core::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Vector3;

/// Free numbers of a motion, at most.
pub const MOST_FREE: usize = 4;

/// How a profile is swept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Shifted along a direction.
    Extrusion,
    /// Turned about an axis.
    Revolution,
}

/// A motion with its profile plane, whose t is single valued in s as far as the scanner sees it:
///
/// | motion | s | t |
/// | --- | --- | --- |
/// | extrusion | across, in the image plane | height square to both |
/// | revolution, axis flat in the image | along the axis | radius |
/// | revolution, axis towards the scanner | radius | along the axis |
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// How it is swept.
    pub motion: Motion,
    /// A point of the axis.
    pub origin_mm: Vector3<f64>,
    /// Unit direction of the axis, or of the extrusion.
    pub axis: Vector3<f64>,
    /// Unit vectors square to it: the one across the other in the image plane, and up.
    across: Vector3<f64>,
    up: Vector3<f64>,
}

/// A point in the profile plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// Along the profile, millimetres.
    pub s_mm: f64,
    /// Across it, millimetres: towards the side that a scanner sees, but for hollow revolutions.
    pub t_mm: f64,
    /// Unit directions in which s and t grow there.
    s_way: Vector3<f64>,
    t_way: Vector3<f64>,
}

impl Placed {
    /// Unit normal of the surface there, on the side on which t grows, of a profile with this slope.
    #[must_use]
    pub fn normal(&self, slope: f64) -> Vector3<f64> {
        (self.t_way - self.s_way * slope) / (1.0 + slope * slope).sqrt()
    }
}

impl Sweep {
    /// `None` where the scanner looks along the extrusion: it does not see what it sweeps.
    #[must_use]
    pub fn new(motion: Motion, origin_mm: Vector3<f64>, axis: Vector3<f64>) -> Option<Self> {
        let axis = axis.try_normalize(0.0)?;
        let axis = if axis.z < 0.0 { -axis } else { axis };
        if motion == Motion::Extrusion && axis.z > FRAC_1_SQRT_2 {
            return None;
        }
        // Any will do of an axis that points straight to the scanner.
        let across = axis.cross(&Vector3::z()).try_normalize(1e-6);
        let across = across.unwrap_or_else(Vector3::x);
        let up = across.cross(&axis);
        Some(Self {
            motion,
            origin_mm,
            axis,
            across,
            up,
        })
    }

    /// How many numbers of it are free: turns across and up, and shifts of an axis.
    #[must_use]
    pub fn freedom(&self) -> usize {
        match self.motion {
            Motion::Extrusion => 2,
            Motion::Revolution => MOST_FREE,
        }
    }

    /// Unit vectors square to the axis and to each other, the ways of its free shifts: the one in the
    /// image plane, and up.
    #[must_use]
    pub fn across(&self) -> [Vector3<f64>; 2] {
        [self.across, self.up]
    }

    /// The axis lies flat in the image, rather than towards the scanner.
    #[must_use]
    pub fn is_flat(&self) -> bool {
        self.axis.z <= FRAC_1_SQRT_2
    }

    /// s is a radius.
    #[must_use]
    pub fn has_radius_along(&self) -> bool {
        self.motion == Motion::Revolution && !self.is_flat()
    }

    /// The same motion, told by the point of the axis nearest to another one.
    #[must_use]
    pub fn beside(&self, point_mm: &Vector3<f64>) -> Self {
        let along = (point_mm - self.origin_mm).dot(&self.axis);
        Self {
            origin_mm: self.origin_mm + self.axis * along,
            ..*self
        }
    }

    /// The point of the profile plane in the half plane from the axis towards a unit vector square to
    /// it; of an extrusion the one plane there is, whatever that vector.
    #[must_use]
    pub fn point_mm(&self, [s_mm, t_mm]: [f64; 2], towards: &Vector3<f64>) -> Vector3<f64> {
        let (s_way, t_way) = match self.motion {
            Motion::Extrusion => (self.across, self.up),
            Motion::Revolution if self.is_flat() => (self.axis, *towards),
            Motion::Revolution => (*towards, self.axis),
        };
        self.origin_mm + s_way * s_mm + t_way * t_mm
    }

    /// Where a point lies in the profile plane.
    #[must_use]
    pub fn place(&self, point_mm: &Vector3<f64>) -> Placed {
        let from = point_mm - self.origin_mm;
        let (s, t) = match self.motion {
            Motion::Extrusion => (
                (from.dot(&self.across), self.across),
                (from.dot(&self.up), self.up),
            ),
            Motion::Revolution => {
                let along = from.dot(&self.axis);
                let out = from - self.axis * along;
                let radius_mm = out.norm();
                let out = out / radius_mm.max(f64::MIN_POSITIVE);
                let (along, radius) = ((along, self.axis), (radius_mm, out));
                if self.is_flat() {
                    (along, radius)
                } else {
                    (radius, along)
                }
            }
        };
        Placed {
            s_mm: s.0,
            t_mm: t.0,
            s_way: s.1,
            t_way: t.1,
        }
    }

    /// By how much s and t of a point change with each free number, from its origin on.
    #[must_use]
    pub fn changes(&self, point_mm: &Vector3<f64>) -> [(f64, f64); MOST_FREE] {
        let from = point_mm - self.origin_mm;
        let along = from.dot(&self.axis);
        match self.motion {
            Motion::Extrusion => [(-along, 0.0), (0.0, -along), (0.0, 0.0), (0.0, 0.0)],
            Motion::Revolution => {
                let out = from - self.axis * along;
                let radius_mm = out.norm();
                let out = out / radius_mm.max(f64::MIN_POSITIVE);
                let turns = [self.across, self.up].map(|side| {
                    let share = out.dot(&side);
                    (radius_mm * share, -along * share)
                });
                let shifts = [self.across, self.up].map(|side| (0.0, -out.dot(&side)));
                let changes = [turns[0], turns[1], shifts[0], shifts[1]];
                if self.is_flat() {
                    changes
                } else {
                    changes.map(|(along, radius)| (radius, along))
                }
            }
        }
    }

    /// The motion after a step of its free numbers.
    #[must_use]
    pub fn moved(&self, step: &[f64; MOST_FREE]) -> Option<Self> {
        let axis = self.axis + self.across * step[0] + self.up * step[1];
        let origin_mm = self.origin_mm + self.across * step[2] + self.up * step[3];
        Self::new(self.motion, origin_mm, axis)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_those_of_a_small_step() {
        const STEP: f64 = 1e-6;
        let origin = Vector3::new(1.0, 2.0, -3.0);
        for (motion, axis) in [
            (Motion::Extrusion, Vector3::new(0.8, -0.5, 0.2)),
            (Motion::Revolution, Vector3::new(0.8, -0.5, 0.2)),
            (Motion::Revolution, Vector3::new(0.2, -0.1, 0.9)),
        ] {
            let sweep = Sweep::new(motion, origin, axis).unwrap();
            let point = Vector3::new(7.0, -4.0, 12.0);
            let changes = sweep.changes(&point);
            for k in 0..sweep.freedom() {
                let mut step = [0.0; MOST_FREE];
                step[k] = STEP;
                let (before, after) = (sweep.place(&point), sweep.moved(&step).unwrap());
                let after = after.place(&point);
                let s = (after.s_mm - before.s_mm) / STEP;
                let t = (after.t_mm - before.t_mm) / STEP;
                // An extrusion's frame turns about its direction, too, which moves the profile
                // as a whole.
                if motion == Motion::Revolution {
                    let (told_s, told_t) = changes[k];
                    assert!((s - told_s).abs() < 1e-4, "{motion:?} {k}: {s} {told_s}");
                    assert!((t - told_t).abs() < 1e-4, "{motion:?} {k}: {t} {told_t}");
                }
            }
        }
    }

    #[test]
    fn what_is_looked_along_is_not_swept() {
        let along_z = |motion| Sweep::new(motion, Vector3::zeros(), Vector3::z());
        assert!(along_z(Motion::Extrusion).is_none());
        let disc = along_z(Motion::Revolution).unwrap();
        let placed = disc.place(&Vector3::new(3.0, 4.0, 2.0));
        assert!((placed.s_mm - 5.0).abs() < 1e-12 && (placed.t_mm - 2.0).abs() < 1e-12);
    }
}
