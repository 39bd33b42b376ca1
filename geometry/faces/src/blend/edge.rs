//! One edge between two pieces: whether it is round, and what is of its fillet.

use std::collections::{BTreeMap, VecDeque};

use shapes::{Fit, Sample, spread};

use crate::compete::Pieces;
use crate::grow::FEWEST;
use crate::rounding::{Rounding, Side};
use crate::split::STRAY;

/// How far from an edge, or from the fillet that is known there, places are looked at, in nodes.
const REACH: usize = 14;
const BESIDE: usize = 6;
/// Places that a radius is found by.
const PLACES: usize = 1500;
/// Price of a number, above the logarithm of the samples, as [`shapes::decide`] has it.
const CAUTION: f64 = 4.0;
/// Numbers that a new fillet costs: its radius, and the two lines that bound it.
const NEW: f64 = 3.0;
/// How many times the variance that samples have about the sides they may have about the fillet.
const ROUGH: f64 = 1.5;
/// Width of a fillet, in nodes: a narrower one is an edge to a scanner.
const NARROWEST: f64 = 2.5;
/// Share of the places looked at that each side must keep: a radius that leaves less is that of
/// something else.
const KEPT: f64 = 0.1;

/// An edge between two pieces, and the piece that seems to round it off.
pub(super) struct Edge {
    pub(super) sides: [usize; 2],
    pub(super) fillet: Option<usize>,
}

/// Whose a place is found to be: a connected part of the fillet's, or a side's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Taken {
    Fillet(usize),
    Side(usize),
}

/// A sample, and the piece that it is taken for.
type Tagged = (usize, Sample);

impl Edge {
    /// Places that change hands if the edge between shapes is round, and those of its fillet; `None`
    /// where samples do not bear it out.
    pub(super) fn fillet(
        &self,
        pieces: &Pieces<'_, '_>,
        sides: [&Fit; 2],
    ) -> Option<BTreeMap<usize, Taken>> {
        let near = self.near(pieces);
        let few = spread(near.len(), PLACES).map(|k| near[k]);
        let tagged: Vec<Tagged> = few
            .flat_map(|place| {
                let label = pieces.labels[place];
                let samples = pieces.field.at(place).iter();
                samples.map(move |sample| (label, *sample))
            })
            .collect();
        let samples: Vec<Sample> = tagged.iter().map(|(_, sample)| *sample).collect();
        let rounding = Rounding::of(sides.map(|fit| fit.shape), &samples)?;
        let radius_mm = rounding.radius_mm(&samples, pieces.field.pitch_mm());
        let with: Vec<f64> = rounding.offs(radius_mm, &samples).collect();
        if !self.is_likelier(pieces, sides, (&tagged, &samples), (&rounding, &with)) {
            return None;
        }
        let is_between = |sample: &Sample| {
            let side = rounding.side(radius_mm, &sample.point_mm);
            matches!(side, Side::Between(_))
        };
        let of = |between: bool| {
            let both = samples.iter().zip(&with);
            let offs = both.filter(|(sample, _)| is_between(sample) == between);
            left(offs.map(|(_, off)| *off))
        };
        if of(true) > ROUGH * of(false) {
            return None;
        }
        self.bounded(pieces, &near, |place| {
            let point_mm = pieces.field.point_mm(place)?;
            Some(rounding.side(radius_mm, &point_mm))
        })
    }

    /// Whether the round edge explains samples better than what there is.
    fn is_likelier(
        &self,
        pieces: &Pieces<'_, '_>,
        sides: [&Fit; 2],
        (tagged, samples): (&[Tagged], &[Sample]),
        (rounding, with): (&Rounding, &[f64]),
    ) -> bool {
        let count = samples.len() as f64;
        let price = libm::log(count.max(2.0)) + CAUTION;
        let score = |offs: &mut dyn Iterator<Item = f64>| count * libm::log(left(offs));
        let mut with = with.iter().copied();
        let Some(fillet) = self.fillet else {
            let mut sharp = rounding.offs(0.0, samples);
            return score(&mut with) + NEW * price < score(&mut sharp);
        };
        let own = pieces.fits[fillet].as_ref();
        // What is of no shape says nothing of where its samples lie.
        let freedom = own.map_or(0, |fit| fit.shape.family().freedom()) as f64;
        let mut as_it_is = tagged.iter().map(|(label, sample)| {
            let fit = match label {
                label if *label == fillet => own,
                label => Some(sides[usize::from(*label == self.sides[1])]),
            };
            fit.map_or(STRAY, |fit| sample.off(&fit.shape))
        });
        score(&mut with) + price <= score(&mut as_it_is) + freedom * price
    }

