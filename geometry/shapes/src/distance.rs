//! How far points lie off a shape, and how that changes with the point and with the shape.

use nalgebra::Vector3;

use crate::fit::{ACROSS, Sample};
use crate::local::{Local, MOST_FREE, NUMBERS, SHIFT, TILT_ACROSS, TILT_ALONG, TURN};
use crate::shape::Family;

/// What tells distances from a shape: what is the same for all points is worked out once.
pub(crate) struct Distances {
    family: Family,
    place: Vector3<f64>,
    along: Vector3<f64>,
    across: Vector3<f64>,
    normal: Vector3<f64>,
    /// The first of the shape's numbers: a curvature, or 1 / distance from the axis.
    first: f64,
    /// Sine and cosine of the second.
    sin: f64,
    cos: f64,
    /// Radius of a torus's tube, negative where it is hollow.
    tube: f64,
}

/// A number that depends on a shape, and its derivatives by the numbers of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sloped {
    pub(crate) value: f64,
    pub(crate) by: [f64; MOST_FREE],
}

/// A point or a direction, along, across and above the place where a shape is seen from.
type Seen = [f64; 3];

#[inline(always)]
fn dot(a: Seen, b: Seen) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Signed distance of a point, positive above, and its derivatives.
struct Off {
    value: f64,
    /// By the point: the unit normal beside it.
    gradient: Seen,
    /// By the shape's own numbers.
    numbers: [f64; 3],
}

impl Distances {
    pub(crate) fn of(local: &Local) -> Self {
        let [first, second, third] = local.numbers;
        let has_angle = matches!(local.family, Family::Cone | Family::Torus);
        let (sin, cos) = libm::sincos(if has_angle { second } else { 0.0 });
        let is_torus = local.family == Family::Torus;
        Self {
            family: local.family,
            place: local.place,
            along: local.along,
            across: local.normal.cross(&local.along),
            normal: local.normal,
            first,
            sin,
            cos,
            tube: if is_torus { 1.0 / third } else { 0.0 },
        }
    }

    /// Signed distance of a point, millimetres, positive above.
    pub(crate) fn distance(&self, point: &Vector3<f64>) -> f64 {
        self.at(self.seen(&(point - self.place))).value
    }

    /// The same, with its derivatives.
    pub(crate) fn sloped_distance(&self, point: &Vector3<f64>) -> Sloped {
        let seen = self.seen(&(point - self.place));
        self.sloped(&self.at(seen), seen)
    }

    /// How far a sample lies off along its ray, in its standard deviations, positive above: the
    /// distance over the share of it that the ray covers on its way to the surface.
    pub(crate) fn off(&self, sample: &Sample) -> f64 {
        let way = self.way(sample);
        way.here.value / way.deviation_mm(sample)
    }

    /// The same, with its derivatives.
    pub(crate) fn sloped_off(&self, sample: &Sample) -> Sloped {
        let way = self.way(sample);
        let deviation_mm = way.deviation_mm(sample);
        let here = self.sloped(&way.here, way.from);
        let there = self.sloped(&way.there, way.to);
        // What the deviation changes by, over itself, is this times what the covered share does.
        let by_covered = way.covered() * (sample.sigma_mm / deviation_mm).powi(2);
        let value = here.value / deviation_mm;
        let by = core::array::from_fn(|k| {
            let covered = (here.by[k] - there.by[k]) / way.back_mm;
            here.by[k] / deviation_mm - value * by_covered * covered
        });
        Sloped { value, by }
    }

    /// Distance of a sample, and its standard deviation as the slope beside it has it,
    /// millimetres: sooner told than [`Self::off`], and good enough to find one's way by.
    pub(crate) fn about(&self, sample: &Sample) -> (f64, f64) {
        let here = self.at(self.seen(&(sample.point_mm - self.place)));
        let covered = dot(here.gradient, self.seen(&sample.ray));
        let deviation_mm = (covered * covered + ACROSS * ACROSS).sqrt() * sample.sigma_mm;
        (here.value, deviation_mm)
    }

    #[inline]
    fn seen(&self, way: &Vector3<f64>) -> Seen {
        [
            way.dot(&self.along),
            way.dot(&self.across),
            way.dot(&self.normal),
        ]
    }

    #[inline]
    fn way(&self, sample: &Sample) -> Way {
        /// How far along the ray the distance is looked at once more, millimetres, at least, and
        /// at most, in the sample's deviations.
        const STEP_MM: f64 = 1e-3;
        const MOST: f64 = 4.0;
        let from = self.seen(&(sample.point_mm - self.place));
        let ray = self.seen(&sample.ray);
        let here = self.at(from);
        let covered = dot(here.gradient, ray);
        let back_mm = here.value / covered.abs().max(ACROSS).copysign(covered);
        let most_mm = (MOST * sample.sigma_mm).max(STEP_MM);
        let back_mm = back_mm.clamp(-most_mm, most_mm);
        let back_mm = back_mm.abs().max(STEP_MM).copysign(back_mm);
        let to = [0, 1, 2].map(|k| from[k] - ray[k] * back_mm);
        Way {
            there: self.at(to),
            here,
            from,
            to,
            back_mm,
        }
    }

