//! What was seen of references, and the normal equations that it gives.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use range_image::Calibration;
use range_image::correction::DEVIATIONS;

use crate::deviations::{Deviation, Deviations, UNKNOWNS, derivatives};
use crate::linear::{Matrix, Vector};
use crate::robust::{Spread, deviation, weight};
use crate::scan::{Met, RawSample, Ray, position_mm};
use crate::steps::tangents;

/// Smallest deviation that residuals are measured in, millimetres.
const LEAST_MM: f64 = 1e-7;

/// A reference in one scan.
#[derive(Debug, Clone)]
pub(crate) enum Reference {
    /// A sphere of known radius, at a place that may be known, with its standard uncertainty.
    Sphere {
        centre_mm: Vector3<f64>,
        radius_mm: f64,
        place: Option<(Vector3<f64>, f64)>,
        samples: Vec<RawSample>,
    },
    /// Parallel planes at known heights: each sample with its height.
    Steps {
        normal: Vector3<f64>,
        offset_mm: f64,
        middle_mm: Vector3<f64>,
        samples: Vec<(RawSample, f64)>,
    },
}

impl Reference {
    /// The same at a place that nobody knows.
    pub(crate) fn anywhere(mut self) -> Self {
        if let Self::Sphere { place, .. } = &mut self {
            *place = None;
        }
        self
    }

    /// Ties it to the place that another is known to be at.
    pub(crate) fn tie_as(&mut self, other: &Self) {
        if let (Self::Sphere { place, .. }, Self::Sphere { place: known, .. }) = (self, other) {
            *place = *known;
        }
    }
}

/// Normal equations of one reference: the scanner's unknowns, and the three of the reference.
struct Block {
    own: Matrix,
    cross: SMatrix<f64, UNKNOWNS, 3>,
    inner: Matrix3<f64>,
    right: Vector,
    inner_right: Vector3<f64>,
}

/// Normal equations of the scanner's unknowns, and what remains.
pub(crate) struct Normal {
    pub(crate) matrix: Matrix,
    pub(crate) right: Vector,
    pub(crate) spread: Spread,
    /// Weighted sum of squares in millimetres, and of the weights.
    pub(crate) squares_mm2: (f64, f64),
    /// For each reference: back substitution.
    back: Vec<Back>,
}

struct Back {
    inverse: Matrix3<f64>,
    right: Vector3<f64>,
    cross: SMatrix<f64, UNKNOWNS, 3>,
}

impl Normal {
    /// Root mean square of the residuals as weighed, millimetres.
    pub(crate) fn rms_mm(&self) -> f64 {
        let (squares, weights) = self.squares_mm2;
        libm::sqrt(squares / weights.max(f64::MIN_POSITIVE))
    }

    /// Moves the references along with a step of the scanner's unknowns; the longest of the moves,
    /// millimetres.
    pub(crate) fn follow(&self, references: &mut [Reference], step: &Vector) -> f64 {
        let mut longest: f64 = 0.0;
        for (reference, back) in references.iter_mut().zip(&self.back) {
            let own = back.inverse * (back.right - back.cross.transpose() * step);
            longest = longest.max(own.norm());
            match reference {
                Reference::Sphere { centre_mm, .. } => *centre_mm += own,
                Reference::Steps {
                    normal,
                    offset_mm,
                    middle_mm,
                    ..
                } => {
                    let (across, along) = tangents(*normal);
                    let turned = (*normal + across * own.x + along * own.y).normalize();
                    *offset_mm += turned.dot(middle_mm) - normal.dot(middle_mm) + own.z;
                    *normal = turned;
                }
            }
        }
        longest
    }
}

/// The normal equations at these deviations.
pub(crate) fn normal(
    announced: &Calibration,
    deviations: &Deviations,
    references: &[Reference],
) -> Option<Normal> {
    let mut all = Normal {
        matrix: Matrix::zeros(),
        right: Vector::zeros(),
        spread: Spread::default(),
        squares_mm2: (0.0, 0.0),
        back: Vec::new(),
    };
    for reference in references {
        let block = block(announced, deviations, reference, &mut all);
        let inverse = block.inner.cholesky()?.inverse();
        let eliminate = block.cross * inverse;
        all.matrix += block.own - eliminate * block.cross.transpose();
        all.right += block.right - eliminate * block.inner_right;
        all.back.push(Back {
            inverse,
            right: block.inner_right,
            cross: block.cross,
        });
    }
    Some(all)
}

/// A residual in millimetres, and how it changes with the sample's place and the reference's
/// unknowns.
struct Residual {
    raw: RawSample,
    off_mm: f64,
    range_counts: f64,
    by_place: Vector3<f64>,
    by_own: Vector3<f64>,
}

