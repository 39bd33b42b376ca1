//! Where a surface ends with nothing behind it.
//!
//! The last samples of the columns lie anywhere up to one spacing inside the outline. Where
//! the next one would be, there is none, so the outline passes between the samples and
//! those places, and the line that separates the two is known better than any one column
//! tells.

use core::cmp::Ordering;

use super::arc::Arc;
use super::posterior::Posterior;
use super::side::{Labelled, Line, SEEN, lengthen, separate};
use super::surfaces::Surface;
use crate::neighbours::Neighbour;
use crate::strip::{Strip, lower_median};
use crate::window::{Spacing, Window};

/// Windows in which samples and missing ones are looked at, first around the node and then
/// along the line found there.
const WINDOWS: usize = 8;
const FAR: [usize; 2] = [25, 16];
/// The same where it is bent, by and by.
const BENT: [usize; 3] = [4, 8, 16];
/// Distance from the node, in spacings, at which a sample may be twice as far from a surface
/// as at the node: the plane is that of a few samples, and the surface may bend.
const KNOWN: f64 = 4.0;
/// Missing samples noted after the last one of a column.
const MISSING: usize = 3;
/// Samples missing between two of a column that may have been lost: the surface goes on.
const LOST: usize = 2;
/// Distance from a place to the next sample of its column, in usual ones, within which the
/// place is not empty: in line with a column's own samples, and level with those of the
/// column beside it, where a single one may have dropped out.
const EMPTY: f64 = 0.6;
const EMPTY_BESIDE: f64 = 1.25;
/// Share of samples lost, if so few are known that it cannot be told from them.
const DROPPED: f64 = 0.05;
/// Farther inside of the line, in spacings, a node beside the samples owes that to something
/// else than the line, as where the scan ends.
const ELSEWHERE: f64 = 1.0;

/// Finds silhouettes; keeps its buffers from one node to the next.
#[derive(Debug, Default)]
pub(crate) struct Silhouette {
    samples: Vec<Neighbour>,
    /// Where the surfaces have samples, and where they should if they went on.
    present: Vec<Place>,
    missing: Vec<Place>,
    labelled: Vec<Labelled>,
    kept: Vec<Labelled>,
    posterior: Posterior,
    gaps: Vec<f64>,
}

impl Silhouette {
    /// Whether the node lies inside of the outline that ends these surfaces; `None` where no
    /// straight line does. `wider` gives the samples of so many windows, nearest first.
    pub(crate) fn holds(
        &mut self,
        window: &Window<'_>,
        surfaces: &[Surface],
        (spacing, y_mm): (Spacing, f64),
        mut wider: impl FnMut(&mut Vec<Neighbour>, usize),
    ) -> Option<bool> {
        self.samples.clear();
        wider(&mut self.samples, WINDOWS);
        self.label(usize::MAX, window, surfaces, spacing, y_mm)?;
        let line = separate(&mut self.labelled, &mut self.posterior)?;
        let mut distance = line.distance();
        if line.is_near() {
            distance = self
                .straight(&line, window, surfaces, (spacing, y_mm), &mut wider)
                .or_else(|| self.bent(&line, window, surfaces, (spacing, y_mm)))
                .unwrap_or(distance);
        }
        (distance <= ELSEWHERE).then_some(distance > 0.0)
    }

    /// The node's distance from the line as far as it goes on straight.
    fn straight(
        &mut self,
        line: &Line,
        window: &Window<'_>,
        surfaces: &[Surface],
        (spacing, y_mm): (Spacing, f64),
        wider: &mut impl FnMut(&mut Vec<Neighbour>, usize),
    ) -> Option<f64> {
        self.samples.clear();
        wider(&mut self.samples, FAR[0]);
        FAR.into_iter().find_map(|windows| {
            let number = self.samples.len() * windows / FAR[0];
            self.label(number, window, surfaces, spacing, y_mm)?;
            let longer = lengthen(
                line,
                DROPPED,
                &mut self.labelled,
                &mut self.kept,
                &mut self.posterior,
            )?;
            Some(longer.distance())
        })
    }

