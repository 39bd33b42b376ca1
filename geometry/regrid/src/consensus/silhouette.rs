//! Where a surface ends with nothing behind it.
//!
//! The last samples of the columns lie anywhere up to one spacing inside the outline. Where
//! the next one would be, there is none, so the outline passes between the samples and
//! those places, and the line that separates the two is known better than any one column
//! tells.

use super::arc::Arc;
use super::between::Between;
use super::side::{Labelled, Line, lengthen, separate};
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
/// Missing samples noted after the last one of a column.
const MISSING: usize = 3;
/// Distance to the next sample of a column, in usual ones, from which more than a single
/// one is missing.
const ENDED: f64 = 2.5;
/// Distance from a place to the next sample of its column, in usual ones, within which the
/// place is not empty: in line with a column's own samples, and level with those of the
/// column beside it, where a single one may have dropped out.
const EMPTY: f64 = 0.6;
const EMPTY_BESIDE: f64 = 1.25;
/// Share of the missing samples that may have dropped out, or been thrown off the surface.
const DROPPED: f64 = 0.05;
/// Farther inside of the line, in spacings, a node beside the samples owes that to something
/// else than the line, as where the scan ends.
const ELSEWHERE: f64 = 1.0;

/// Finds silhouettes; keeps its buffers from one node to the next.
#[derive(Debug, Default)]
pub(crate) struct Silhouette {
    samples: Vec<Neighbour>,
    /// Strip, dx and dy of the samples of the surfaces.
    present: Vec<(usize, f64, f64)>,
    labelled: Vec<Labelled>,
    kept: Vec<Labelled>,
    between: Between,
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
        let line = separate(&mut self.labelled, &mut self.between)?;
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
                &mut self.between,
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
            match next.follow(DROPPED, &self.labelled, &mut self.kept, &mut self.between) {
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
        let held = |n: &&Neighbour| surfaces.iter().any(|surface| surface.holds(n));
        self.present.clear();
        let places = samples.iter().filter(held).map(|n| (n.strip, n.dx, n.dy));
        self.present.extend(places);
        self.present
            .sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.2.total_cmp(&b.2)));
        self.gaps.clear();
        let neighbours = self
            .present
            .windows(2)
            .filter(|pair| pair[0].0 == pair[1].0);
        let gaps = neighbours.map(|pair| pair[1].2 - pair[0].2);
        self.gaps.extend(gaps.filter(|gap| *gap > 0.0));
        let gap = lower_median(&mut self.gaps)?;
        // Of places farther away it is not known whether they are empty.
        let within = samples.last()?.distance2.sqrt() - gap;
        let labelled = &mut self.labelled;
        labelled.clear();
        let mut add = |strip: usize, dx: f64, dy: f64, label: f64| {
            labelled.push(Labelled {
                u: dx / spacing.x_mm,
                v: dy / spacing.y_mm,
                label,
                strip,
            });
        };
        let empty = |strip: usize, dx: f64, dy: f64, clear: f64| {
            dx * dx + dy * dy <= within * within
                && window
                    .strips
                    .get(strip)
                    .is_some_and(|strip| is_clear(strip, y_mm + dy, clear * gap))
        };
        let mut missing = 0;
        for (k, &(strip, dx, dy)) in self.present.iter().enumerate() {
            add(strip, dx, dy, 1.0);
            let next = |k: Option<usize>| {
                let next = self.present.get(k?).filter(|next| next.0 == strip);
                next.map(|next| (next.2 - dy).abs())
            };
            for (direction, next) in [(-1.0, next(k.checked_sub(1))), (1.0, next(Some(k + 1)))] {
                if next.is_some_and(|distance| distance < ENDED * gap) {
                    continue;
                }
                for step in 1..=MISSING {
                    let along = step as f64 * gap;
                    if next.is_some_and(|distance| along > distance - gap) {
                        break;
                    }
                    if empty(strip, dx, dy + direction * along, EMPTY) {
                        add(strip, dx, dy + direction * along, -1.0);
                        missing += 1;
                    }
                }
            }
            for beside in [strip.checked_sub(1), Some(strip + 1)]
                .into_iter()
                .flatten()
            {
                let (Some(here), Some(there)) =
                    (window.strips.get(strip), window.strips.get(beside))
                else {
                    continue;
                };
                let dx = dx + (there.x_mm - here.x_mm);
                if empty(beside, dx, dy, EMPTY_BESIDE) {
                    add(beside, dx, dy, -1.0);
                    missing += 1;
                }
            }
        }
        let distance2 = |s: &Labelled| s.u * s.u + s.v * s.v;
        labelled.sort_unstable_by(|s, t| {
            distance2(s)
                .total_cmp(&distance2(t))
                .then(s.v.total_cmp(&t.v))
                .then(s.u.total_cmp(&t.u))
                .then(s.label.total_cmp(&t.label))
        });
        (missing > 0).then_some(())
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
