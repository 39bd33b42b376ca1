//! The rounded edge of two shapes: what a ball that rolls along both leaves.

use nalgebra::Vector3;
use shapes::{Cylinder, Sample, Shape};

use crate::search::least;
use crate::split::STRAY;

/// Least turn from one shape to the other, radians: less is told by the shapes themselves.
const LEAST_TURN: f64 = 0.1;
/// Radii looked at, in pitches, how many of them, and halvings between the best two.
const RADII: (f64, f64) = (0.25, 250.0);
const FIRST: u32 = 31;
const HALVINGS: u32 = 12;
/// Steps towards the middle of the ball. Between planes the first one gets there.
const STEPS: usize = 4;
const NEAR_ENOUGH_MM: f64 = 1e-6;

/// Two shapes, and the round edge between them.
pub(crate) struct Rounding {
    shapes: [Shape; 2],
    /// 1 where the edge stands out, -1 where it lies deep.
    sign: f64,
    /// Square of the sine of [`LEAST_TURN`].
    least_sine2: f64,
}

/// What a place near an edge is of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Side {
    First,
    Second,
    /// The rounding, which is a cylinder there.
    Between(Cylinder),
}

impl Rounding {
    /// `None` where the shapes have no edge by these samples near it.
    pub(crate) fn of(shapes: [Shape; 2], near: &[Sample]) -> Option<Self> {
        let (mut sum_mm, mut turned) = (0.0, 0_usize);
        let most_cosine = libm::cos(LEAST_TURN);
        for sample in near {
            let p = &sample.point_mm;
            // What lies below both is the edge of a body.
            sum_mm += shapes.iter().map(|s| s.distance_mm(p)).sum::<f64>();
            let [a, b] = shapes.map(|shape| shape.normal(p));
            turned += usize::from(a.dot(&b) <= most_cosine);
        }
        (2 * turned > near.len()).then_some(Self {
            shapes,
            sign: if sum_mm < 0.0 { 1.0 } else { -1.0 },
            least_sine2: libm::sin(LEAST_TURN).powi(2),
        })
    }

    /// The radius that leaves samples the least off.
    pub(crate) fn radius_mm(&self, samples: &[Sample], pitch_mm: f64) -> f64 {
        let left = |log_radius: f64| {
            let off = self.offs(libm::exp(log_radius), samples);
            off.map(|off| off.abs().min(STRAY).powi(2)).sum::<f64>()
        };
        let range = (libm::log(RADII.0 * pitch_mm), libm::log(RADII.1 * pitch_mm));
        libm::exp(least(range, (FIRST, HALVINGS), left))
    }

    /// How far samples lie off the shapes and the edge of this radius, in their deviations.
    pub(crate) fn offs(&self, radius_mm: f64, samples: &[Sample]) -> impl Iterator<Item = f64> {
        samples.iter().map(move |sample| {
            let shape = match self.side(radius_mm, &sample.point_mm) {
                Side::First => self.shapes[0],
                Side::Second => self.shapes[1],
                Side::Between(cylinder) => Shape::Cylinder(cylinder),
            };
            sample.off(&shape)
        })
    }

    /// What a place is of, where the edge is of this radius.
    pub(crate) fn side(&self, radius_mm: f64, place: &Vector3<f64>) -> Side {
        let [a, b] = &self.shapes;
        // The middle of the ball lies a radius below both shapes, or above them.
        let off_mm = self.sign * radius_mm;
        let mut middle = *place;
        for step in 0..=STEPS {
            let [na, nb] = [a.normal(&middle), b.normal(&middle)];
            let cos = na.dot(&nb);
            let sine2 = 1.0 - cos * cos;
            if sine2 < self.least_sine2 {
                return self.nearer(place);
            }
            let from = place - middle;
            if step == STEPS || step > 0 && self.is_there(&middle, off_mm) {
                // Along both normals.
                let [on_a, on_b] = [from.dot(&na), from.dot(&nb)];
                let along_a = (on_a - cos * on_b) / sine2;
                let along_b = (on_b - cos * on_a) / sine2;
                return if self.sign * along_b <= 0.0 {
                    Side::First
                } else if self.sign * along_a <= 0.0 {
                    Side::Second
                } else {
                    Side::Between(Cylinder {
                        point_mm: middle,
                        axis: na.cross(&nb).normalize(),
                        radius_mm,
                        is_hollow: self.sign < 0.0,
                    })
                };
            }
            let [to_a, to_b] = [a, b].map(|shape| shape.distance_mm(&middle) + off_mm);
            let along_a = (to_a - cos * to_b) / sine2;
            let along_b = (to_b - cos * to_a) / sine2;
            // What is left of the way lies square to the edge.
            let edge = na.cross(&nb) / sine2.sqrt();
            middle += edge * from.dot(&edge) - na * along_a - nb * along_b;
        }
        self.nearer(place)
    }

    fn is_there(&self, middle: &Vector3<f64>, off_mm: f64) -> bool {
        let off = |shape: &Shape| (shape.distance_mm(middle) + off_mm).abs();
        self.shapes.iter().map(off).fold(0.0, f64::max) < NEAR_ENOUGH_MM
    }

    fn nearer(&self, place: &Vector3<f64>) -> Side {
        let [a, b] = [&self.shapes[0], &self.shapes[1]].map(|s| s.distance_mm(place).abs());
        if a <= b { Side::First } else { Side::Second }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shapes::{Plane, Sphere};

    /// Half a ball of 10 mm on a plate, with a fillet of 2 mm: the middle of what leaves that lies
    /// 12 mm from the ball's, and 2 mm above the plate.
    #[test]
    fn the_middle_lies_as_far_from_both_shapes_however_they_bend() {
        let plate = Shape::Plane(Plane {
            point_mm: Vector3::zeros(),
            normal: Vector3::z(),
        });
        let ball = Shape::Sphere(Sphere {
            centre_mm: Vector3::zeros(),
            radius_mm: 10.0,
            is_hollow: false,
        });
        let at = |out: f64, up: f64, turn: f64| {
            Vector3::new(out * libm::cos(turn), out * libm::sin(turn), up)
        };
        let near: Vec<Sample> = (0..20)
            .map(|k| Sample {
                point_mm: at(10.5, 0.4, f64::from(k)),
                ray: Vector3::z(),
                sigma_mm: 0.05,
            })
            .collect();
        let rounding = Rounding::of([plate, ball], &near).unwrap();
        for turn in [0.3, 2.0, 4.0] {
            let middle = at(libm::sqrt(140.0), 2.0, turn);
            for share in [0.1, 0.5, 0.9] {
                let towards = -Vector3::z() * (1.0 - share) - middle.normalize() * share;
                let place = middle + towards.normalize() * 2.0;
                let Side::Between(found) = rounding.side(2.0, &place) else {
                    panic!("{turn} {share}")
                };
                let off_mm = (found.point_mm - middle).norm();
                assert!(off_mm < 1e-4 && found.is_hollow, "{off_mm}");
            }
            assert_eq!(rounding.side(2.0, &at(13.0, 0.1, turn)), Side::First);
            assert_eq!(rounding.side(2.0, &at(9.0, 4.5, turn)), Side::Second);
        }
    }
}
