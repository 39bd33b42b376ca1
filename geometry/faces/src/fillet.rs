//! Whether a piece rounds off the edge of two others.
//!
//! A fillet a few nodes wide bends so little within the noise that a polynomial follows it as well
//! as a shape of its own does. But beside two shapes that are known from afar it has one free
//! number, its radius: that tells it from a surface that is smooth all over.

use shapes::{is_smoother, spread};

use crate::field::{Field, Set, places};
use crate::grow::Piece;
use crate::rounding::Rounding;
use crate::split::BESIDE;

/// Samples that tell the radius.
const SOME: usize = 600;

/// Whether a piece is a fillet between two others, and not one smooth surface with them.
pub(crate) fn is_fillet(field: &Field<'_>, piece: &Set, others: [&Piece; 2]) -> bool {
    let shape = |own: &Piece| own.fit.as_ref().map(|fit| fit.shape);
    let [Some(a), Some(b)] = others.map(shape) else {
        return false;
    };
    let own = field.samples_at(places(piece).into_iter());
    let mut samples = own.clone();
    for other in others {
        let beside = field.near(&other.nodes, piece, BESIDE);
        samples.extend(field.samples_at(places(&beside).into_iter()));
    }
    let Some(rounding) = Rounding::of([a, b], &own) else {
        return false;
    };
    let some: Vec<_> = spread(samples.len(), SOME).map(|k| samples[k]).collect();
    let radius_mm = rounding.radius_mm(&some, field.pitch_mm());
    let off = rounding.offs(radius_mm, &samples).collect();
    !is_smoother(&samples, off, 1)
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
            let [a, b] = [left, right].map(|plane| plane.fit.unwrap().shape);
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
