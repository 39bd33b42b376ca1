//! One registration from one start: point-to-plane iterations with a redescending weight.

use glam::DVec3;
use nalgebra::{SMatrix, SVector};
use range_image::{Cancelled, Monitor};
use rayon::prelude::*;

use crate::nominal::{Foot, Nominal};
use crate::normal::{biweight, scale_about_zero};
use crate::pose::Pose;

pub(crate) type Matrix6 = SMatrix<f64, 6, 6>;
pub(crate) type Vector6 = SVector<f64, 6>;

/// A motion whose mean square displacement along the normals is below this share of its own mean
/// square changes nothing that can be measured. Facets that stand for a curved face at 8 degrees
/// apart still leave its turning free; a feature at 45 degrees holds the part if it covers half
/// a per cent of it.
pub(crate) const FREE: f64 = 2e-3;

/// Points moved at once by a thread.
const PIECE: usize = 256;

/// How far one registration has come.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub(crate) pose: Pose,
    /// Root mean square of the distances along the normals, by weight, millimetres.
    pub(crate) rms_mm: f64,
    pub(crate) iterations: usize,
    pub(crate) is_settled: bool,
    /// The equations of the last step; `None` where nothing was near.
    pub(crate) equations: Option<Equations>,
}

/// The normal equations about the points' centroid. Turnings are in units of `1 / length_mm`
/// radians, so that all six unknowns are millimetres.
#[derive(Debug, Clone)]
pub(crate) struct Equations {
    /// Weighted mean of J J'.
    pub(crate) matrix: Matrix6,
    gradient: Vector6,
    /// In the nominal's frame.
    pub(crate) centre_mm: DVec3,
    pub(crate) length_mm: f64,
    /// Sum of weights.
    pub(crate) weight: f64,
    rms_mm: f64,
    scale_mm: f64,
}

/// Limits of an iteration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Course {
    /// Points farther than this play no part, at first.
    pub(crate) reach_mm: f64,
    /// The reach never shrinks below this.
    pub(crate) least_reach_mm: f64,
    /// The robust scale is never taken to be less, so that exact data can be had.
    pub(crate) least_scale_mm: f64,
    pub(crate) most_iterations: usize,
    /// Steps smaller than this are the end.
    pub(crate) settled_mm: f64,
}

/// The nearest visible points of the nominal to points moved by a pose.
pub(crate) fn feet(
    nominal: &Nominal,
    points: &[DVec3],
    pose: &Pose,
    within_mm: f64,
) -> Vec<Option<(DVec3, Foot)>> {
    let view = pose.direction(DVec3::Z);
    points
        .par_iter()
        .with_min_len(PIECE)
        .map(|&point| {
            let moved = pose.point(point);
            Some((moved, nominal.nearest(moved, view, within_mm)?))
        })
        .collect()
}

/// Iterates from a start until it settles.
pub(crate) fn icp(
    nominal: &Nominal,
    points: &[DVec3],
    start: Pose,
    course: &Course,
    monitor: &dyn Monitor,
) -> Result<Fit, Cancelled> {
    let mut fit = Fit {
        pose: start,
        rms_mm: f64::NAN,
        iterations: 0,
        is_settled: false,
        equations: None,
    };
    let mut reach_mm = course.reach_mm;
    while fit.iterations < course.most_iterations && !fit.is_settled {
        monitor.check()?;
        let pairs = feet(nominal, points, &fit.pose, reach_mm);
        let Some(equations) = equations(&pairs, course.least_scale_mm) else {
            fit.equations = None;
            break;
        };
        fit.iterations += 1;
        let (step, size_mm) = equations.step();
        fit.pose = fit.pose.then(&step);
        fit.rms_mm = equations.rms_mm;
        let next_mm = (0.75 * reach_mm)
            .max(8.0 * equations.scale_mm)
            .max(course.least_reach_mm);
        let is_narrow = next_mm >= 0.99 * reach_mm;
        reach_mm = next_mm.min(reach_mm);
        fit.is_settled = is_narrow && size_mm < course.settled_mm;
        fit.equations = Some(equations);
    }
    Ok(fit)
}

/// The equations of pairs; `None` where fewer than six are left.
fn equations(pairs: &[Option<(DVec3, Foot)>], least_scale_mm: f64) -> Option<Equations> {
    let near: Vec<(DVec3, DVec3, f64)> = pairs
        .iter()
        .flatten()
        .map(|(point, foot)| {
            let offset = (*point - foot.point_mm).dot(foot.normal);
            (*point, foot.normal, offset)
        })
        .collect();
    if near.len() < 6 {
        return None;
    }
    let scale_mm = scale_about_zero(near.iter().map(|n| n.2)).max(least_scale_mm);
    let (mut centre_mm, mut weight) = (DVec3::ZERO, 0.0);
    for (point, _, offset) in &near {
        let w = biweight(offset / scale_mm);
        centre_mm += w * *point;
        weight += w;
    }
    if weight < 6.0 {
        return None;
    }
    centre_mm /= weight;
    let (mut spread, mut squares) = (0.0, 0.0);
    for (point, _, offset) in &near {
        let w = biweight(offset / scale_mm);
        spread += w * (*point - centre_mm).length_squared();
        squares += w * offset * offset;
    }
    let length_mm = (spread / weight).sqrt();
    if length_mm.is_nan() || length_mm <= 0.0 {
        return None;
    }
    let (mut matrix, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
    for (point, normal, offset) in &near {
        let w = biweight(offset / scale_mm);
        let turning = (*point - centre_mm).cross(*normal) / length_mm;
        let row = Vector6::new(
            turning.x, turning.y, turning.z, normal.x, normal.y, normal.z,
        );
        for i in 0..6 {
            for j in 0..6 {
                matrix[(i, j)] += w * row[i] * row[j];
            }
            gradient[i] += w * row[i] * offset;
        }
    }
    Some(Equations {
        matrix: matrix / weight,
        gradient: gradient / weight,
        centre_mm,
        length_mm,
        weight,
        rms_mm: (squares / weight).sqrt(),
        scale_mm,
    })
}

impl Equations {
    /// The motion that the equations ask for, and its size. Where they leave a motion free
    /// nothing moves that way.
    fn step(&self) -> (Pose, f64) {
        let eigen = self.matrix.symmetric_eigen();
        let mut unknown = Vector6::zeros();
        for (value, vector) in eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter())
        {
            if *value > FREE {
                unknown -= vector * (vector.dot(&self.gradient) / value);
            }
        }
        let mut turning = DVec3::new(unknown[0], unknown[1], unknown[2]) / self.length_mm;
        let shift = DVec3::new(unknown[3], unknown[4], unknown[5]);
        // The equations hold for small turnings.
        const MOST_RAD: f64 = 0.3;
        if turning.length() > MOST_RAD {
            turning *= MOST_RAD / turning.length();
        }
        let size_mm = shift.length() + turning.length() * self.length_mm;
        (Pose::about(self.centre_mm, turning, shift), size_mm)
    }
}
