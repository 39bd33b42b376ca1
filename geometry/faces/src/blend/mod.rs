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

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;
    use shapes::Cylinder;

    use super::*;
    use crate::field::Field;
    use crate::testing::Scan;

    const PITCH_MM: f64 = 0.42;
    const SIDE: usize = 90;

    /// The pieces of a scan before and after: labels column by column, and shapes.
    fn blended(
        z_mm: impl Fn(f64, f64) -> f64,
        label: impl Fn(f64, f64) -> usize,
        are_apart: bool,
    ) -> (Vec<usize>, Vec<usize>, Vec<Option<Shape>>) {
        let scan = Scan::of((SIDE, SIDE), PITCH_MM, 0.05, z_mm);
        let all: Vec<usize> = (0..SIDE * SIDE).collect();
        let field = Field::new(&scan.image, &scan.observations, &all).unwrap();
        let at = |place: usize| {
            let (column, row) = (place / SIDE, place % SIDE);
            label(scan.image.x_mm(column), scan.image.y_mm(row))
        };
        let labels: Vec<usize> = all.iter().map(|place| at(*place)).collect();
        let most = labels.iter().max().unwrap();
        let fit = |own: usize| {
            let set: Vec<bool> = labels.iter().map(|label| *label == own).collect();
            field.fit(&set, 3, FITTED)
        };
        let mut pieces = Pieces {
            field: &field,
            labels: labels.clone(),
            fits: (0..=*most).map(fit).collect(),
        };
        pieces.blend(&|_, _| are_apart, &Unmonitored).unwrap();
        let shapes = pieces.fits.iter().map(|fit| fit.as_ref().map(|f| f.shape));
        (labels, pieces.labels, shapes.collect())
    }

    /// A roof along y with its ridge at x = 18 mm, of this fall on both sides and rounded.
    fn roof(radius_mm: f64, fall_rad: f64) -> impl Fn(f64, f64) -> f64 {
        let half_mm = radius_mm * libm::sin(fall_rad);
        move |x, _| {
            let from = (x - 18.0).abs();
            let on = from.min(half_mm);
            libm::sqrt(radius_mm * radius_mm - on * on) - (from - on) * libm::tan(fall_rad)
        }
    }

    fn count(labels: &[usize], own: usize) -> usize {
        labels.iter().filter(|label| **label == own).count()
    }

    #[test]
    fn a_fillet_that_its_planes_have_shared_is_found() {
        // 3.7 mm wide.
        let halves = |x: f64, _: f64| usize::from(x > 18.0);
        let (_, labels, shapes) = blended(roof(9.3, 0.2), halves, false);
        let columns = count(&labels, 2) as f64 / SIDE as f64;
        assert!((columns - 3.7 / PITCH_MM).abs() < 1.5, "{columns}");
        assert!(
            matches!(shapes[2], Some(Shape::Cylinder(Cylinder { radius_mm, .. }))
                if (radius_mm - 9.3).abs() < 1.0),
            "{shapes:?}"
        );
    }

    #[test]
    fn a_fillet_that_has_the_wrong_borders_gets_its_own() {
        let parted = |x: f64, _: f64| match x {
            x if x < 17.4 => 0,
            x if x < 21.0 => 2,
            _ => 1,
        };
        let (before, labels, _) = blended(roof(9.3, 0.2), parted, false);
        // It reaches from 16.15 to 19.85 mm.
        let wrong = |labels: &[usize]| {
            let is_wrong = |place: &usize| {
                let x_mm = (place / SIDE) as f64 * PITCH_MM;
                ((x_mm - 18.0).abs() < 1.85) != (labels[*place] == 2)
            };
            (0..labels.len()).filter(is_wrong).count() / SIDE
        };
        assert!(wrong(&before) > 4, "{}", wrong(&before));
        assert!(wrong(&labels) <= 2, "{}", wrong(&labels));
    }

    #[test]
    fn a_ring_between_a_plate_and_a_cone_is_found() {
        // A cone of 45 degrees stands on a plate, with a fillet of 4 mm.
        let (radius_mm, ball_mm) = (9.0, 4.0);
        let turn = ball_mm * libm::sin(core::f64::consts::FRAC_PI_4);
        let touch_mm = radius_mm + ball_mm * libm::tan(core::f64::consts::FRAC_PI_8);
        let out_mm = |x: f64, y: f64| libm::hypot(x - 18.7, y - 18.9);
        let boss = |x: f64, y: f64| {
            let within = (touch_mm - out_mm(x, y)).max(0.0);
            let on = within.min(turn);
            ball_mm - libm::sqrt(ball_mm * ball_mm - on * on) + (within - on)
        };
        let halves = |x: f64, y: f64| usize::from(out_mm(x, y) < radius_mm);
        let (_, labels, shapes) = blended(boss, halves, false);
        let ring = core::f64::consts::PI * (touch_mm.powi(2) - (touch_mm - turn).powi(2));
        let share = count(&labels, 2) as f64 * PITCH_MM * PITCH_MM / ring;
        assert!((0.8..1.15).contains(&share), "{share}");
        assert!(
            matches!(shapes[2], Some(Shape::Torus(t)) if t.is_hollow && (t.tube_mm - 4.0).abs() < 0.8),
            "{shapes:?}"
        );
    }

    #[test]
    fn noise_rounds_no_edges() {
        let halves = |x: f64, _: f64| usize::from(x > 18.0);
        for fall_rad in [0.055, 0.06, 0.08, 0.1] {
            let (before, labels, _) = blended(roof(0.0, fall_rad), halves, false);
            assert_eq!(before, labels, "{fall_rad}");
        }
    }

    #[test]
    fn sharp_edges_and_borders_that_are_told_stay() {
        let halves = |x: f64, _: f64| usize::from(x > 18.0);
        let (before, labels, _) = blended(roof(0.0, 0.2), halves, false);
        assert_eq!(before, labels);
        let (before, labels, _) = blended(roof(9.3, 0.2), halves, true);
        assert_eq!(before, labels);
        // A crease that one piece goes over is none.
        let (before, labels, _) = blended(|x, _| 0.1 * x, halves, false);
        assert_eq!(before, labels);
    }
}
