//! Which of the surfaces near a node is its own, and z there.

use super::side::{Labelled, signed_distance};
use super::surfaces::{PlaneSums, Surface, Surfaces};
use crate::draws::Draws;
use crate::neighbours::Neighbour;
use crate::window::Spacing;

/// Samples looked at where surfaces meet, in windows: the line between them is the better
/// known the longer it is.
pub(crate) const WIDE: usize = 8;
/// Share of a window that a surface's samples must have for z to rest on them alone; with
/// less, more are sought farther away.
const ENOUGH: f64 = 0.75;
/// Share of a window's samples below which a surface is not believed to be the only one or
/// the best.
const POOR: f64 = 0.38;
/// How many times more samples must agree with a surface of twice the noise for that to be
/// the noise.
const GAIN: f64 = 1.4;
/// Fits after which the samples that agree no longer change.
const FITS: usize = 3;

/// What is known where a node is estimated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Conditions {
    /// Standard deviation of z, millimetres.
    pub(crate) noise_mm: f64,
    /// The greatest noise believed at a single node, millimetres.
    pub(crate) most_noise_mm: f64,
    /// Local spacing of the samples.
    pub(crate) spacing: Spacing,
    /// Samples of a window.
    pub(crate) neighbours: usize,
    /// Most planes tried for a surface.
    pub(crate) most_planes: usize,
}

/// Estimates nodes; keeps its buffers from one to the next.
#[derive(Debug, Default)]
pub(crate) struct Consensus {
    surfaces: Surfaces,
    found: Vec<Surface>,
    wide: Vec<Neighbour>,
    labelled: Vec<Labelled>,
    kept: Vec<Labelled>,
}

impl Consensus {
    /// The surfaces at a node, its own first. `wider` gives the samples of a wider window,
    /// nearest first.
    pub(crate) fn surfaces(
        &mut self,
        window: &[Neighbour],
        conditions: &Conditions,
        draws: &mut Draws,
        wider: impl FnOnce(&mut Vec<Neighbour>),
    ) -> &[Surface] {
        let noise_mm = self.look(window, conditions, draws);
        let first = self.found.first().map_or(0, |s| s.inliers) as f64;
        if self.found.len() == 1 && first >= ENOUGH * conditions.neighbours as f64 {
            for surface in &mut self.found {
                settle(surface, window, conditions.neighbours);
            }
            return &self.found;
        }
        self.wide.clear();
        wider(&mut self.wide);
        if first < POOR * window.len() as f64 {
            // Here outliers have the better of the window; farther away they do not.
            let wide = self
                .surfaces
                .find(&self.wide, noise_mm, conditions.most_planes, draws);
            if !wide.is_empty() {
                self.found.clear();
                self.found.extend_from_slice(wide);
            }
        }
        for surface in &mut self.found {
            settle(surface, &self.wide, conditions.neighbours);
        }
        let mut other = 1;
        while other < self.found.len() {
            match self.place(other, conditions.spacing) {
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
        let mut noise_mm = conditions.noise_mm;
        loop {
            let found = self
                .surfaces
                .find(window, noise_mm, conditions.most_planes, draws);
            self.found.clear();
            self.found.extend_from_slice(found);
            let wider_mm = 2.0 * noise_mm;
            if wider_mm > conditions.most_noise_mm {
                return noise_mm;
            }
            if let Some(first) = self.found.first() {
                let ample = first.inliers as f64 >= ENOUGH * conditions.neighbours as f64;
                let within_mm = 2.0 * first.width_mm;
                let within = |n: &&Neighbour| first.plane.residual(n).abs() <= within_mm;
                if ample
                    || (window.iter().filter(within).count() as f64) < GAIN * first.inliers as f64
                {
                    return noise_mm;
                }
            }
            noise_mm = wider_mm;
        }
    }

    /// Whether the node lies on the side of the first surface or on that of another.
    fn place(&mut self, other: usize, spacing: Spacing) -> Place {
        let (first, other) = (self.found[0], self.found[other]);
        if (first.plane.c - other.plane.c).abs() <= first.width_mm {
            return Place::First;
        }
        self.labelled.clear();
        for n in &self.wide {
            let label = match (first.holds(n), other.holds(n)) {
                (true, false) => 1.0,
                (false, true) => -1.0,
                _ => continue,
            };
            self.labelled.push(Labelled {
                u: n.dx / spacing.x_mm,
                v: n.dy / spacing.y_mm,
                label,
            });
        }
        match signed_distance(&self.labelled, &mut self.kept) {
            Some(distance) if distance < 0.0 => Place::Other,
            Some(_) => Place::First,
            None => Place::Nowhere,
        }
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
    for _ in 0..FITS {
        let mut sums = PlaneSums::default();
        let mut inliers = 0;
        for n in samples.iter().filter(|n| surface.holds(n)).take(most) {
            sums.add(n.dx, n.dy, surface.plane.residual(n), 1.0);
            inliers += 1;
        }
        let Some(change) = sums.plane() else {
            return;
        };
        surface.plane.a += change.a;
        surface.plane.b += change.b;
        surface.plane.c += change.c;
        surface.inliers = inliers;
    }
}
