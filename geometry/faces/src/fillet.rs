//! Whether a piece rounds off the edge of two planes.
//!
//! A fillet a few nodes wide bends so little within the noise that a polynomial follows it as well
//! as a cylinder of its own does. But beside two planes that are known from afar it has one free
//! number, its radius: that tells it from a surface that is smooth all over.

use nalgebra::Vector3;
use shapes::{Cylinder, Plane, Sample, Shape, is_smoother};

use crate::field::{Field, Set, places};
use crate::grow::Piece;
use crate::split::{BESIDE, STRAY};

/// Least turn from one plane to the other, radians: less is told by the planes themselves.
const LEAST_TURN: f64 = 0.1;
/// Radii looked at, in pitches, how many of them, and halvings between the best two.
const RADII: (f64, f64) = (0.25, 250.0);
const FIRST: u32 = 31;
const HALVINGS: u32 = 12;

/// Whether a piece is a fillet between two planes, and not one smooth surface with them.
pub(crate) fn is_fillet(field: &Field<'_>, piece: &Set, planes: [&Piece; 2]) -> bool {
    let of_plane = |own: &Piece| match own.fit.as_ref()?.shape {
        Shape::Plane(plane) => Some(plane),
        _ => None,
    };
    let [Some(a), Some(b)] = planes.map(of_plane) else {
        return false;
    };
    if a.normal.dot(&b.normal) > libm::cos(LEAST_TURN) {
        return false;
    }
    let own = field.samples_at(places(piece).into_iter());
    let mut samples = own.clone();
    for plane in planes {
        let beside = field.near(&plane.nodes, piece, BESIDE);
        samples.extend(field.samples_at(places(&beside).into_iter()));
    }
    let Some(rounding) = Rounding::of([a, b], &own) else {
        return false;
    };
    let radius_mm = rounding.radius_mm(&samples, field.pitch_mm());
    let off = rounding.offs(radius_mm, &samples).collect();
    !is_smoother(&samples, off, 1)
}

/// Two planes, and the round edge between them.
struct Rounding {
    planes: [Plane; 2],
    /// Cosine of the turn, and the unit direction of the edge.
    cos: f64,
    along: Vector3<f64>,
    /// 1 where the edge stands out, -1 where it lies deep.
    sign: f64,
}

impl Rounding {
    /// `None` where the planes have no edge.
    fn of(planes: [Plane; 2], between: &[Sample]) -> Option<Self> {
        let [a, b] = planes;
        let cross = a.normal.cross(&b.normal);
        // What lies below both planes is the edge of a body.
        let above = |plane: &Plane, p: &Vector3<f64>| plane.normal.dot(&(p - plane.point_mm));
        let sum: f64 = between
            .iter()
            .map(|s| above(&a, &s.point_mm) + above(&b, &s.point_mm))
            .sum();
        Some(Self {
            planes,
            cos: a.normal.dot(&b.normal),
            along: cross.try_normalize(0.0)?,
            sign: if sum < 0.0 { 1.0 } else { -1.0 },
        })
    }

    /// The radius that leaves samples the least off.
    fn radius_mm(&self, samples: &[Sample], pitch_mm: f64) -> f64 {
        let left = |log_radius: f64| {
            let off = self.offs(libm::exp(log_radius), samples);
            off.map(|off| off.abs().min(STRAY).powi(2)).sum::<f64>()
        };
        let (low, high) = (libm::log(RADII.0 * pitch_mm), libm::log(RADII.1 * pitch_mm));
        let mut step = (high - low) / f64::from(FIRST - 1);
        let at = |k: u32| low + step * f64::from(k);
        let all = (0..FIRST).map(|k| (left(at(k)), at(k)));
        let least = |a: (f64, f64), b: (f64, f64)| if b.0 < a.0 { b } else { a };
        let mut best = all.fold((f64::INFINITY, low), least);
        for _ in 0..HALVINGS {
            step /= 2.0;
            for beside in [best.1 - step, best.1 + step] {
                best = least(best, (left(beside), beside));
            }
        }
        libm::exp(best.1)
    }

