//! Nodes given to the pieces that explain them best.

use range_image::{Cancelled, Monitor};
use rayon::prelude::*;
use shapes::Fit;

use crate::field::Field;
use crate::grow::FEWEST;

/// Rounds of fitting the pieces anew, and sweeps in each.
const ROUNDS: usize = 3;
const SWEEPS: usize = 6;
/// How far from itself a node looks for pieces, in nodes.
const REACH: usize = 2;
/// Samples lie off a shape by so many of their deviations at most, as far as that counts, and of no
/// shape by so many in the mean of their squares.
const MOST_OFF: f64 = 4.0;
const FREE: f64 = 4.0;
/// What it costs to be unlike a neighbour, in the same.
const UNLIKE: f64 = 1.5;
/// How many times as far off a shape as it may a node lies that is no node of it.
const ACROSS: f64 = 2.0;
/// Nodes at the border of a piece that its shape is not fitted to.
const FAR: usize = 1;
/// Share of its nodes inside that makes a piece more than a strip.
const STRIP: f64 = 0.8;
/// Samples that shapes are fitted to.
const SAMPLES: usize = 1000;
/// Label of nodes of no piece.
pub(crate) const NONE: usize = usize::MAX;

/// Pieces of a field: the label of each place, and the shape of each label. `None` are of no
/// shape; these neither gain nor lose where shapes compete.
pub(crate) struct Pieces<'f, 'a> {
    pub(crate) field: &'f Field<'a>,
    pub(crate) labels: Vec<usize>,
    pub(crate) fits: Vec<Option<Fit>>,
}

impl Pieces<'_, '_> {
    /// Gives nodes along the borders to the pieces that explain them best, and fits these anew.
    pub(crate) fn compete(&mut self, monitor: &dyn Monitor) -> Result<(), Cancelled> {
        for _ in 0..ROUNDS {
            monitor.check()?;
            let moved = self.settle() + self.dissolve();
            if moved == 0 {
                break;
            }
            let (field, inner) = (self.field, self.inner());
            let each = self.fits.par_iter_mut().zip(inner);
            each.for_each(|(fit, set)| {
                let samples = field.samples_of(&set, SAMPLES);
                if let Some(fit) = fit
                    && let Some(again) = fit.again(&samples, field.area())
                {
                    *fit = again;
                }
            });
        }
        Ok(())
    }

    /// The places of each piece that lie away from its border; all those of a strip, of which few
    /// do, and which tell too little of how it bends.
    fn inner(&self) -> Vec<Vec<usize>> {
        let mut inner = vec![Vec::new(); self.fits.len()];
        let mut all = inner.clone();
        for (place, label) in self.labels.iter().enumerate().filter(|(_, l)| **l != NONE) {
            let is_inner = |p: usize| self.labels[p] == *label;
            all[*label].push(place);
            if self.field.around(place, FAR).all(is_inner) {
                inner[*label].push(place);
            }
        }
        for (inner, all) in inner.iter_mut().zip(all) {
            if (inner.len() as f64) < STRIP * all.len() as f64 {
                *inner = all;
            }
        }
        inner
    }

    /// What the samples at a node cost in a piece. Nodes themselves are the middles of windows,
    /// and beside a border those lie on both sides.
    fn cost(&self, label: usize, place: usize) -> f64 {
        let samples = self.field.at(place);
        match &self.fits[label] {
            Some(fit) => fit
                .offs(samples)
                .map(|off| off.abs().min(MOST_OFF).powi(2))
                .sum(),
            None => FREE * samples.len() as f64,
        }
    }

    /// Gives nodes of no piece to shapes that they lie on, where these come to light again beyond
    /// something else.
    pub(crate) fn reclaim(&mut self) {
        let on = |place: usize| {
            let of_fit = |fit: &Option<Fit>| {
                let off = |fit: &Fit| self.field.off(&fit.shape, place);
                fit.as_ref().map_or(f64::INFINITY, off)
            };
            let off = self.fits.iter().map(of_fit).enumerate();
            let best = off.min_by(|a, b| a.1.total_cmp(&b.1));
            best.filter(|(_, off)| *off <= 1.0)
                .map_or(NONE, |(label, _)| label)
        };
        let is_left = |place: usize| self.labels[place] == NONE && self.field.has(place);
        let lying = |place| if is_left(place) { on(place) } else { NONE };
        let lying: Vec<usize> = (0..self.labels.len()).map(lying).collect();
        for part in self.field.alike(&lying) {
            if lying[part[0]] != NONE && part.len() >= FEWEST {
                part.iter()
                    .for_each(|place| self.labels[*place] = lying[*place]);
            }
        }
    }

