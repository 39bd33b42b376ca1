//! Where surfaces have samples, and where they would have them if they went on.

use core::cmp::Ordering;

use super::side::{LANE, Labelled, Line, SEEN};
use super::surfaces::{STEEPEST_SEEN, Surface};
use crate::neighbours::Neighbour;
use crate::strip::{Strip, lower_median};
use crate::window::{Spacing, Window};

/// Distance from the node, in spacings, at which a sample may be twice as far from a surface
/// as at the node: the plane is that of a few samples, and the surface may bend.
const KNOWN: f64 = 4.0;
/// Samples looked at above and below in each of the columns beside a sample, if they are not
/// farther from it, in spacings.
const AROUND: usize = 2;
const NEAR: f64 = 2.5;
/// Missing samples noted after the last one of a column, and columns beyond the last one.
const MISSING: usize = 3;
/// Samples missing between two of a column that may have been lost: the surface goes on.
const LOST: usize = 2;
/// Distance from a place to the next sample of its column, in usual ones, within which the
/// place is not empty: in line with a column's own samples, and level with those of the
/// columns beside it, where a single one may have dropped out.
const EMPTY: f64 = 0.6;
const EMPTY_BESIDE: f64 = 1.25;
/// Share of samples lost, if so few are known that it cannot be told from them.
const DROPPED: f64 = 0.05;

/// Slope away from the node at which a sample lies so far behind a surface that this cannot lead
/// there.
const BEHIND: f64 = 2.0;

/// Logarithm of the odds against a sample from a spot whose middle misses the surface.
const GRAZED: f64 = 3.0;

/// A node and what is known around it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Around<'a> {
    pub(crate) window: &'a Window<'a>,
    /// The surfaces at the node.
    pub(crate) surfaces: &'a [Surface],
    /// The surface that hides what lies far behind it: it alone is asked for where it ends.
    pub(crate) before: Option<Surface>,
    pub(crate) spacing: Spacing,
    pub(crate) y_mm: f64,
}

impl Around<'_> {
    /// Whether a sample, seen from the node, lies far behind the surface that hides such.
    fn hides(&self, dx: f64, dy: f64, z: f64) -> bool {
        self.before.is_some_and(|surface| {
            let far_mm = surface.width_mm + BEHIND * (dx * dx + dy * dy).sqrt();
            // A steep surface's plane soon lies far before the faces on its other side.
            z < surface.plane.at(dx, dy).min(surface.plane.c) - far_mm
        })
    }
}

/// Places of samples around a node; keeps its buffers from one node to the next.
#[derive(Debug, Default)]
pub(super) struct Places {
    /// Where the surfaces have samples.
    present: Vec<Place>,
    /// Where they end: where the next samples would be.
    missing: Vec<Place>,
    /// Where a few are missing among others.
    lost: Vec<Place>,
    gaps: Vec<f64>,
    /// Whether it is known how far apart samples are.
    known: bool,
}

impl Places {
    /// Sorts the places of the samples around a node, nearest first. `None` where no sample
    /// is missing at an end of the surfaces.
    pub(super) fn find(&mut self, samples: &[Neighbour], around: &Around<'_>) -> Option<()> {
        let Around {
            window,
            surfaces,
            spacing,
            y_mm,
            ..
        } = *around;
        let known = (KNOWN * spacing.mean_mm).powi(2);
        let held = |n: &&Neighbour| {
            // Farther away it is not known as well where the surface is.
            let wider = 1.0 + n.distance2 / known;
            let off = |surface: &Surface| surface.plane.residual(n).abs() / surface.width_mm;
            !around.hides(n.dx, n.dy, n.z)
                && (surfaces.iter().any(|surface| off(surface) <= wider)
                    || is_continued(n, window, spacing))
        };
        self.present.clear();
        self.present
            .extend(samples.iter().filter(held).map(Place::of));
        self.present.sort_unstable_by(Place::order);
        self.gaps.clear();
        let neighbours = self.present.windows(2);
        let gaps = neighbours
            .filter(|pair| pair[0].strip == pair[1].strip)
            .map(|pair| pair[1].dy - pair[0].dy);
        self.gaps.extend(gaps.filter(|gap| *gap > 0.0));
        let gap = lower_median(&mut self.gaps);
        self.known = gap.is_some();
        let gap = gap?;
        // Of places farther away it is not known whether they are empty.
        let within = samples.last()?.distance2.sqrt() - gap;
        let empty = |place: &Place| {
            let stretched = place.dx * window.stretch;
            stretched * stretched + place.dy * place.dy <= within * within
                && window.strips.get(place.strip).is_some_and(|strip| {
                    let counts = |(y, z): (f64, f64)| !around.hides(place.dx, y - y_mm, z);
                    is_clear(strip, y_mm + place.dy, EMPTY * gap, counts)
                })
        };
        self.missing.clear();
        self.lost.clear();
        self.in_line(gap, empty);
        self.level(gap, window, empty);
        (!self.missing.is_empty()).then_some(())
    }

