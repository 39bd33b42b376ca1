//! Motions that may sweep a profile over a surface, from its normals.
//!
//! A surface that a motion moves in itself has normals square to the velocities of that motion.
//! In Pluecker coordinates that is one linear equation for each normal, so that the motion is the
//! vector that meets them best (Pottmann and Randrup 1998, "Rotational and helical surface
//! approximation for reverse engineering").

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::motion::{Motion, Sweep};

/// Fewest normals that tell a motion.
const FEWEST: usize = 20;
/// Rounds of weighing: the less, the farther off a normal is.
const ROUNDS: usize = 5;
/// What is added to directions that all normals are square to, of the others.
const NOTHING: f64 = 1e-9;

/// A point of a surface, millimetres, and the unit normal there.
pub type Normal = (Vector3<f64>, Vector3<f64>);

/// The best extrusion and the best revolution.
/// None where there are too few normals to tell.
#[must_use]
pub fn motions(normals: &[Normal]) -> Vec<Sweep> {
    if normals.len() < FEWEST {
        return Vec::new();
    }
    let middle = normals.iter().map(|(point, _)| point).sum::<Vector3<f64>>();
    let middle = middle / normals.len() as f64;
    let reach2 = normals.iter().map(|(p, _)| (p - middle).norm_squared());
    let reach_mm = (reach2.sum::<f64>() / normals.len() as f64).sqrt();
    let extrusion = weighed(normals, |normals, weights| {
        let direction = extrusion(normals, weights);
        let off = normals.iter().map(|(_, normal)| normal.dot(&direction));
        (
            Sweep::new(Motion::Extrusion, middle, direction),
            off.collect(),
        )
    });
    let told: Vec<Normal> = normals
        .iter()
        .map(|(point, normal)| ((point - middle) / reach_mm, *normal))
        .collect();
    let revolution = weighed(&told, |normals, weights| {
        let (shift, turn) = revolution(normals, weights);
        let off = normals
            .iter()
            .map(|(p, normal)| normal.dot(&(shift + turn.cross(p))));
        // What is left of the shift along the axis would be a screw's pitch.
        let foot = middle + turn.cross(&shift) * reach_mm;
        (Sweep::new(Motion::Revolution, foot, turn), off.collect())
    });
    [extrusion, revolution].into_iter().flatten().collect()
}

/// Rounds of solving for normals, and weighing these by how far they are off (Cauchy's weights).
fn weighed(
    normals: &[Normal],
    solve: impl Fn(&[Normal], &[f64]) -> (Option<Sweep>, Vec<f64>),
) -> Option<Sweep> {
    let mut weights = vec![1.0; normals.len()];
    let mut found = None;
    for _ in 0..ROUNDS {
        let (sweep, off) = solve(normals, &weights);
        found = sweep;
        let mut sizes: Vec<f64> = off.iter().map(|off| off.abs()).collect();
        let middle = sizes.len() / 2;
        let wide = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
        let wide = wide.max(f64::MIN_POSITIVE);
        let weight = |off: &f64| (1.0 + (off / wide).powi(2)).recip();
        weights = off.iter().map(weight).collect();
    }
    found
}

/// The direction that normals are most nearly square to.
fn extrusion(normals: &[Normal], weights: &[f64]) -> Vector3<f64> {
    let mut matrix = Matrix3::zeros();
    for ((_, normal), weight) in normals.iter().zip(weights) {
        matrix += normal * normal.transpose() * *weight;
    }
    least(matrix)
}

/// The shift and the turn, of unit length, that move the surface most nearly in itself. A shift
/// alone, as along a cylinder, would say nothing of the axis, so the turn is given its length and
/// the best shift for it.
fn revolution(normals: &[Normal], weights: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
    let (mut shifts, mut both, mut turns) = (Matrix3::zeros(), Matrix3::zeros(), Matrix3::zeros());
    for ((point, normal), weight) in normals.iter().zip(weights) {
        let moment = point.cross(normal);
        shifts += normal * normal.transpose() * *weight;
        both += normal * moment.transpose() * *weight;
        turns += moment * moment.transpose() * *weight;
    }
    shifts += Matrix3::identity() * (NOTHING * shifts.trace().max(f64::MIN_POSITIVE));
    let shift_by_turn = shifts
        .try_inverse()
        .map_or_else(Matrix3::zeros, |inverse| -inverse * both);
    let turn = least(turns + both.transpose() * shift_by_turn);
    (shift_by_turn * turn, turn)
}

/// The eigenvector of the least eigenvalue.
fn least(matrix: Matrix3<f64>) -> Vector3<f64> {
    let eigen = SymmetricEigen::new(matrix);
    eigen
        .eigenvectors
        .column(eigen.eigenvalues.imin())
        .into_owned()
}
