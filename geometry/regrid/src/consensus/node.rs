//! Which of the surfaces near a node is its own, and z there.

use super::bend::lift_mm;
use super::posterior::Posterior;
use super::side::{Labelled, SEEN, lengthen, separate};
use super::surfaces::{Effort, PlaneSums, Surface, Surfaces};
use crate::draws::Draws;
use crate::neighbours::Neighbour;
use crate::window::Spacing;

/// Samples looked at where surfaces meet, in windows: the line between them is the better
/// known the longer it is.
const WIDE: usize = 8;
/// The same for nodes beside that line; fewer where it bends.
const FAR: [usize; 3] = [49, 25, 16];
/// Windows in which a second surface is sought where the first has few samples in one.
const SECOND: usize = 2;
/// Share of a window that a surface's samples must have for z to rest on them alone; with
/// less, more are sought farther away.
const ENOUGH: f64 = 0.75;
/// Share of a window's samples below which a surface is not believed to be the only one or
/// the best.
const POOR: f64 = 0.38;
/// How many times more samples must agree with a surface of twice the noise for that to be
/// the noise.
const GAIN: f64 = 1.3;
/// Share of a window's samples, the nearest, that z rests on: fewer than the search needs to
/// withstand outliers in runs, since planes round creases the more the wider they are.
const NEAREST: f64 = 0.8;
/// Fits after which the samples that agree no longer change.
const FITS: usize = 3;

/// What is known where a node is estimated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Conditions {
    /// Standard deviation of z, millimetres.
    pub(crate) noise_mm: f64,
    /// The greatest noise believed at a single node, millimetres.
    pub(crate) most_noise_mm: f64,
    /// Whether there are outliers around, or nothing is known of them.
    pub(crate) strays: bool,
    /// Local spacing of the samples.
    pub(crate) spacing: Spacing,
    /// How hard surfaces are looked for in a window.
    pub(crate) effort: Effort,
}

/// Estimates nodes; keeps its buffers from one to the next.
#[derive(Debug, Default)]
pub(crate) struct Consensus {
    surfaces: Surfaces,
    found: Vec<Surface>,
    wide: Vec<Neighbour>,
    /// Samples of a still wider window, where they were needed.
    far: Vec<Neighbour>,
    labelled: Vec<Labelled>,
    kept: Vec<Labelled>,
    posterior: Posterior,
    /// Numbers of samples, strip by strip.
    by_strip: Vec<u32>,
    /// What noise the last node was estimated with.
    noise_mm: f64,
}

impl Consensus {
    /// The surfaces at a node, its own first. `wider` gives the samples of so many windows,
    /// nearest first.
    pub(crate) fn surfaces(
        &mut self,
        window: &[Neighbour],
        conditions: &Conditions,
        draws: &mut Draws,
        mut wider: impl FnMut(&mut Vec<Neighbour>, usize),
    ) -> &[Surface] {
        let noise_mm = self.look(window, conditions, draws);
        let nearest = (NEAREST * conditions.effort.neighbours as f64).round() as usize;
        let first = self.found.first().map_or(0, |s| s.inliers) as f64;
        if self.found.len() == 1 && first >= ENOUGH * conditions.effort.neighbours as f64 {
            for surface in &mut self.found {
                settle(surface, window, nearest);
            }
            return &self.found;
        }
        let thorough = Effort {
            guess: None,
            ..conditions.effort
        };
        self.wide.clear();
        wider(&mut self.wide, WIDE);
        self.far.clear();
        if first < POOR * window.len() as f64 {
            // Here outliers have the better of the window; farther away they do not.
            let wide = self.surfaces.find(&self.wide, noise_mm, &thorough, draws);
            if !wide.is_empty() {
                self.found.clear();
                self.found.extend_from_slice(wide);
            }
        } else if self.found.len() == 1 {
            // Outliers may leave too little of a second one.
            let number = (SECOND * window.len()).min(self.wide.len());
            let wide = self
                .surfaces
                .find(&self.wide[..number], noise_mm, &thorough, draws);
            if wide.len() > 1 {
                self.found.clear();
                self.found.extend_from_slice(wide);
            }
        }
        for surface in &mut self.found {
            settle(surface, &self.wide, nearest);
        }
        let mut other = 1;
        while other < self.found.len() {
            match self.place(other, window.len(), conditions.spacing, &mut wider) {
                Place::First => other += 1,
                Place::Other => {
                    self.found.swap(0, other);
                    other += 1;
                }
                Place::Nowhere => {
                    // One of the two is made of outliers: that with fewer samples.
                    let samples = |s: &Surface| self.wide.iter().filter(|n| s.holds(n)).count();
                    if samples(&self.found[other]) > samples(&self.found[0]) {
                        self.found.swap(0, other);
                    }
                    self.found.remove(other);
                }
            }
        }
        &self.found
    }