/// `None` where the ray does not meet the reference.
fn residual(
    calibration: &Calibration,
    reference: &Reference,
    raw: RawSample,
    height_mm: f64,
) -> Option<Residual> {
    let point = position_mm(calibration, raw);
    let ray = Ray::of(calibration, raw);
    let (met, by_own) = match reference {
        Reference::Sphere {
            centre_mm,
            radius_mm,
            ..
        } => {
            let met = ray.meets(*centre_mm, *radius_mm)?;
            (met, -met.normal)
        }
        Reference::Steps {
            normal,
            offset_mm,
            middle_mm,
            ..
        } => {
            let closing = normal.dot(&ray.along);
            if closing >= 0.0 {
                return None;
            }
            let range_mm = (offset_mm + height_mm - normal.dot(&ray.origin_mm)) / closing;
            let met = Met {
                range_mm,
                normal: *normal,
            };
            let (across, along) = tangents(*normal);
            let from = ray.origin_mm + ray.along * range_mm - middle_mm;
            let by_own = Vector3::new(across.dot(&from), along.dot(&from), -1.0);
            (met, by_own)
        }
    };
    Some(Residual {
        raw,
        off_mm: met.off_mm(&ray, point),
        range_counts: met.range_counts(&ray),
        by_place: met.normal,
        by_own,
    })
}

fn block(
    announced: &Calibration,
    deviations: &Deviations,
    reference: &Reference,
    all: &mut Normal,
) -> Block {
    let correction = deviations.correction();
    let calibration = Calibration {
        correction: Some(correction),
        ..*announced
    };
    let samples: Vec<Residual> = match reference {
        Reference::Sphere { samples, .. } => samples
            .iter()
            .filter_map(|&raw| residual(&calibration, reference, raw, 0.0))
            .collect(),
        Reference::Steps { samples, .. } => samples
            .iter()
            .filter_map(|&(raw, height_mm)| residual(&calibration, reference, raw, height_mm))
            .collect(),
    };
    let scale = deviation(samples.iter().map(|own| own.off_mm)).max(LEAST_MM);
    let mut own = SMatrix::<f64, DEVIATIONS, DEVIATIONS>::zeros();
    let mut cross = SMatrix::<f64, DEVIATIONS, 3>::zeros();
    let mut right = SVector::<f64, DEVIATIONS>::zeros();
    let mut inner = Matrix3::zeros();
    let mut inner_right = Vector3::zeros();
    for residual in &samples {
        let off = residual.off_mm / scale;
        all.spread.add(off);
        let weight = weight(off);
        if weight == 0.0 {
            continue;
        }
        all.squares_mm2.0 += weight * residual.off_mm * residual.off_mm;
        all.squares_mm2.1 += weight;
        let moves = derivatives(announced, &correction, residual.raw, residual.range_counts);
        let by = moves.transpose() * residual.by_place / scale;
        let by_own = residual.by_own / scale;
        let weighed = by * weight;
        own += weighed * by.transpose();
        cross += weighed * by_own.transpose();
        right -= weighed * off;
        inner += by_own * by_own.transpose() * weight;
        inner_right -= by_own * (weight * off);
    }
    let mut block = Block {
        own: Matrix::zeros(),
        cross: SMatrix::zeros(),
        inner,
        right: Vector::zeros(),
        inner_right,
    };
    block
        .own
        .fixed_view_mut::<DEVIATIONS, DEVIATIONS>(0, 0)
        .copy_from(&own);
    block
        .cross
        .fixed_view_mut::<DEVIATIONS, 3>(0, 0)
        .copy_from(&cross);
    block
        .right
        .fixed_view_mut::<DEVIATIONS, 1>(0, 0)
        .copy_from(&right);
    tie_to_place(deviations, reference, &mut block);
    block
}

/// A sphere at a known place is tied to it as firmly as it is known.
fn tie_to_place(deviations: &Deviations, reference: &Reference, block: &mut Block) {
    let Reference::Sphere {
        centre_mm,
        place: Some((place_mm, uncertainty_mm)),
        ..
    } = reference
    else {
        return;
    };
    let (seen, by_lean) = deviations.seen_from_plane(*place_mm);
    let off = (centre_mm - seen) / *uncertainty_mm;
    let mut by = SMatrix::<f64, UNKNOWNS, 3>::zeros();
    for (lean, by_lean) in [Deviation::PlaneAboutY, Deviation::PlaneAboutZ]
        .into_iter()
        .zip(by_lean)
    {
        by.row_mut(lean.index())
            .copy_from(&(-by_lean / *uncertainty_mm).transpose());
    }
    let firmness = 1.0 / uncertainty_mm;
    block.own += by * by.transpose();
    block.cross += by * firmness;
    block.right -= by * off;
    block.inner += Matrix3::identity() * (firmness * firmness);
    block.inner_right -= off * firmness;
}
