//! Ideal sections as a scanner would see them.

use super::profile::Profile;
use crate::chance::Chance;

/// How a section is seen.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    pub(super) pitch_mm: f64,
    pub(super) noise_mm: f64,
    /// Share of samples that are anywhere.
    pub(super) outliers: f64,
    /// Share of samples that are missing.
    pub(super) dropouts: f64,
    /// Light comes in from the side, with this run for each rise; 0 from above, negative from the
    /// left.
    pub(super) shadow: f64,
    /// Whether the spot sees both levels where it lies on an edge.
    pub(super) is_blurred: bool,
    /// Share of the section that is missing in one place.
    pub(super) hole: f64,
}

/// Samples along s, from left to right.
pub(super) fn seen(profile: &Profile, view: &View, chance: &mut Chance) -> Vec<[f64; 2]> {
    let [first, last] = profile.extent_mm();
    let mut samples: Vec<[f64; 2]> = Vec::new();
    let mut s = first + view.pitch_mm * chance.unit();
    while s <= last {
        if let Some(z) = profile.height_mm(s) {
            samples.push([s, z]);
        }
        s += view.pitch_mm;
    }
    shade(&mut samples, view.shadow);
    let heights = samples.iter().map(|own| own[1]);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| {
        (low.min(z), high.max(z))
    });
    let length = last - first;
    let gap = first + length * chance.between(0.0, 1.0 - view.hole);
    let mut told = Vec::with_capacity(samples.len());
    for k in 0..samples.len() {
        let [s, mut z] = samples[k];
        if view.is_blurred
            && let Some(&[_, next]) = samples.get(k + 1)
            && (next - z).abs() > 4.0 * view.pitch_mm
            && chance.happens(0.5)
        {
            z += (next - z) * chance.unit();
        }
        z += view.noise_mm * chance.normal();
        if chance.happens(view.outliers) {
            z = chance.between(low - 2.0, high + 2.0);
        }
        let is_missing = view.hole > 0.0 && (gap..gap + view.hole * length).contains(&s);
        if !is_missing && !chance.happens(view.dropouts) {
            told.push([s, z]);
        }
    }
    told
}

/// Removes what lies in the shadow of something beside it.
fn shade(samples: &mut Vec<[f64; 2]>, shadow: f64) {
    if shadow == 0.0 {
        return;
    }
    // Along a ray s - shadow z stays as it is; what lies below one that was met already is dark.
    let sign = if shadow > 0.0 { 1.0 } else { -1.0 };
    if shadow > 0.0 {
        samples.reverse();
    }
    let mut met = f64::INFINITY;
    samples.retain(|&[s, z]| {
        let ray = sign * s - shadow.abs() * z;
        let is_lit = ray <= met;
        met = met.min(ray);
        is_lit
    });
    if shadow > 0.0 {
        samples.reverse();
    }
}
