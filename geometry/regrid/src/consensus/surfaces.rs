//! The surfaces that the samples of a window lie on.

use super::agreement::Samples;
use crate::draws::Draws;
use crate::neighbours::Neighbour;
use crate::plane::{LEAST_SINE, Plane};

/// Standard deviations from a surface within which a sample speaks for it.
pub(crate) const WIDTH: f64 = 3.0;
/// Probability of stopping before three samples of the best surface were drawn together.
const MISS: f64 = 1e-4;
/// Fewest planes tried for a surface.
const LEAST_PLANES: usize = 6;
/// Most surfaces told apart in one window: those of a corner.
const MOST_SURFACES: usize = 3;
/// Fewest samples of a surface.
pub(super) const LEAST_INLIERS: usize = 6;
/// Fewest samples that must agree with a plane through three of them for it to be refined.
const LEAST_DRAWN: f64 = 5.0;
/// Fewest pairs of neighbouring columns that both have two or more of a surface's samples.
/// Outliers may come in runs along a column, but those of different columns hardly ever lie
/// beside each other on one plane.
const LEAST_PAIRS: usize = 2;
/// Fewest samples of a surface that do not come from the two columns with most of them: two
/// runs of outliers always have a plane in common.
const LEAST_OTHERS: usize = 4;
/// The same among samples that others leave over in a wide window.
const STRIP_OTHERS: usize = 8;
/// Runs of outliers along a column are hardly ever as long: with so many samples in each of two
/// columns a strip that runs along them is believed.
const LONG_RUN: usize = 10;
/// With so many of them the columns need not lie beside each other.
const MANY_OTHERS: usize = 10;
/// Steepest slope that a camera sees anything of: beyond 80 degrees hardly any light comes
/// back. What is steeper joins runs of outliers in different columns.
pub(super) const STEEPEST_SEEN: f64 = 6.0;
/// Steepest slope of one surface against another that is looked for among the samples which
/// the first leaves over.
const STEEPEST: f64 = 2.0;

/// With so many columns the three samples of a plane are taken from different ones, or drawn
/// again a few times: two of one run of outliers and one of another always make a plane on
/// which both runs lie.
const MANY_COLUMNS: usize = 5;
const REDRAWS: usize = 4;
/// Most planes tried for each surface after the first: enough for two fifths of the samples
/// which the first leaves over.
const MOST_FURTHER: usize = 160;
/// Share of the samples expected of a surface that must agree with a guess.
const KNOWN: f64 = 0.9;

/// How hard surfaces are looked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    /// Most planes tried for a surface.
    pub(crate) most_planes: usize,
    /// Samples of a window that lies on one surface, outliers not counted.
    pub(crate) neighbours: usize,
    /// What the first surface probably is. Where nearly all samples say so, none is sought.
    pub(crate) guess: Option<Plane>,
}

/// A plane and the samples that agree with it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surface {
    pub(crate) plane: Plane,
    /// Residuals within this are its samples', millimetres.
    pub(crate) width_mm: f64,
    /// How many samples of the window agree.
    pub(crate) inliers: usize,
    /// How far above the plane the surface is at the node, where it bends.
    pub(crate) lift_mm: f64,
}

impl Surface {
    pub(crate) fn holds(&self, n: &Neighbour) -> bool {
        self.plane.residual(n).abs() <= self.width_mm
    }

    /// Whether it has samples of more than one column in a window. Those of a single one may be
    /// a run of outliers, and tell nothing of the surface across the columns.
    pub(crate) fn spans_columns(&self, window: &[Neighbour]) -> bool {
        let mut columns = window.iter().filter(|n| self.holds(n)).map(|n| n.strip);
        let first = columns.next();
        columns.any(|column| Some(column) != first)
    }
}