    /// Written once for values and derivatives: inlined, where only the value is asked for, the
    /// derivatives cost nothing.
    #[inline(always)]
    fn at(&self, [u, v, s]: Seen) -> Off {
        let Self {
            first, sin, cos, ..
        } = *self;
        match self.family {
            Family::Plane => Off {
                value: s,
                gradient: [0.0, 0.0, 1.0],
                numbers: [0.0; 3],
            },
            Family::Sphere => {
                let round = Round::of(first, u * u + v * v + s * s, s);
                Off {
                    value: round.value,
                    gradient: [round.by_side(u), round.by_side(v), round.by_above(s)],
                    numbers: [round.by_curvature, 0.0, 0.0],
                }
            }
            Family::Cylinder => {
                let round = Round::of(first, v * v + s * s, s);
                Off {
                    value: round.value,
                    gradient: [0.0, round.by_side(v), round.by_above(s)],
                    numbers: [round.by_curvature, 0.0, 0.0],
                }
            }
            Family::Cone => {
                let (out, up) = (sin * u + cos * s, cos * u - sin * s);
                let round = Round::of(first, v * v + out * out, out);
                let by_out = cos * round.by_above(out);
                Off {
                    value: cos * round.value - sin * up,
                    gradient: [
                        sin * (by_out - cos),
                        cos * round.by_side(v),
                        cos * by_out + sin * sin,
                    ],
                    numbers: [
                        cos * round.by_curvature,
                        (by_out - cos) * up + sin * (out - round.value),
                        0.0,
                    ],
                }
            }
            Family::Torus => {
                let tube = self.tube;
                let raised = s + tube;
                let (out, up) = (cos * raised - sin * u, sin * raised + cos * u);
                let round = Round::of(first, v * v + out * out, out);
                let from_centre = root(round.value * round.value + up * up);
                let side = 1.0_f64.copysign(tube);
                let by_round = side * round.value / from_centre;
                let by_up = side * up / from_centre;
                let by_out = by_round * round.by_above(out);
                let by_raised = by_out * cos + by_up * sin;
                Off {
                    value: side * from_centre - tube,
                    gradient: [
                        by_up * cos - by_out * sin,
                        by_round * round.by_side(v),
                        by_raised,
                    ],
                    numbers: [
                        by_round * round.by_curvature,
                        by_up * out - by_out * up,
                        (1.0 - by_raised) * tube * tube,
                    ],
                }
            }
        }
    }

    /// Derivatives by the numbers of a step: to move a shape is to move the point the other way.
    #[inline(always)]
    fn sloped(&self, off: &Off, [u, v, s]: Seen) -> Sloped {
        let [by_u, by_v, by_s] = off.gradient;
        let mut by = [0.0; MOST_FREE];
        by[SHIFT] = -by_s;
        by[TILT_ALONG] = u * by_s - s * by_u;
        by[TILT_ACROSS] = v * by_s - s * by_v;
        by[TURN] = v * by_u - u * by_v;
        for (index, slope) in NUMBERS.into_iter().zip(off.numbers) {
            by[index] = slope;
        }
        Sloped {
            value: off.value,
            by,
        }
    }
}

/// A sample's way along its ray to a surface.
///
/// The share of the way that counts as distance at the sample is not that half way to the
/// surface: where a surface turns away, samples before it would count otherwise than those
/// behind, and the radius of a rod of 3 mm seen to 75 degrees would be off by four times its
/// uncertainty. So the distance is looked at once more farther on.
struct Way {
    here: Off,
    there: Off,
    from: Seen,
    to: Seen,
    /// How long it is, against the ray.
    back_mm: f64,
}

impl Way {
    /// The distance covered for each millimetre along the ray.
    #[inline(always)]
    fn covered(&self) -> f64 {
        (self.here.value - self.there.value) / self.back_mm
    }

    /// Standard deviation of the sample's distance.
    #[inline(always)]
    fn deviation_mm(&self, sample: &Sample) -> f64 {
        let covered = self.covered();
        (covered * covered + ACROSS * ACROSS).sqrt() * sample.sigma_mm
    }
}

/// How much farther a point is from the centre of a circle than the circle, which passes
/// through the origin with this curvature: from the point's squared distance to the origin
/// and how far it is above it. As the curvature goes to zero this becomes the height.
struct Round {
    value: f64,
    by_curvature: f64,
    curvature: f64,
    /// Over the point's distance from the centre in radii.
    per_radius: f64,
}

impl Round {
    #[inline(always)]
    fn of(curvature: f64, distance2: f64, above: f64) -> Self {
        let twice = curvature * distance2 + above * 2.0;
        let radii = root(curvature * twice + 1.0);
        let value = twice / (radii + 1.0);
        let per_radius = 1.0 / radii;
        Self {
            value,
            // Of curvature * value^2 + 2 * value = twice.
            by_curvature: 0.5 * (distance2 - value * value) * per_radius,
            curvature,
            per_radius,
        }
    }

    /// By one of the point's coordinates to the side.
    #[inline(always)]
    fn by_side(&self, at: f64) -> f64 {
        self.curvature * at * self.per_radius
    }

    /// By its height.
    #[inline(always)]
    fn by_above(&self, at: f64) -> f64 {
        (self.curvature * at + 1.0) * self.per_radius
    }
}

/// The square root of what is not less than nothing but for rounding; never zero.
#[inline(always)]
fn root(square: f64) -> f64 {
    square.max(f64::MIN_POSITIVE).sqrt()
}
