//! Fillets between faces that are known, found and bounded by what they are: the one surface that a
//! ball leaves which rolls along both.
//!
//! A fillet a few nodes wide is told by few samples, and beside its borders none tells which surface
//! it is of. Its neighbours take what is left of it, or it takes of theirs, and its shape follows.
//! Between two shapes that are known from afar it has one number only, its radius, and the lines in
//! which it touches them follow from that.

mod edge;

use std::collections::BTreeMap;

use range_image::{Cancelled, Monitor};
use shapes::{Fit, Shape};

use crate::compete::{NONE, Pieces};
use edge::{Edge, Taken};

/// Pairs of nodes beside each other that make pieces neighbours.
const LEAST_CONTACT: usize = 8;
/// Rounds in which the neighbours are fitted without what has been found to be the fillet's.
const ROUNDS: usize = 2;
/// Samples that shapes are fitted to.
const FITTED: usize = 1000;
/// A piece that is wider than this, in nodes, is no fillet.
const WIDEST: usize = 30;

impl Pieces<'_, '_> {
    /// Finds fillets between pieces that meet, and bounds those that there are. Of pieces that `are_apart`
    /// it is known already where they meet.
    pub(crate) fn blend(
        &mut self,
        are_apart: &dyn Fn(usize, usize) -> bool,
        monitor: &dyn Monitor,
    ) -> Result<(), Cancelled> {
        let contacts = self.contacts();
        let bounded = (0..self.fits.len()).filter_map(|fillet| self.rounded_by(fillet, &contacts));
        let known = contacts.keys();
        let known = known.filter(|(a, b)| self.fits[*a].is_some() && self.fits[*b].is_some());
        let sharp = known.map(|&(a, b)| Edge {
            sides: [a, b],
            fillet: None,
        });
        let is_told = |edge: &Edge| match (edge.fillet, edge.sides) {
            (Some(fillet), sides) => sides.iter().all(|side| are_apart(fillet, *side)),
            (None, [a, b]) => are_apart(a, b),
        };
        let edges: Vec<Edge> = bounded.chain(sharp).filter(|e| !is_told(e)).collect();
        for edge in edges {
            monitor.check()?;
            self.round_off(&edge);
        }
        Ok(())
    }

    /// How many places pieces have beside each other, by pairs.
    fn contacts(&self) -> BTreeMap<(usize, usize), usize> {
        let mut contacts: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for (place, &own) in self.labels.iter().enumerate() {
            for other in self.field.beside(place).map(|p| self.labels[p]) {
                if own < other && other != NONE {
                    *contacts.entry((own, other)).or_default() += 1;
                }
            }
        }
        contacts.retain(|_, count| *count >= LEAST_CONTACT);
        contacts
    }

    /// The edge that a piece may round off: that of the two which it touches most.
    fn rounded_by(
        &self,
        fillet: usize,
        contacts: &BTreeMap<(usize, usize), usize>,
    ) -> Option<Edge> {
        let is_flat = |fit: &Fit| matches!(fit.shape, Shape::Plane(_));
        if self.fits[fillet].as_ref().is_some_and(is_flat) {
            return None;
        }
        let beside = contacts.iter().filter_map(|(&(a, b), count)| match fillet {
            f if f == a => Some((*count, b)),
            f if f == b => Some((*count, a)),
            _ => None,
        });
        let mut beside: Vec<(usize, usize)> = beside.collect();
        beside.sort_by_key(|(count, other)| (core::cmp::Reverse(*count), *other));
        let [(longest, a), (_, b), ..] = beside[..] else {
            return None;
        };
        let nodes = self.labels.iter().filter(|label| **label == fillet).count();
        let are_known = self.fits[a].is_some() && self.fits[b].is_some();
        (are_known && nodes <= WIDEST * longest).then_some(Edge {
            sides: [a, b],
            fillet: Some(fillet),
        })
    }

    /// Rounds an edge off, as far as samples bear it out.
    fn round_off(&mut self, edge: &Edge) {
        let mut sides = edge.sides.map(|side| self.fits[side].clone());
        let mut found = None;
        for _ in 0..ROUNDS {
            let [Some(a), Some(b)] = &sides else { return };
            let Some(taken) = edge.fillet(self, [a, b]) else {
                return;
            };
            sides = [0, 1].map(|k| self.fitted_without(edge.sides[k], &sides[k], &taken));
            found = Some(taken);
        }
        let Some(taken) = found else { return };
        let new = self.fits.len();
        for (place, to) in &taken {
            self.labels[*place] = match to {
                Taken::Fillet(part) => edge.fillet.unwrap_or(new + part),
                Taken::Side(side) => edge.sides[*side],
            };
        }
        let last = taken.values().filter_map(|to| match to {
            Taken::Fillet(part) => Some(edge.fillet.unwrap_or(new + part)),
            Taken::Side(_) => None,
        });
        let last = last.max().unwrap_or(new);
        self.fits.resize(self.fits.len().max(last + 1), None);
        for (side, fit) in edge.sides.into_iter().zip(sides) {
            self.fits[side] = fit;
        }
        for own in edge
            .fillet
            .map_or(new..last + 1, |fillet| fillet..fillet + 1)
        {
            let set: Vec<bool> = self.labels.iter().map(|label| *label == own).collect();
            let fit = self.field.fit(&set, 0, FITTED);
            self.fits[own] = fit.or_else(|| self.fits[own].take());
        }
    }

    /// The shape of a side without what a fillet takes of it.
    fn fitted_without(
        &self,
        side: usize,
        fit: &Option<Fit>,
        taken: &BTreeMap<usize, Taken>,
    ) -> Option<Fit> {
        let is_own = |place: &usize| match taken.get(place) {
            None => self.labels[*place] == side,
            Some(_) => false,
        };
        let own: Vec<usize> = (0..self.labels.len()).filter(is_own).collect();
        let samples = self.field.samples_of(&own, FITTED);
        let again = fit.as_ref()?.again(&samples, self.field.area());
        again.or_else(|| fit.clone())
    }
}