/// Finds surfaces; keeps its buffers from node to node.
#[derive(Debug, Default)]
pub(crate) struct Surfaces {
    /// The samples not yet claimed by a surface, nearest first.
    left: Vec<Neighbour>,
    /// The same, side by side.
    loaded: Samples,
    scratch: Vec<f64>,
    /// The columns of the window, and how many samples of each agree with a plane.
    columns: Vec<(usize, usize)>,
    /// Whether long runs along two columns are believed.
    among_few_outliers: bool,
    found: Vec<Surface>,
}

impl Surfaces {
    /// The surfaces of a window, that with most evidence first.
    pub(crate) fn find(
        &mut self,
        window: &[Neighbour],
        noise_mm: f64,
        effort: &Effort,
        draws: &mut Draws,
    ) -> &[Surface] {
        self.first(window, noise_mm, effort, draws);
        self.further(window, noise_mm, effort, draws)
    }

    /// Forgets all surfaces, and seeks that with most evidence in a window.
    pub(crate) fn first(
        &mut self,
        window: &[Neighbour],
        noise_mm: f64,
        effort: &Effort,
        draws: &mut Draws,
    ) -> Option<&Surface> {
        self.begin(window);
        if self.left.len() >= LEAST_INLIERS {
            let width_mm = WIDTH * noise_mm;
            let known = effort.guess.and_then(|p| self.known(p, width_mm, effort));
            let plane = known.or_else(|| self.best(width_mm, effort.most_planes, draws));
            self.take(window, plane?, width_mm);
        }
        self.found.first()
    }

    /// Forgets all surfaces; whether that which was guessed is one with any of these noises,
    /// the first that will do.
    pub(crate) fn follows(
        &mut self,
        window: &[Neighbour],
        noises_mm: [f64; 2],
        effort: &Effort,
    ) -> Option<f64> {
        self.begin(window);
        let guess = effort.guess?;
        let (noise_mm, plane) = noises_mm.into_iter().find_map(|noise_mm| {
            let plane = self.known(guess, WIDTH * noise_mm, effort)?;
            Some((noise_mm, plane))
        })?;
        self.take(window, plane, WIDTH * noise_mm);
        Some(noise_mm)
    }

    /// Forgets all surfaces, and leaves every sample of a window to the next one.
    fn begin(&mut self, window: &[Neighbour]) {
        self.found.clear();
        self.among_few_outliers = false;
        self.left.clear();
        self.left.extend_from_slice(window);
        self.columns.clear();
        self.columns.extend(window.iter().map(|n| (n.strip, 0)));
        self.columns.sort_unstable();
        self.columns.dedup();
        self.load(window);
    }

    /// Seeks the other surfaces of the window whose first one was just found.
    pub(crate) fn further(
        &mut self,
        window: &[Neighbour],
        noise_mm: f64,
        effort: &Effort,
        draws: &mut Draws,
    ) -> &[Surface] {
        let distances2 = window.iter().map(|n| n.dx * n.dx + n.dy * n.dy);
        let radius2 = distances2.fold(0.0, f64::max);
        let width_mm = WIDTH * noise_mm;
        while let Some(first) = self.found.first().copied()
            && self.found.len() < MOST_SURFACES
            && self.left.len() >= LEAST_INLIERS
            && self.another_is_likely(&first, radius2.sqrt())
        {
            self.load(window);
            let most_planes = effort.most_planes.min(MOST_FURTHER);
            let Some(plane) = self.best(width_mm, most_planes, draws) else {
                break;
            };
            self.take(window, plane, width_mm);
        }
        &self.found
    }

    /// The surface with most evidence among the samples that others leave over in a wide window,
    /// with hardly any outliers around.
    pub(crate) fn strip(
        &mut self,
        samples: &[Neighbour],
        noise_mm: f64,
        effort: &Effort,
        draws: &mut Draws,
    ) -> Option<Surface> {
        self.begin(samples);
        self.among_few_outliers = true;
        if samples.len() < LEAST_INLIERS {
            return None;
        }
        let width_mm = WIDTH * noise_mm;
        let most_planes = effort.most_planes.min(MOST_FURTHER);
        let plane = self.best(width_mm, most_planes, draws)?;
        self.take(samples, plane, width_mm);
        self.found.first().copied()
    }

