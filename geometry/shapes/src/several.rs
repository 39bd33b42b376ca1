//! Whether samples are of several shapes that meet, or of one smooth surface.

use crate::evidence::{Scale, Surface, polynomials_of};
use crate::fit::{Fit, Sample};

/// Whether one polynomial explains samples better than several shapes do, each its own: where
/// shapes meet, even smoothly, the curvature jumps, which polynomials follow with many terms only;
/// where a free form was cut into shapes, they leave more than a polynomial of few terms does.
#[must_use]
pub fn is_smooth(parts: &[(&Fit, Vec<Sample>)]) -> bool {
    let samples: Vec<Sample> = parts.iter().flat_map(|(_, own)| own.clone()).collect();
    let off = parts
        .iter()
        .flat_map(|(fit, own)| fit.offs(own).collect::<Vec<_>>());
    let freedom = parts.iter().map(|(fit, _)| fit.shape.family().freedom());
    is_smoother(&samples, off.collect(), freedom.sum())
}

/// Whether one polynomial explains samples better than a surface of so many free numbers that they
/// lie so far `off`, in their standard deviations.
#[must_use]
pub fn is_smoother(samples: &[Sample], off: Vec<f64>, freedom: usize) -> bool {
    let independent = samples.len() as f64;
    let mut surfaces = polynomials_of(samples, independent);
    surfaces.push(Surface {
        off,
        freedom,
        fit: None,
    });
    let scale = Scale {
        independent,
        surfaces,
    };
    let mut scores = scale
        .scored()
        .into_iter()
        .map(|(candidate, _)| candidate.score);
    let apart = scores.next_back().unwrap_or(f64::INFINITY);
    scores.fold(f64::INFINITY, f64::min) < apart
}

/// Whether samples that seem to be of a shape lie on the free form around them instead: one polynomial
/// explains both better than the shape and another polynomial do.
#[must_use]
pub fn is_part_of_free_form((fit, own): (&Fit, &[Sample]), around: &[Sample]) -> bool {
    let scale = Scale {
        independent: around.len() as f64,
        surfaces: polynomials_of(around, around.len() as f64),
    };
    let scored = scale.scored().into_iter().zip(&scale.surfaces);
    let best = scored.min_by(|a, b| a.0.0.score.total_cmp(&b.0.0.score));
    let Some((_, best)) = best else { return false };
    let samples: Vec<Sample> = own.iter().chain(around).copied().collect();
    let off = fit.offs(own).chain(best.off.iter().copied()).collect();
    is_smoother(&samples, off, fit.shape.family().freedom() + best.freedom)
}
