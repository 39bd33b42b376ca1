//! What a registration leaves open: motions that no measured point resists.

use glam::DVec3;

use crate::icp::{Equations, FREE, Matrix6, Vector6};

/// A motion that the measured surfaces leave free, in the nominal's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Freedom {
    /// It slides along a direction, as a plane does.
    Sliding {
        /// Unit vector.
        direction: [f64; 3],
    },
    /// It turns about an axis, as a cylinder does, and slides along it by so much.
    Turning {
        /// Unit vector along the axis.
        axis: [f64; 3],
        /// The axis' nearest point to the measured points' centroid, millimetres.
        through_mm: [f64; 3],
        /// Advance along the axis for each radian, millimetres: 0 for a pure turning.
        lead_mm: f64,
    },
}

/// Standard uncertainties of a pose: of the scan's centroid, and of turnings about it. Free
/// motions are not in them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseUncertainty {
    /// Along x, y and z of the nominal's frame, millimetres.
    pub translation_mm: [f64; 3],
    /// About x, y and z, radians.
    pub rotation_rad: [f64; 3],
}

/// What is free.
pub(crate) fn freedoms(equations: &Equations) -> Vec<Freedom> {
    let eigen = equations.matrix.symmetric_eigen();
    let columns: Vec<_> = eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
        .filter(|(value, _)| **value <= FREE)
        .map(|(_, vector)| vector.into_owned())
        .collect();
    if columns.is_empty() {
        return Vec::new();
    }
    // Several free motions come mixed. Those combinations that turn nothing are slidings; the
    // rest, at right angles to them, are turnings.
    const UNUSED: f64 = 10.0;
    let count = columns.len();
    let turning_of = |index: usize| {
        columns
            .get(index)
            .map_or(DVec3::ZERO, |v| DVec3::new(v[0], v[1], v[2]))
    };
    // Rows that stand for nothing get a value that no combination has, and are passed over.
    let products = Matrix6::from_fn(|i, j| {
        if i.max(j) < count {
            turning_of(i).dot(turning_of(j))
        } else if i == j {
            UNUSED
        } else {
            0.0
        }
    });
    let mixed = products.symmetric_eigen();
    /// A combination whose turning moves points by less than this share of what it slides them
    /// turns nothing: facets let a true sliding come with a hint of turning.
    const SLIDES: f64 = 0.03;
    let mut found: Vec<(f64, Freedom)> = Vec::new();
    for (value, mixture) in mixed
        .eigenvalues
        .iter()
        .zip(mixed.eigenvectors.column_iter())
    {
        if *value > UNUSED / 2.0 {
            continue;
        }
        let mut motion = Vector6::zeros();
        for (share, column) in mixture.iter().zip(&columns) {
            motion += column * *share;
        }
        let turning = DVec3::new(motion[0], motion[1], motion[2]) / equations.length_mm;
        let shift = DVec3::new(motion[3], motion[4], motion[5]);
        let freedom = if *value < SLIDES * SLIDES {
            Freedom::Sliding {
                direction: upright(shift.normalize_or_zero()).to_array(),
            }
        } else {
            let rate = turning.length();
            let axis = turning / rate;
            let through = equations.centre_mm + axis.cross(shift) / rate;
            Freedom::Turning {
                axis: upright(axis).to_array(),
                through_mm: through.to_array(),
                lead_mm: shift.dot(axis) / rate,
            }
        };
        found.push((*value, freedom));
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, freedom)| freedom).collect()
}

/// Of a direction and its opposite, the one whose largest component is positive.
fn upright(direction: DVec3) -> DVec3 {
    let largest = direction.to_array().into_iter().fold(0.0_f64, |most, c| {
        if c.abs() > most.abs() + 1e-9 { c } else { most }
    });
    if largest < 0.0 { -direction } else { direction }
}

/// The uncertainty that noise of this size at each point leaves.
pub(crate) fn uncertainty(equations: &Equations, noise_mm: f64) -> PoseUncertainty {
    let eigen = equations.matrix.symmetric_eigen();
    let mut variances = [0.0; 6];
    for (value, vector) in eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
    {
        if *value > FREE {
            for (variance, component) in variances.iter_mut().zip(vector.iter()) {
                *variance += component * component / value;
            }
        }
    }
    let unit = noise_mm / equations.weight.sqrt();
    let [rx, ry, rz, tx, ty, tz] = variances.map(|variance| unit * variance.sqrt());
    PoseUncertainty {
        translation_mm: [tx, ty, tz],
        rotation_rad: [rx, ry, rz].map(|length| length / equations.length_mm),
    }
}