    /// Whether the samples last looked at have none missing at an end.
    pub(super) fn are_whole(&self) -> bool {
        self.known && self.missing.is_empty()
    }

    /// Labels samples and missing ones, nearest first. A missing sample tells that the
    /// surfaces have ended the surer the fewer are lost beside the line where they do, or
    /// everywhere.
    pub(super) fn label(
        &self,
        spacing: Spacing,
        line: Option<&Line>,
        labelled: &mut Vec<Labelled>,
    ) -> f64 {
        let seen = |place: &Place, label: f64, trust: f64, trust_beside: f64| Labelled {
            u: place.dx / spacing.x_mm,
            v: place.dy / spacing.y_mm,
            label,
            trust,
            trust_beside,
            strip: place.strip,
        };
        let beside = |places: &[Place]| {
            let near = |place: &&Place| {
                line.is_none_or(|line| line.to(&seen(place, 1.0, SEEN, SEEN)).abs() <= LANE)
            };
            places.iter().filter(near).count() as f64
        };
        let (lost, present) = (beside(&self.lost), beside(&self.present));
        let dropped = (lost + 1.0) / (lost + present + 1.0 / DROPPED);
        labelled.clear();
        labelled.extend(
            self.present
                .iter()
                .map(|place| seen(place, 1.0, SEEN, GRAZED)),
        );
        let trust = -libm::log(dropped);
        labelled.extend(
            self.missing
                .iter()
                .map(|place| seen(place, -1.0, trust, trust)),
        );
        let distance2 = |s: &Labelled| s.u * s.u + s.v * s.v;
        labelled.sort_unstable_by(|s, t| {
            distance2(s)
                .total_cmp(&distance2(t))
                .then(s.v.total_cmp(&t.v))
                .then(s.u.total_cmp(&t.u))
                .then(s.label.total_cmp(&t.label))
        });
        dropped
    }

    /// Notes the missing samples in line with those of a column: after its ends, and in holes
    /// of many.
    fn in_line(&mut self, gap: f64, empty: impl Fn(&Place) -> bool) {
        for (k, place) in self.present.iter().enumerate() {
            let next = |k: Option<usize>| {
                let next = self.present.get(k?);
                let next = next.filter(|next| next.strip == place.strip);
                next.map(|next| (next.dy - place.dy).abs() / gap)
            };
            for (direction, next) in [(-1.0, next(k.checked_sub(1))), (1.0, next(Some(k + 1)))] {
                let at = |step: usize| Place {
                    dy: place.dy + direction * step as f64 * gap,
                    ..*place
                };
                let mut last = MISSING;
                if let Some(distance) = next {
                    let between = (distance.round() as usize).saturating_sub(1);
                    if between <= LOST {
                        if direction > 0.0 {
                            self.lost.extend((1..=between).map(at));
                        }
                        continue;
                    }
                    // Both ends of a hole note the half of it.
                    last = last.min(between / 2);
                }
                self.missing.extend((1..=last).map(at).filter(&empty));
            }
        }
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

/// Whether most samples around this one, in the columns beside it, may lie on one surface
/// with it.
fn is_continued(n: &Neighbour, window: &Window<'_>, spacing: Spacing) -> bool {
    let Some(own) = window.strips.get(n.strip) else {
        return false;
    };
    let Some(&(y_mm, z_mm)) = own.samples.get(n.index) else {
        return false;
    };
    let (mut agree, mut all) = (0, 0);
    for beside in [n.strip.checked_sub(1), Some(n.strip + 1)] {
        let Some(column) = beside.and_then(|strip| window.strips.get(strip)) else {
            continue;
        };
        let dx_mm = column.x_mm - own.x_mm;
        let above = column.samples.partition_point(|s| s.0 < y_mm);
        for k in above.saturating_sub(AROUND)..above + AROUND {
            let Some(&(y, z)) = column.samples.get(k) else {
                continue;
            };
            let distance_mm = (dx_mm * dx_mm + (y - y_mm) * (y - y_mm)).sqrt();
            if distance_mm <= NEAR * spacing.mean_mm {
                all += 1;
                agree += usize::from((z - z_mm).abs() <= STEEPEST_SEEN * distance_mm);
            }
        }
    }
    agree >= AROUND && 2 * agree > all
}

/// Whether no sample of the strip that counts lies as near to this height.
fn is_clear(strip: &Strip, y_mm: f64, within_mm: f64, counts: impl Fn((f64, f64)) -> bool) -> bool {
    let first = strip.samples.partition_point(|s| s.0 < y_mm - within_mm);
    let near = strip.samples.get(first..).unwrap_or_default().iter();
    !near
        .take_while(|s| s.0 <= y_mm + within_mm)
        .any(|s| counts(*s))
}