    /// Gives nodes of no piece to pieces beside them, ring by ring.
    pub(crate) fn fill(&mut self) {
        let is_left = |place: &usize| self.labels[*place] == NONE && self.field.has(*place);
        let mut left: Vec<usize> = (0..self.labels.len()).filter(is_left).collect();
        loop {
            let best = |place: &usize| {
                let beside = self.field.around(*place, 1).map(|p| self.labels[p]);
                let best = beside.filter(|label| *label != NONE).min_by(|a, b| {
                    let cost = |label: usize| self.cost(label, *place);
                    cost(*a).total_cmp(&cost(*b)).then(a.cmp(b))
                });
                best.map(|label| (*place, label))
            };
            let given: Vec<(usize, usize)> = left.iter().filter_map(best).collect();
            if given.is_empty() {
                return;
            }
            for (place, label) in given {
                self.labels[place] = label;
            }
            left.retain(|place| self.labels[*place] == NONE);
        }
    }

    /// Sweeps over the nodes beside other pieces, until none changes. Gives how often one did.
    fn settle(&mut self) -> usize {
        let mut moved = 0;
        for _ in 0..SWEEPS {
            let before = moved;
            for place in 0..self.labels.len() {
                let own = self.labels[place];
                if own != NONE
                    && self.fits[own].is_some()
                    && let Some(best) = self.best(place)
                    && best != own
                {
                    self.labels[place] = best;
                    moved += 1;
                }
            }
            if moved == before {
                break;
            }
        }
        moved
    }

    /// The piece that explains a node at a border best, with those around it.
    fn best(&self, place: usize) -> Option<usize> {
        let own = self.labels[place];
        let is_other = |label: usize| label != own && label != NONE;
        if !self
            .field
            .around(place, 1)
            .any(|p| is_other(self.labels[p]))
        {
            return None;
        }
        let near = self.field.around(place, REACH).map(|p| self.labels[p]);
        // What lies across a step is near in the image alone.
        let is_near = |label: usize| {
            let fit = self.fits[label].as_ref();
            fit.is_some_and(|fit| label == own || self.field.off(&fit.shape, place) <= ACROSS)
        };
        let mut near: Vec<usize> = near
            .filter(|label| *label != NONE && is_near(*label))
            .collect();
        near.sort_unstable();
        near.dedup();
        let window = self
            .field
            .around(place, 1)
            .filter(|p| self.labels[*p] != NONE);
        let window: Vec<usize> = window.collect();
        let energy = |label: usize| {
            let costs = window.iter().map(|p| self.cost(label, *p));
            let unlike = window.iter().filter(|p| self.labels[**p] != label).count();
            costs.sum::<f64>() + UNLIKE * unlike as f64
        };
        let best = near.into_iter().map(|label| (energy(label), label));
        let best = best.min_by(|a, b| a.0.total_cmp(&b.0).then((a.1 != own).cmp(&(b.1 != own))));
        best.map(|(_, label)| label)
    }

    /// Leaves each shape its parts that are large enough; neighbours get the rest. Gives how many
    /// nodes that are.
    fn dissolve(&mut self) -> usize {
        let mut moved = 0;
        for part in self.field.alike(&self.labels) {
            let label = self.labels[part[0]];
            if label != NONE && self.fits[label].is_some() && part.len() < FEWEST {
                moved += part.len();
                part.iter().for_each(|place| self.labels[*place] = NONE);
            }
        }
        self.fill();
        moved
    }
}

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;
    use shapes::Shape;

    use super::*;
    use crate::testing::Scan;

    /// Two planes and the fillet between them, of which they have taken a part: fitted to less and
    /// less of the rest, it would bend more and more.
    #[test]
    fn a_fillet_regains_what_its_planes_have_taken() {
        const RADIUS_MM: f64 = 9.3;
        const FALL: f64 = 0.204;
        let (middle_mm, half_mm) = (9.0, RADIUS_MM * libm::sin(FALL));
        let scan = Scan::of((40, 200), 0.45, 0.05, |x, _| {
            let from = (x - middle_mm).abs();
            let on = from.min(half_mm);
            libm::sqrt(RADIUS_MM * RADIUS_MM - on * on) - (from - on) * libm::tan(FALL)
        });
        let all: Vec<usize> = (0..8000).collect();
        let field = Field::new(&scan.image, &scan.observations, &all).unwrap();
        // The fillet is seen in the columns from 16 to 24.
        let labels: Vec<usize> = (0..8000)
            .map(|place: usize| match place / 200 {
                0..16 => 0,
                16..22 => 1,
                _ => 2,
            })
            .collect();
        let fit = |label: usize| {
            let set: Vec<bool> = labels.iter().map(|l| *l == label).collect();
            field.fit(&set, 0, SAMPLES)
        };
        let fits: Vec<Option<Fit>> = (0..3).map(fit).collect();
        let mut pieces = Pieces {
            field: &field,
            labels,
            fits,
        };
        pieces.compete(&Unmonitored).unwrap();
        let own = pieces.labels.iter().filter(|l| **l == 1).count();
        assert!(own > 7 * 200, "{own}");
        let shape = pieces.fits[1].as_ref().unwrap().shape;
        assert!(
            matches!(shape, Shape::Cylinder(c) if (c.radius_mm - RADIUS_MM).abs() < 1.0),
            "{shape:?}"
        );
    }
}