    /// The node's distance from the arc that the line is part of.
    fn bent(
        &mut self,
        line: &Line,
        window: &Window<'_>,
        surfaces: &[Surface],
        (spacing, y_mm): (Spacing, f64),
    ) -> Option<f64> {
        let mut arc = None;
        let mut next = Arc::of(line);
        for windows in BENT {
            let number = self.samples.len() * windows / FAR[0];
            self.label(number, window, surfaces, spacing, y_mm)?;
            match next.follow(DROPPED, &self.labelled, &mut self.kept, &mut self.posterior) {
                Some(longer) => {
                    next = longer;
                    arc = Some(longer);
                }
                None => break,
            }
        }
        arc.map(|arc| arc.distance())
    }

    /// Labels the nearest `number` samples of the surfaces, and the places near them where
    /// samples are missing. `None` where none are.
    fn label(
        &mut self,
        number: usize,
        window: &Window<'_>,
        surfaces: &[Surface],
        spacing: Spacing,
        y_mm: f64,
    ) -> Option<()> {
        let samples = &self.samples[..number.min(self.samples.len())];
        let known = (KNOWN * spacing.mean_mm).powi(2);
        let held = |n: &&Neighbour| {
            // Farther away it is not known as well where the surface is.
            let wider = 1.0 + n.distance2 / known;
            let off = |surface: &Surface| surface.plane.residual(n).abs() / surface.width_mm;
            surfaces.iter().any(|surface| off(surface) <= wider)
        };
        self.present.clear();
        let places = samples.iter().filter(held).map(Place::of);
        self.present.extend(places);
        self.present.sort_unstable_by(Place::order);
        self.gaps.clear();
        let neighbours = self
            .present
            .windows(2)
            .filter(|pair| pair[0].strip == pair[1].strip);
        let gaps = neighbours.map(|pair| pair[1].dy - pair[0].dy);
        self.gaps.extend(gaps.filter(|gap| *gap > 0.0));
        let gap = lower_median(&mut self.gaps)?;
        // Of places farther away it is not known whether they are empty.
        let within = samples.last()?.distance2.sqrt() - gap;
        let empty = |place: &Place| {
            place.dx * place.dx + place.dy * place.dy <= within * within
                && window
                    .strips
                    .get(place.strip)
                    .is_some_and(|strip| is_clear(strip, y_mm + place.dy, EMPTY * gap))
        };
        self.missing.clear();
        let dropped = self.in_line(gap, empty);
        self.level(gap, window, empty);
        if self.missing.is_empty() {
            return None;
        }
        let trust = [SEEN, -libm::log(dropped)];
        self.labelled.clear();
        for (places, label, trust) in [
            (&self.present, 1.0, trust[0]),
            (&self.missing, -1.0, trust[1]),
        ] {
            self.labelled.extend(places.iter().map(|place| Labelled {
                u: place.dx / spacing.x_mm,
                v: place.dy / spacing.y_mm,
                label,
                trust,
                strip: place.strip,
            }));
        }
        let distance2 = |s: &Labelled| s.u * s.u + s.v * s.v;
        self.labelled.sort_unstable_by(|s, t| {
            distance2(s)
                .total_cmp(&distance2(t))
                .then(s.v.total_cmp(&t.v))
                .then(s.u.total_cmp(&t.u))
                .then(s.label.total_cmp(&t.label))
        });
        Some(())
    }