    /// How far samples lie off the planes and the edge of this radius, in their deviations.
    fn offs(&self, radius_mm: f64, samples: &[Sample]) -> impl Iterator<Item = f64> {
        let [a, b] = self.planes;
        let sine2 = 1.0 - self.cos * self.cos;
        let off_mm = self.sign * radius_mm;
        samples.iter().map(move |sample| {
            let above = |plane: &Plane| plane.normal.dot(&(sample.point_mm - plane.point_mm));
            // From the axis, which lies a radius below both planes, or above them.
            let (to_a, to_b) = (above(&a) + off_mm, above(&b) + off_mm);
            let along_a = (to_a - self.cos * to_b) / sine2;
            let along_b = (to_b - self.cos * to_a) / sine2;
            if self.sign * along_b <= 0.0 {
                return sample.off(&Shape::Plane(a));
            }
            if self.sign * along_a <= 0.0 {
                return sample.off(&Shape::Plane(b));
            }
            let from_axis = along_a * a.normal + along_b * b.normal;
            sample.off(&Shape::Cylinder(Cylinder {
                point_mm: sample.point_mm - from_axis,
                axis: self.along,
                radius_mm,
                is_hollow: self.sign < 0.0,
            }))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Scan;
    use shapes::Family;

    /// A roof of slopes 0.4 with its ridge along y at x = 12 mm, rounded.
    fn roof(x: f64, radius_mm: f64) -> f64 {
        let x = x - 12.0;
        let edge = radius_mm * 0.4 / libm::sqrt(1.16);
        if x.abs() > edge {
            -0.4 * x.abs()
        } else {
            let top = radius_mm * libm::sqrt(1.16);
            libm::sqrt(radius_mm * radius_mm - x * x) - top
        }
    }

    fn pieces(scan: &Scan, edge_mm: f64) -> (Field<'_>, [Piece; 3]) {
        let nodes: Vec<usize> = (0..scan.image.raw_z_mm().len()).collect();
        let field = Field::new(&scan.image, &scan.observations, &nodes).unwrap();
        let rows = scan.image.rows();
        let piece = |is_in: &dyn Fn(f64) -> bool, is_plane: bool| {
            let nodes: Set = (0..field.len())
                .map(|place| is_in(scan.image.x_mm(place / rows) - 12.0))
                .collect();
            let samples = field.samples(&nodes, 0, 2000);
            let fit = is_plane.then(|| shapes::fit(Family::Plane, &samples, 1.0).unwrap());
            Piece { fit, nodes }
        };
        let left = piece(&|x| x < -edge_mm, true);
        let middle = piece(&|x| x.abs() <= edge_mm, false);
        let right = piece(&|x| x > edge_mm, true);
        (field, [left, middle, right])
    }

    #[test]
    fn a_fillet_of_a_few_nodes_is_one() {
        for (radius_mm, deep) in [(3.0, 1.0), (6.0, 1.0), (6.0, -1.0)] {
            let scan = Scan::of((60, 60), 0.4, 0.05, |x, _| deep * roof(x, radius_mm));
            let edge_mm = 0.37 * radius_mm;
            let (field, [left, middle, right]) = pieces(&scan, edge_mm);
            assert!(is_fillet(&field, &middle.nodes, [&left, &right]));
            let Some(Shape::Plane(a)) = left.fit.map(|fit| fit.shape) else {
                panic!("a plane")
            };
            let Some(Shape::Plane(b)) = right.fit.map(|fit| fit.shape) else {
                panic!("a plane")
            };
            let samples = field.samples(&field.all(), 0, 4000);
            let own = field.samples(&middle.nodes, 0, 4000);
            let rounding = Rounding::of([a, b], &own).unwrap();
            let found_mm = rounding.radius_mm(&samples, 0.4);
            assert!(
                (found_mm - radius_mm).abs() < 0.5,
                "{radius_mm}: {found_mm}"
            );
        }
    }

    #[test]
    fn a_smooth_surface_cut_in_three_has_none() {
        let scan = Scan::of((60, 60), 0.4, 0.05, |x, _| -0.03 * (x - 12.0) * (x - 12.0));
        let (field, [left, middle, right]) = pieces(&scan, 2.0);
        assert!(!is_fillet(&field, &middle.nodes, [&left, &right]));
    }
}
