//! Which of the surfaces near a node is its own, and z there.

use super::bend::lift_mm;
use super::posterior::Posterior;
use super::side::{Labelled, SEEN, lengthen, separate, separate_strip};
use super::surfaces::{Effort, LEAST_INLIERS, Surface, Surfaces};
use crate::draws::Draws;
use crate::neighbours::Neighbour;
use crate::plane::PlaneSums;
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
/// Share of a surface's samples that lie on no other, from which on it is one of its own.
const OWN: f64 = 0.25;
/// The samples next to a node: where any of these lies on no surface found, it may be one of a
/// strip, of which a window holds too few.
const NEXT: usize = 4;
/// Windows in which such a strip is sought, along which it may have samples enough.
const STRIP: usize = 5;
/// Surfaces looked at there, since others may have more samples than the strip next to the node.
const STRIPS: usize = 2;
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
    /// Whether so few outliers are around that samples on no surface tell of another one.
    pub(crate) clean: bool,
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
    /// Samples of a wider window that no surface holds.
    left: Vec<Neighbour>,
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
        if self.found.len() == 1
            && first >= ENOUGH * conditions.effort.neighbours as f64
            && !(conditions.clean && is_beside_others(window, &self.found))
        {
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
                replace(&mut self.found, wide, window);
            }
        } else if self.found.len() == 1 {
            // Outliers may leave too little of a second one.
            let number = (SECOND * window.len()).min(self.wide.len());
            let wide = self
                .surfaces
                .find(&self.wide[..number], noise_mm, &thorough, draws);
            if wide.len() > 1 {
                replace(&mut self.found, wide, window);
            }
        }
        for surface in &mut self.found {
            settle(surface, &self.wide, nearest);
        }
        if conditions.clean
            && is_beside_others(window, &self.found)
            && let Some(mut strip) = self.strip(window, noise_mm, &thorough, draws)
        {
            settle(&mut strip, &self.wide, nearest);
            self.found.push(strip);
        }
        let mut other = 1;
        while other < self.found.len() {
            match self.place(other, window.len(), conditions, &mut wider) {
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

    /// The surface of the samples next to the node that no other holds, as it shows in a wider
    /// window among all that no other holds.
    fn strip(
        &mut self,
        window: &[Neighbour],
        noise_mm: f64,
        effort: &Effort,
        draws: &mut Draws,
    ) -> Option<Surface> {
        let number = (STRIP * window.len()).min(self.wide.len());
        let found = &self.found;
        let is_left = |n: &&Neighbour| !found.iter().any(|s| s.holds(n));
        self.left.clear();
        self.left.extend(self.wide[..number].iter().filter(is_left));
        for _ in 0..STRIPS {
            let strip = self.surfaces.strip(&self.left, noise_mm, effort, draws)?;
            let (mut next, mut held) = (0, 0);
            for n in next_to(window).iter().filter(is_left) {
                next += 1;
                held += usize::from(strip.holds(n));
            }
            if 2 * held > next {
                return Some(strip);
            }
            self.left.retain(|n| !strip.holds(n));
        }
        None
    }

    /// Whether the node lies on the side of the first surface or on that of another.
    fn place(
        &mut self,
        other: usize,
        samples: usize,
        conditions: &Conditions,
        wider: &mut impl FnMut(&mut Vec<Neighbour>, usize),
    ) -> Place {
        let Conditions { spacing, clean, .. } = *conditions;
        let (first, other) = (self.found[0], self.found[other]);
        let meet = (first.plane.c - other.plane.c).abs() <= first.width_mm;
        label(&self.wide, &first, &other, spacing, &mut self.labelled);
        let line = if clean {
            separate_strip(&mut self.labelled, &mut self.posterior)
        } else {
            separate(&mut self.labelled, &mut self.posterior)
        };
        let Some(mut line) = line else {
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

/// Puts the surfaces of a wider window in the place of those of the node's own. Those stay that
/// are others: a strip between two faces has few of the wider window's samples, and either face has
/// more, but most of those next to the node are the strip's; and so it is at the end of a face.
fn replace(found: &mut Vec<Surface>, wide: &[Surface], window: &[Neighbour]) {
    found.retain(|surface| {
        let (mut held, mut alone) = (0, 0);
        for n in window.iter().filter(|n| surface.holds(n)) {
            held += 1;
            alone += usize::from(!wide.iter().any(|other| other.holds(n)));
        }
        alone >= LEAST_INLIERS && alone as f64 > OWN * f64::from(held)
    });
    found.splice(0..0, wide.iter().copied());
}

fn next_to(window: &[Neighbour]) -> &[Neighbour] {
    &window[..NEXT.min(window.len())]
}

/// Whether a sample next to the node lies on no surface found.
fn is_beside_others(window: &[Neighbour], found: &[Surface]) -> bool {
    let is_left = |n: &Neighbour| !found.iter().any(|s| s.holds(n));
    next_to(window).iter().any(is_left)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Plane;

    fn surface(a: f64, c: f64) -> Surface {
        Surface {
            plane: Plane { a, b: 0.0, c },
            width_mm: 0.2,
            inliers: 0,
            lift_mm: 0.0,
        }
    }

    /// Faces on two levels and a flank two samples wide between them, around a node on it.
    fn flank() -> Vec<Neighbour> {
        let z = |x: f64| (2.0 * x).clamp(-2.0, 2.0);
        let mut samples = Vec::new();
        for column in -4..4 {
            for row in -3..=3 {
                let (x, y) = (f64::from(column) + 0.4, f64::from(row));
                samples.push(Neighbour::at(x, y, z(x)));
            }
        }
        samples.sort_by(Neighbour::order);
        samples
    }

    #[test]
    fn a_flank_stays_beside_the_faces_of_a_wider_window() {
        let wide = [surface(0.0, -2.0), surface(0.0, 2.0)];
        let mut found = vec![surface(2.0, 0.0)];
        replace(&mut found, &wide, &flank());
        let planes: Vec<_> = found.iter().map(|s| (s.plane.a, s.plane.c)).collect();
        assert_eq!(planes, [(0.0, -2.0), (0.0, 2.0), (2.0, 0.0)]);
    }

    #[test]
    fn a_wider_window_says_more_of_the_same_surface() {
        let wide = [surface(0.0, -2.0), surface(0.0, 2.0)];
        // Nearly the upper face, and a plane that joins few samples.
        let mut found = vec![surface(0.02, 1.95), surface(0.0, 0.8)];
        replace(&mut found, &wide, &flank()[..20]);
        assert_eq!(found.len(), 2);
    }
}