    /// Adds a surface, whose samples are left to no other.
    fn take(&mut self, window: &[Neighbour], plane: Plane, width_mm: f64) {
        let mut surface = Surface {
            plane,
            width_mm,
            inliers: 0,
            lift_mm: 0.0,
        };
        surface.inliers = window.iter().filter(|n| surface.holds(n)).count();
        self.found.push(surface);
        self.left.retain(|n| !surface.holds(n));
    }

    /// Whether as many of the samples left as a surface needs lie together above or below
    /// the first one. Among scattered outliers they hardly ever do, which spares the search.
    fn another_is_likely(&mut self, first: &Surface, radius_mm: f64) -> bool {
        let height_mm = (STEEPEST * radius_mm).max(4.0 * first.width_mm);
        self.scratch.clear();
        self.scratch
            .extend(self.left.iter().map(|n| first.plane.residual(n)));
        self.scratch.sort_unstable_by(f64::total_cmp);
        self.scratch
            .windows(LEAST_INLIERS)
            .any(|some| some[LEAST_INLIERS - 1] - some[0] <= height_mm)
    }

    /// Whether a plane's samples among those left are those of a surface: enough of them,
    /// from columns beside each other.
    fn spans(&mut self, plane: &Plane, width_mm: f64) -> bool {
        for column in &mut self.columns {
            column.1 = 0;
        }
        for n in &self.left {
            if plane.residual(n).abs() <= width_mm {
                let column = self.columns.binary_search_by_key(&n.strip, |c| c.0);
                if let Some(column) = column.ok().and_then(|k| self.columns.get_mut(k)) {
                    column.1 += 1;
                }
            }
        }
        let (mut number, mut longest, mut second) = (0, 0, 0);
        for &(_, inliers) in &self.columns {
            number += inliers;
            second = second.max(inliers.min(longest));
            longest = longest.max(inliers);
        }
        let pairs = self
            .columns
            .windows(2)
            .filter(|pair| pair.iter().all(|c| c.1 >= 2))
            .count();
        let others = number - longest - second;
        if number < LEAST_INLIERS {
            return false;
        }
        let beside = |least_others| pairs >= LEAST_PAIRS && others >= least_others;
        if self.among_few_outliers {
            // What is left of a wide window is the more likely to be runs, few as they are.
            return second >= LONG_RUN || others >= MANY_OTHERS || beside(STRIP_OTHERS);
        }
        let few = self.columns.len() <= LEAST_PAIRS;
        few || others >= MANY_OTHERS || beside(LEAST_OTHERS)
    }

    fn load(&mut self, window: &[Neighbour]) {
        let radius2 = window.last().map_or(0.0, |n| n.distance2);
        self.loaded.load(&self.left, radius2);
    }

    /// The plane that a guess leads to, where nearly all samples expected agree with it.
    fn known(&mut self, guess: Plane, width_mm: f64, effort: &Effort) -> Option<Plane> {
        let enough = KNOWN * effort.neighbours as f64;
        let mut plane = guess;
        for _ in 0..2 {
            plane = self.loaded.refined(&plane, width_mm)?;
        }
        let score = self.loaded.score(&plane, width_mm, 0.0)?;
        let known = score.inliers >= enough;
        (known && self.spans(&plane, width_mm)).then_some(plane)
    }