    /// Notes the missing samples in line with those of a column: after its ends, and in holes
    /// of many. Returns the share of samples that are lost singly or nearly so.
    fn in_line(&mut self, gap: f64, empty: impl Fn(&Place) -> bool) -> f64 {
        let mut lost = 0;
        for (k, place) in self.present.iter().enumerate() {
            let next = |k: Option<usize>| {
                let next = self
                    .present
                    .get(k?)
                    .filter(|next| next.strip == place.strip);
                next.map(|next| (next.dy - place.dy).abs() / gap)
            };
            for (direction, next) in [(-1.0, next(k.checked_sub(1))), (1.0, next(Some(k + 1)))] {
                let mut last = MISSING;
                if let Some(distance) = next {
                    let between = (distance.round() as usize).saturating_sub(1);
                    if between <= LOST {
                        lost += between;
                        continue;
                    }
                    // Both ends of a hole note the half of it.
                    last = last.min(between / 2);
                }
                for step in 1..=last {
                    let dy = place.dy + direction * step as f64 * gap;
                    let place = Place { dy, ..*place };
                    if empty(&place) {
                        self.missing.push(place);
                    }
                }
            }
        }
        // Each was counted from both of its sides.
        let lost = 0.5 * lost as f64;
        (lost + 1.0) / (lost + self.present.len() as f64 + 1.0 / DROPPED)
    }

    /// Notes the missing samples of columns level with those of the columns beside them,
    /// where a surface ends along the columns.
    fn level(&mut self, gap: f64, window: &Window<'_>, empty: impl Fn(&Place) -> bool) {
        for sample in &self.present {
            let Some(own) = window.strips.get(sample.strip) else {
                continue;
            };
            let before = (1..=MISSING).map_while(|step| sample.strip.checked_sub(step));
            let after = (1..=MISSING).map(|step| sample.strip + step);
            let sides: [&mut dyn Iterator<Item = usize>; 2] = [&mut { before }, &mut { after }];
            for side in sides {
                for strip in side {
                    let Some(column) = window.strips.get(strip) else {
                        break;
                    };
                    let place = Place {
                        strip,
                        dx: sample.dx + (column.x_mm - own.x_mm),
                        dy: sample.dy,
                    };
                    if self.is_within_column(&place, gap) || !empty(&place) {
                        break;
                    }
                    let noted = |other: &Place| {
                        other.strip == strip && (other.dy - place.dy).abs() <= EMPTY * gap
                    };
                    if !self.missing.iter().any(noted) {
                        self.missing.push(place);
                    }
                }
            }
        }
    }

    /// Whether the place lies beside a sample of its column, or between two of them.
    fn is_within_column(&self, place: &Place, gap: f64) -> bool {
        let above = self
            .present
            .partition_point(|other| other.order(place).is_lt());
        let distance = |k: Option<usize>| {
            let other = self.present.get(k?).filter(|o| o.strip == place.strip);
            other.map(|other| (other.dy - place.dy).abs() / gap)
        };
        match (distance(above.checked_sub(1)), distance(Some(above))) {
            (Some(below), Some(above)) => {
                below.min(above) < EMPTY_BESIDE || below + above < LOST as f64 + 1.5
            }
            (Some(alone), None) | (None, Some(alone)) => alone < EMPTY_BESIDE,
            (None, None) => false,
        }
    }
}

/// A place in a column, seen from the node.
#[derive(Debug, Clone, Copy)]
struct Place {
    strip: usize,
    dx: f64,
    dy: f64,
}

impl Place {
    fn of(n: &Neighbour) -> Self {
        Self {
            strip: n.strip,
            dx: n.dx,
            dy: n.dy,
        }
    }

    /// By column, then along it.
    fn order(&self, other: &Self) -> Ordering {
        self.strip
            .cmp(&other.strip)
            .then(self.dy.total_cmp(&other.dy))
    }
}

/// Whether no sample of the strip lies as near to this height.
fn is_clear(strip: &Strip, y_mm: f64, within_mm: f64) -> bool {
    let first = strip.samples.partition_point(|s| s.0 < y_mm - within_mm);
    strip
        .samples
        .get(first)
        .is_none_or(|s| s.0 > y_mm + within_mm)
}
