//! Points and curves put on what the faces lie on that they bound.
//!
//! A model's curves lie on patches, and so off the cylinder that these stand for by what the
//! patches are, which is most where the camera sees it edge on. Where a crease runs there, patches
//! that are off by little put it where the surfaces do not meet by far more.

use nalgebra::{Matrix3, Vector3};
use nurbs::PiecewiseCubic;

use super::support::Support;
use crate::common::largest;

/// Steps of Gauss and Newton.
const STEPS: usize = 12;

/// A point this near to a shape lies on it, millimetres.
const CLOSE_MM: f64 = 1e-9;

/// Curves lie on their shapes to this, millimetres.
const TOLERANCE_MM: f64 = 5e-5;

/// Farthest that a point is moved, millimetres.
const FARTHEST_MM: f64 = 1.0;

/// Shapes that meet at a flatter angle than of this sine squared, about 2 degrees, tell no common
/// place: a point between them is as good.
const LEAST_ANGLE: f64 = 1e-3;

/// Most times a piece is halved.
const MAX_DEPTH: usize = 10;

/// Places of a piece at which its distance is taken.
const PROBES: usize = 8;

/// The point of all the shapes together that is nearest to a point; where they have none in
/// common, the one that is least off them. `None` where that is far away.
pub(super) fn point(start: [f64; 3], supports: &[Support<'_>]) -> Option<[f64; 3]> {
    let start = Vector3::from(start);
    if is_on(&start, supports) {
        return Some(start.into());
    }
    let mut place = start;
    for _ in 0..STEPS {
        let (inverse, normals) = inverse(&place, supports)?;
        let off = supports.iter().map(|of| of.distance_mm(&place));
        let sum: Vector3<f64> = normals.iter().zip(off).map(|(n, off)| n * off).sum();
        let step = inverse * sum;
        place -= step;
        let moved = (place - start).norm();
        if moved.is_nan() || moved > FARTHEST_MM {
            return None;
        }
        if step.norm() < CLOSE_MM {
            return Some(place.into());
        }
    }
    None
}

/// How far a point is from the farthest of them, millimetres.
pub(super) fn farthest(at: [f64; 3], supports: &[Support<'_>]) -> f64 {
    largest(supports.iter().map(|of| of.distance_mm(&at.into()).abs()))
}

fn is_on(place: &Vector3<f64>, supports: &[Support<'_>]) -> bool {
    let mut off = supports.iter().map(|of| of.distance_mm(place));
    off.all(|off| off.abs() <= CLOSE_MM)
}

/// The pseudo-inverse of the normal equations at a place, and the unit normals they are of.
fn inverse(
    place: &Vector3<f64>,
    supports: &[Support<'_>],
) -> Option<(Matrix3<f64>, Vec<Vector3<f64>>)> {
    let normals: Vec<Vector3<f64>> = supports.iter().map(|of| of.normal(place)).collect();
    let sum: Matrix3<f64> = normals.iter().map(|n| n * n.transpose()).sum();
    if !sum.iter().all(|v| v.is_finite()) {
        return None;
    }
    let eigen = sum.symmetric_eigen();
    let mut inverse = Matrix3::zeros();
    for (value, vector) in eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
    {
        if *value > LEAST_ANGLE {
            inverse += vector * vector.transpose() / *value;
        }
    }
    Some((inverse, normals))
}

/// The curve on all the shapes together. `None` where it cannot be put there, or lies there.
pub(super) fn curve(
    curve: &PiecewiseCubic<3>,
    supports: &[Support<'_>],
) -> Option<PiecewiseCubic<3>> {
    if supports
        .iter()
        .all(|support| off(curve, support) <= TOLERANCE_MM)
    {
        return None;
    }
    let mut out = PiecewiseCubic {
        breaks: vec![*curve.breaks.first()?],
        pieces: Vec::new(),
    };
    for k in 0..curve.pieces.len() {
        let width = curve.breaks[k + 1] - curve.breaks[k];
        let piece = Piece { curve, k, supports };
        let [from, to] = [piece.stop(0.0)?, piece.stop(width)?];
        piece.follow(&mut out, (0.0, from), (width, to), MAX_DEPTH)?;
        // The sum of the parts must not move the break.
        *out.breaks.last_mut()? = curve.breaks[k + 1];
    }
    Some(out)
}

/// The greatest distance of a curve from a surface, millimetres.
pub(super) fn off(curve: &PiecewiseCubic<3>, support: &Support<'_>) -> f64 {
    largest(probes(curve).map(|place| support.distance_mm(&place).abs()))
}

/// The least cosine between z and the normal of a surface along a curve.
pub(super) fn least_facing(curve: &PiecewiseCubic<3>, support: &Support<'_>) -> f64 {
    let facing = probes(curve).map(|place| support.normal(&place).z);
    1.0 - largest(facing.map(|facing| 1.0 - facing))
}

fn probes(curve: &PiecewiseCubic<3>) -> impl Iterator<Item = Vector3<f64>> + '_ {
    let pieces = curve.breaks.windows(2).enumerate();
    pieces.flat_map(move |(k, ends)| {
        let at = move |n: usize| (ends[1] - ends[0]) * n as f64 / PROBES as f64;
        (0..=PROBES).map(move |n| curve.piece_value(k, at(n), 0).into())
    })
}

/// A place and the derivative there.
type Stop = ([f64; 3], [f64; 3]);

struct Piece<'a> {
    curve: &'a PiecewiseCubic<3>,
    k: usize,
    supports: &'a [Support<'a>],
}

impl Piece<'_> {
    fn stop(&self, s: f64) -> Option<Stop> {
        let place = point(self.curve.piece_value(self.k, s, 0), self.supports)?;
        // Shapes that hardly part, as a fillet and its plane, may have no place in common.
        let mut off = self.supports.iter().map(|of| of.distance_mm(&place.into()));
        if !off.all(|off| off.abs() <= TOLERANCE_MM) {
            return None;
        }
        // Of the derivative what stays on the shapes.
        let (inverse, normals) = inverse(&place.into(), self.supports)?;
        let along = Vector3::from(self.curve.piece_value(self.k, s, 1));
        let sum: Vector3<f64> = normals.iter().map(|n| n * n.dot(&along)).sum();
        Some((place, (along - inverse * sum).into()))
    }

    fn follow(
        &self,
        out: &mut PiecewiseCubic<3>,
        (s, from): (f64, Stop),
        (t, to): (f64, Stop),
        depth: usize,
    ) -> Option<()> {
        let width = t - s;
        let piece: [[f64; 4]; 3] = core::array::from_fn(|d| {
            let (start, end) = (from.0[d], to.0[d]);
            let (out, into) = (from.1[d], to.1[d]);
            let mean = (end - start) / width;
            let second = (3.0 * mean - 2.0 * out - into) / width;
            let third = (out + into - 2.0 * mean) / (width * width);
            [start, out, second, third]
        });
        let alone = PiecewiseCubic {
            breaks: vec![0.0, width],
            pieces: vec![piece],
        };
        let is_on = self
            .supports
            .iter()
            .all(|of| off(&alone, of) <= TOLERANCE_MM);
        if is_on {
            let begin = self.curve.breaks[self.k];
            out.pieces.push(piece);
            out.breaks.push(begin + t);
            return Some(());
        }
        let depth = depth.checked_sub(1)?;
        let middle = s + width / 2.0;
        let between = (middle, self.stop(middle)?);
        self.follow(out, (s, from), between, depth)?;
        self.follow(out, between, (t, to), depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nurbs::PatchSurface;
    use shapes::{Cylinder, Plane, Shape};

    fn cylinder() -> Support<'static> {
        Support::Shape(Shape::Cylinder(Cylinder {
            point_mm: Vector3::zeros(),
            axis: Vector3::y(),
            radius_mm: 10.0,
            is_hollow: false,
        }))
    }

    fn tilted() -> Support<'static> {
        Support::Shape(Shape::Plane(Plane {
            point_mm: Vector3::zeros(),
            normal: Vector3::new(0.0, 0.8, 0.6),
        }))
    }

    #[test]
    fn a_point_is_put_on_one_shape_and_on_two() {
        let near = |p: [f64; 3], q: [f64; 3]| (0..3).all(|d| (p[d] - q[d]).abs() < 1e-8);
        assert!(near(
            point([6.06, 3.0, 8.08], &[cylinder()]).unwrap(),
            [6.0, 3.0, 8.0]
        ));
        let both = point([6.02, -6.05, 8.03], &[cylinder(), tilted()]).unwrap();
        assert!(cylinder().distance_mm(&both.into()).abs() < 1e-8);
        assert!(tilted().distance_mm(&both.into()).abs() < 1e-8);
        // What is too far away is left alone; the same shape twice is one.
        assert_eq!(point([6.7, 3.0, 8.9], &[cylinder()]), None);
        assert!(point([6.06, 3.0, 8.08], &[cylinder(), cylinder()]).is_some());
        assert_eq!(point([0.0, 3.0, 0.0], &[cylinder()]), None);
    }

    /// A slope that is given as patches, and a cylinder by its numbers.
    #[test]
    fn a_point_is_put_on_a_shape_and_on_patches() {
        let slope = |i: usize, j: usize| -0.5 * i as f64 + 0.25 * j as f64;
        let slope = PatchSurface::through_thirds(vec![0.0, 9.0], vec![0.0, 9.0], slope).unwrap();
        let z_mm = |x: f64, y: f64| (-0.5 * x + 0.25 * y) / 3.0;
        let both = [cylinder(), Support::Patches(&slope)];
        let [x, y, z] = point([9.8, 4.0, -1.5], &both).unwrap();
        assert!((x * x + z * z - 100.0).abs() < 1e-7 && (z - z_mm(x, y)).abs() < 1e-8);
        assert!(both[1].distance_mm(&Vector3::new(3.0, 3.0, 0.0)) > 0.2);
    }

    #[test]
    fn a_curve_is_put_on_the_ellipse_of_two_shapes_without_kinks() {
        let ellipse = |angle: f64| {
            let (sin, cos) = libm::sincos(angle);
            [10.0 * cos, -7.5 * sin, 10.0 * sin]
        };
        let off = |k: usize, share: f64| 0.01 * libm::sin(3.0 * (k as f64 + share));
        let angle = |k: usize| 0.4 + 0.5 * k as f64;
        let mut pieces = Vec::new();
        for k in 0..3 {
            let at = |third: usize| {
                let share = third as f64 / 3.0;
                let [x, y, z] = ellipse(angle(k) + 0.5 * share);
                let by = if (k, third) == (0, 0) || (k, third) == (2, 3) {
                    0.0
                } else {
                    off(k, share)
                };
                [x, y, z + by]
            };
            let points = [at(0), at(1), at(2), at(3)];
            let piece = PiecewiseCubic::through_thirds(0.0, 5.0, &points).unwrap();
            pieces.push(piece.pieces[0]);
        }
        let loose = PiecewiseCubic::new(vec![0.0, 5.0, 10.0, 15.0], pieces).unwrap();
        let shapes = [cylinder(), tilted()];
        assert!(super::off(&loose, &shapes[0]) > 5e-3);
        let on = curve(&loose, &shapes).unwrap();
        on.validate().unwrap();
        assert_eq!((on.start(), on.domain()), (loose.start(), loose.domain()));
        for shape in &shapes {
            assert!(super::off(&on, shape) <= TOLERANCE_MM);
        }
        // Its ends are at 0.4 and 1.9 radians from x.
        let facing = least_facing(&on, &shapes[0]);
        assert!((facing - libm::sin(0.4)).abs() < 1e-3, "{facing}");
        // A plane that touches the cylinder, but for a hundredth, has no curve in common with it.
        let touching = Support::Shape(Shape::Plane(Plane {
            point_mm: Vector3::new(0.0, 0.0, 10.01),
            normal: Vector3::z(),
        }));
        let top = PiecewiseCubic::line([0.1, 0.0, 10.0], [0.1, 9.0, 10.0], 9.0).unwrap();
        assert_eq!(curve(&top, &[cylinder(), touching]), None);
        // Of what lies there already nothing is changed.
        assert_eq!(curve(&on, &shapes), None);
        assert_eq!(curve(&loose, &[]), None);
    }
}
