//! Motions that may sweep a profile over a region, from the normals of its nodes.

use nalgebra::Vector3;
use shapes::{Normal, Sweep, spread};

use crate::field::{Field, places};

/// Nodes whose normals are looked at: enough for a first guess.
const NORMALS: usize = 1000;
/// Nodes to either side whose plane gives a normal, and the share of them that there must be.
const HALF: usize = 2;
const SHARE: f64 = 0.8;

/// The best extrusion and the best revolution.
pub(super) fn motions(field: &Field<'_>, set: &[bool]) -> Vec<Sweep> {
    shapes::motions(&normals(field, set))
}

/// Normals of planes through the nodes around some.
fn normals(field: &Field<'_>, set: &[bool]) -> Vec<Normal> {
    let all = places(set);
    let enough = SHARE * ((2 * HALF + 1) * (2 * HALF + 1)) as f64;
    let normal = |k: usize| {
        let around = field.around(all[k], HALF).filter(|place| set[*place]);
        let points: Vec<Vector3<f64>> = around.filter_map(|place| field.point_mm(place)).collect();
        if (points.len() as f64) < enough {
            return None;
        }
        let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let (mut matrix, mut right) = (nalgebra::Matrix2::zeros(), nalgebra::Vector2::zeros());
        for point in &points {
            let from = point - middle;
            matrix += from.xy() * from.xy().transpose();
            right += from.xy() * from.z;
        }
        let slopes = matrix.cholesky()?.solve(&right);
        let normal = Vector3::new(-slopes.x, -slopes.y, 1.0).normalize();
        Some((middle, normal))
    };
    spread(all.len(), NORMALS).filter_map(normal).collect()
}