    /// The plane with most evidence among the samples loaded.
    fn best(&mut self, width_mm: f64, most_planes: usize, draws: &mut Draws) -> Option<Plane> {
        let number = self.left.len();
        let many = self.columns.len() >= MANY_COLUMNS;
        let mut best: Option<(f64, Plane)> = None;
        let mut enough = most_planes;
        let mut best_drawn = 0.0;
        let mut tried = 0;
        while tried < enough {
            tried += 1;
            let mut triple = draws.triple(number);
            for _ in 0..REDRAWS {
                if !many || self.apart(triple) {
                    break;
                }
                triple = draws.triple(number);
            }
            let [p, q, r] = triple;
            let Some(plane) =
                Plane::through(&self.left[p], &self.left[q], &self.left[r], LEAST_SINE)
            else {
                continue;
            };
            if plane.a * plane.a + plane.b * plane.b > STEEPEST_SEEN * STEEPEST_SEEN {
                continue;
            }
            let Some(drawn) = self.loaded.score(&plane, width_mm, best_drawn) else {
                continue;
            };
            if drawn.inliers < LEAST_DRAWN {
                continue;
            }
            let mut better = (drawn, plane);
            // Three samples carry their noise far; the samples that agree with their plane
            // know better.
            for _ in 0..2 {
                let refined = self.loaded.refined(&better.1, width_mm);
                let rated = refined.and_then(|refined| {
                    let evidence = better.0.evidence;
                    Some((self.loaded.score(&refined, width_mm, evidence)?, refined))
                });
                let Some(rated) = rated else {
                    break;
                };
                better = rated;
            }
            let evidence = better.0.evidence;
            if best.is_none_or(|(other, _)| evidence > other) && self.spans(&better.1, width_mm) {
                best_drawn = drawn.evidence;
                best = Some((evidence, better.1));
                enough = planes_needed(better.0.inliers / number as f64, most_planes);
            }
        }
        best.map(|(_, plane)| plane)
    }

    /// Whether the samples come from three columns.
    fn apart(&self, [p, q, r]: [usize; 3]) -> bool {
        let [p, q, r] = [p, q, r].map(|k| self.left[k].strip);
        p != q && q != r && r != p
    }
}

/// Planes to try until three samples of a surface were drawn together, but for [`MISS`].
fn planes_needed(share: f64, most: usize) -> usize {
    let hit = share * share * share;
    if hit >= 0.999 {
        return LEAST_PLANES.min(most);
    }
    let planes = libm::log(MISS) / libm::log(1.0 - hit.max(1e-9));
    (planes.ceil() as usize).max(LEAST_PLANES).min(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples in columns beside each other, so many in each, on one plane.
    fn columns(lengths: &[usize]) -> Vec<Neighbour> {
        let mut samples = Vec::new();
        for (strip, &length) in lengths.iter().enumerate() {
            for row in 0..length {
                let (x, y) = (strip as f64 - 1.0, row as f64 - 2.0);
                samples.push(Neighbour {
                    strip,
                    index: row,
                    ..Neighbour::at(x, y, 3.0 + 0.1 * x)
                });
            }
        }
        samples.sort_by(Neighbour::order);
        samples
    }

    /// Whether a window's own surface, and a strip of a wide window, are found.
    fn found(lengths: &[usize]) -> (bool, bool) {
        let samples = columns(lengths);
        let effort = Effort {
            most_planes: 200,
            neighbours: samples.len(),
            guess: None,
        };
        let mut surfaces = Surfaces::default();
        let mut draws = Draws::new(1, 2, 3);
        let own = surfaces
            .first(&samples, 0.05, &effort, &mut draws)
            .is_some();
        let strip = surfaces.strip(&samples, 0.05, &effort, &mut draws);
        (own, strip.is_some())
    }

    #[test]
    fn of_samples_left_over_runs_of_a_few_columns_are_no_strip() {
        assert_eq!(found(&[5, 5, 4]), (true, false));
        assert_eq!(found(&[5, 5, 4, 4]), (true, true));
        assert_eq!(found(&[10, 10]), (true, true));
    }

    #[test]
    fn two_runs_of_outliers_are_no_surface() {
        assert_eq!(found(&[5, 5, 1]), (false, false));
    }

    #[test]
    fn a_run_along_one_column_spans_none() {
        let surface = Surface {
            plane: Plane {
                a: 0.1,
                b: 0.0,
                c: 3.0,
            },
            width_mm: 0.1,
            inliers: 0,
            lift_mm: 0.0,
        };
        assert!(!surface.spans_columns(&columns(&[8])));
        assert!(!surface.spans_columns(&[]));
        assert!(surface.spans_columns(&columns(&[8, 1])));
    }
}
