//! A region as what a motion sweeps.

use shapes::{Motion, Sample, Sweep, spread};

use super::FAR;
use super::chain::Chain;
use super::curve::Curve;
use super::cut::cuts;
use super::refine::refined;
use super::rounding::rounded;
use super::smooth::smooth;
use super::stations::{Profile, Station};
use super::touching::touching;
use crate::field::{Field, Set};
use crate::split::NO_CREASE;
use crate::strain::are_strained;

/// Samples by which the motion is found, and the profile then told, at most.
const SOME: usize = 4000;
const MANY: usize = 20_000;
/// Steps of the motion with each of these.
const STEPS: [usize; 2] = [12, 2];
/// Samples that deviate from the profile by more than this, of what they are said to, are of no
/// sweep.
const MOST_DEVIATION: f64 = 2.0;
/// Least width of a piece, in pitches: what is narrower has hardly a node within.
const LEAST_WIDTH: f64 = 2.5;
/// Bins of the profile to a pitch: breaks are told between nodes.
const BINS: f64 = 2.0;
/// Samples of a bin, where there are enough.
const PER_BIN: f64 = 12.0;
/// What each number costs above its price, as where shapes are told apart.
const CAUTION: f64 = 4.0;

/// A motion and the chain that it sweeps, of two curves at least.
pub(super) struct Swept {
    pub(super) sweep: Sweep,
    pub(super) chain: Chain,
    /// What it leaves, and the price of its numbers.
    pub(super) cost: f64,
    /// What the best smooth profile costs.
    smooth: f64,
    /// Of samples about the profile, in what they are said to have.
    deviation: f64,
}

impl Swept {
    /// What sweeps a set of nodes, from a motion near to it.
    pub(super) fn of(field: &Field<'_>, set: &[bool], sweep: Sweep) -> Option<Self> {
        let many = field.samples(set, FAR, MANY);
        let some: Vec<Sample> = spread(many.len(), SOME).map(|k| many[k]).collect();
        let pitch_mm = field.pitch_mm();
        let (sweep, deviation) = refined(sweep, &some, pitch_mm, STEPS[0])?;
        if deviation > MOST_DEVIATION {
            return None;
        }
        let (sweep, _) = refined(sweep, &many, pitch_mm, STEPS[1])?;
        let profile = Profile::of(&sweep, &many, pitch_mm / BINS, PER_BIN)?.held(&many);
        let stations: Vec<Station> = profile.stations.iter().flatten().copied().collect();
        let independent = many.len() as f64 / field.area().max(1.0);
        let price = libm::log(independent.max(2.0)) + CAUTION;
        let least_mm = LEAST_WIDTH * pitch_mm;
        let cuts = cuts(&stations, least_mm, price);
        if cuts.len() < 2 {
            return None;
        }
        let chain = Chain::of(&stations, &cuts, least_mm)?;
        let chain = rounded(chain, &stations, price, least_mm);
        let chain = touching(chain, &stations, price, least_mm);
        let of_motion = price * sweep.freedom() as f64;
        Some(Self {
            cost: chain.left(&stations) + price * chain.freedom() + of_motion,
            smooth: smooth(&stations, price, stations.len() / 3) + of_motion,
            deviation: profile.deviation,
            sweep,
            chain,
        })
    }

    /// Whether it is a chain of pieces, and no smooth or wavy surface that pieces are near to.
    pub(super) fn is_sound(&self) -> bool {
        let is_wavy = self.sweep.motion == Motion::Extrusion && has_gentle(&self.chain);
        self.cost <= self.smooth && !is_wavy
    }

    /// Whether nowhere within a set of nodes, so far from its border, neighbouring samples lie to
    /// one side of it.
    pub(super) fn explains(&self, field: &Field<'_>, set: &[bool], far: usize) -> bool {
        let offs = |samples: &[Sample]| {
            let off = |sample: &Sample| {
                let placed = self.sweep.place(&sample.point_mm);
                let (off_mm, slope) = self.chain.off(placed.s_mm, placed.t_mm);
                off_mm / sample.deviation_mm(&placed.normal(slope))
            };
            samples.iter().map(off).collect()
        };
        !are_strained(field, &field.within(set, far), self.deviation, &offs)
    }

    /// The nodes of a set that lie on it.
    pub(super) fn nodes(&self, field: &Field<'_>, set: &[bool]) -> Set {
        let is_on = |place: usize| {
            let point_mm = field.point_mm(place).filter(|_| set[place])?;
            let placed = self.sweep.place(&point_mm);
            let (off_mm, slope) = self.chain.off(placed.s_mm, placed.t_mm);
            let may_mm = field.may_mm(place, &placed.normal(slope))?;
            Some(off_mm.abs() <= may_mm)
        };
        let on: Set = (0..set.len()).map(|p| is_on(p).unwrap_or(false)).collect();
        field.opened(&on)
    }
}

/// Whether flat pieces meet in no crease, be it round: these are parts of a wavy surface.
fn has_gentle(chain: &Chain) -> bool {
    let curves = &chain.curves;
    let is_gentle = |a: &Curve, b: &Curve| match (a, b) {
        (Curve::Line { normal: a, .. }, Curve::Line { normal: b, .. }) => {
            a[0] * b[0] + a[1] * b[1] > NO_CREASE
        }
        _ => false,
    };
    let next = curves.windows(2).any(|pair| is_gentle(&pair[0], &pair[1]));
    let over =
        |three: &[Curve]| matches!(three[1], Curve::Arc { .. }) && is_gentle(&three[0], &three[2]);
    next || curves.windows(3).any(over)
}