    /// Places near the edge: those of the fillet that there is, and what lies beside it, or what lies
    /// beside both pieces. Ascending.
    fn near(&self, pieces: &Pieces<'_, '_>) -> Vec<usize> {
        let of = |place: usize| pieces.labels[place];
        let is_side = |place: usize| self.sides.contains(&of(place));
        let begins = |place: usize| match self.fillet {
            Some(fillet) => of(place) == fillet,
            None => {
                let mut beside = pieces.field.beside(place);
                is_side(place) && beside.any(|p| is_side(p) && of(p) != of(place))
            }
        };
        let reach = if self.fillet.is_some() { BESIDE } else { REACH };
        let mut far = vec![usize::MAX; pieces.labels.len()];
        let mut queue: VecDeque<usize> = (0..far.len()).filter(|p| begins(*p)).collect();
        queue.iter().for_each(|place| far[*place] = 0);
        while let Some(place) = queue.pop_front() {
            if far[place] == reach {
                continue;
            }
            for next in pieces.field.around(place, 1) {
                if far[next] == usize::MAX && is_side(next) {
                    far[next] = far[place] + 1;
                    queue.push_back(next);
                }
            }
        }
        (0..far.len()).filter(|p| far[*p] != usize::MAX).collect()
    }

    /// What changes hands, where the fillet is wide enough and leaves something of both sides.
    fn bounded(
        &self,
        pieces: &Pieces<'_, '_>,
        near: &[usize],
        side: impl Fn(usize) -> Option<Side>,
    ) -> Option<BTreeMap<usize, Taken>> {
        let mut between = vec![false; pieces.labels.len()];
        let mut kept = [0_usize; 2];
        let mut taken = BTreeMap::new();
        for &place in near {
            let is_fillets = self.fillet == Some(pieces.labels[place]);
            match side(place)? {
                Side::Between(_) => between[place] = true,
                own => {
                    let own = usize::from(own == Side::Second);
                    kept[own] += 1;
                    if is_fillets {
                        taken.insert(place, Taken::Side(own));
                    }
                }
            }
        }
        if kept
            .iter()
            .any(|kept| (*kept as f64) < KEPT * near.len() as f64)
        {
            return None;
        }
        let parts = pieces.field.parts(&between).into_iter();
        let parts = parts.map(|part| crate::field::places(&part));
        let wide = parts.filter(|part| {
            // As many places as a strip so wide has of this length.
            part.len() >= FEWEST && part.len() as f64 >= NARROWEST * length(pieces, part)
        });
        let mut parts = 0;
        for part in wide {
            taken.extend(part.into_iter().map(|place| (place, Taken::Fillet(parts))));
            parts += 1;
        }
        (parts > 0).then_some(taken)
    }
}

/// About how long a strip of places is, in nodes: half of its border.
fn length(pieces: &Pieces<'_, '_>, part: &[usize]) -> f64 {
    let is_in = |place: &usize| part.binary_search(place).is_ok();
    let at_border = part.iter().filter(|place| {
        let mut beside = pieces.field.beside(**place);
        beside.any(|next| !is_in(&next))
    });
    0.5 * at_border.count() as f64
}

/// Mean of the squares of distances, of strays as far as that.
fn left(offs: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for off in offs {
        sum += off.abs().min(STRAY).powi(2);
        count += 1.0;
    }
    (sum / count.max(1.0)).max(f64::MIN_POSITIVE)
}