    /// Finds the surfaces of the window, and returns the noise with which it did: more than
    /// elsewhere where that makes many more samples agree, as on a surface that bends away
    /// from its plane by more than the noise, or is rough.
    fn look(&mut self, window: &[Neighbour], conditions: &Conditions, draws: &mut Draws) -> f64 {
        let effort = &conditions.effort;
        let mut noise_mm = conditions.noise_mm;
        // The surface probably bends here as it did at the node before, or less. Wider is never
        // followed: from node to node that would lead on over a crease.
        let before_mm = self.noise_mm;
        let halved_mm = noise_mm.max(0.5 * before_mm);
        let followed = (before_mm > noise_mm)
            .then(|| {
                self.surfaces
                    .follows(window, [halved_mm, before_mm], effort)
            })
            .flatten();
        if effort.guess.is_some() {
            noise_mm = followed.unwrap_or(halved_mm);
        }
        while followed.is_none() {
            let first = self.surfaces.first(window, noise_mm, effort, draws);
            let wider_mm = 2.0 * noise_mm;
            if wider_mm > conditions.most_noise_mm {
                break;
            }
            if let Some(first) = first {
                let ample = first.inliers as f64 >= ENOUGH * effort.neighbours as f64;
                let more = f64::from(more_samples(
                    window,
                    first,
                    conditions.strays,
                    &mut self.by_strip,
                ));
                if ample || more < (GAIN - 1.0) * first.inliers as f64 {
                    break;
                }
            }
            noise_mm = wider_mm;
        }
        let mut found = self.surfaces.further(window, noise_mm, effort, draws);
        let held: usize = found.iter().map(|s| s.inliers).sum();
        let wider = noise_mm > conditions.noise_mm;
        if conditions.strays && wider && (held as f64) < ENOUGH * effort.neighbours as f64 {
            // Surfaces that are so rough would hold nearly all; these hold outliers, too.
            noise_mm = conditions.noise_mm;
            self.surfaces.first(window, noise_mm, effort, draws);
            found = self.surfaces.further(window, noise_mm, effort, draws);
        }
        self.found.clear();
        self.found.extend_from_slice(found);
        self.noise_mm = noise_mm;
        noise_mm
    }

    /// Whether the node lies on the side of the first surface or on that of another.
    fn place(
        &mut self,
        other: usize,
        samples: usize,
        spacing: Spacing,
        wider: &mut impl FnMut(&mut Vec<Neighbour>, usize),
    ) -> Place {
        let (first, other) = (self.found[0], self.found[other]);
        let meet = (first.plane.c - other.plane.c).abs() <= first.width_mm;
        label(&self.wide, &first, &other, spacing, &mut self.labelled);
        let Some(mut line) = separate(&mut self.labelled, &mut self.posterior) else {
            return if meet { Place::First } else { Place::Nowhere };
        };
        if line.is_near() {
            if self.far.is_empty() {
                wider(&mut self.far, FAR[0]);
            }
            for windows in FAR {
                let number = (windows * samples).min(self.far.len());
                label(
                    &self.far[..number],
                    &first,
                    &other,
                    spacing,
                    &mut self.labelled,
                );
                let longer = lengthen(
                    &line,
                    0.0,
                    &mut self.labelled,
                    &mut self.kept,
                    &mut self.posterior,
                );
                if let Some(longer) = longer {
                    line = longer;
                    break;
                }
            }
        }
        if line.distance() < 0.0 {
            Place::Other
        } else {
            Place::First
        }
    }
}

/// How many more samples of the window would agree with the surface if the noise were twice
/// what it is; among outliers without those of the one column that has most of them, since a
/// run of outliers may happen to lie there.
fn more_samples(
    window: &[Neighbour],
    surface: &Surface,
    strays: bool,
    by_strip: &mut Vec<u32>,
) -> u32 {
    by_strip.clear();
    for n in window {
        let off_mm = surface.plane.residual(n).abs();
        if off_mm > surface.width_mm && off_mm <= 2.0 * surface.width_mm {
            if by_strip.len() <= n.strip {
                by_strip.resize(n.strip + 1, 0);
            }
            by_strip[n.strip] += 1;
        }
    }
    let most = by_strip.iter().copied().max().filter(|_| strays);
    by_strip.iter().sum::<u32>() - most.unwrap_or(0)
}

/// The samples that lie on one of the two surfaces alone.
fn label(
    samples: &[Neighbour],
    first: &Surface,
    other: &Surface,
    spacing: Spacing,
    labelled: &mut Vec<Labelled>,
) {
    labelled.clear();
    for n in samples {
        let label = match (first.holds(n), other.holds(n)) {
            (true, false) => 1.0,
            (false, true) => -1.0,
            _ => continue,
        };
        labelled.push(Labelled {
            u: n.dx / spacing.x_mm,
            v: n.dy / spacing.y_mm,
            label,
            trust: SEEN,
            trust_beside: SEEN,
            strip: n.strip,
        });
    }
}

/// Where a node lies that has two surfaces near.
enum Place {
    First,
    Other,
    /// The samples of both lie strewn among each other: one of them is no surface.
    Nowhere,
}

/// The least-squares plane of the nearest samples that agree, `most` at most.
fn settle(surface: &mut Surface, samples: &[Neighbour], most: usize) {
    let mut before = (0, 0);
    for _ in 0..FITS {
        let mut sums = PlaneSums::default();
        let (mut inliers, mut places) = (0, 0);
        let agree = samples.iter().enumerate().filter(|(_, n)| surface.holds(n));
        for (place, n) in agree.take(most) {
            sums.add(n.dx, n.dy, surface.plane.residual(n), 1.0);
            inliers += 1;
            places += place * place;
        }
        // Of the same samples comes the same plane.
        if before == (inliers, places) {
            break;
        }
        before = (inliers, places);
        let Some(change) = sums.plane() else {
            return;
        };
        surface.plane.a += change.a;
        surface.plane.b += change.b;
        surface.plane.c += change.c;
        surface.inliers = inliers;
    }
    surface.lift_mm = lift_mm(surface, samples, most);
}
