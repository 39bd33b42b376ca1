//! One column of grid nodes.

mod by_consensus;

use core::f64::consts::PI;

use range_image::{GridColumn, Lattice, NodeQuality};

use crate::consensus::{Consensus, Noise, Silhouette, noise};
use crate::draws::Draws;
use crate::exhaustive;
use crate::least_median::LeastMedian;
use crate::neighbours::{Near, Neighbour, Search};
use crate::plane::{Fit, Plane};
use crate::settings::{Estimator, LEAST_WINDOW, RegridSettings};
use crate::strip::{Strip, typical};
use crate::support::{Place, Surroundings};
use crate::window::{Gaps, Spacing, Window, around};

/// Computes grid columns; keeps its buffers from one to the next.
#[derive(Debug, Default)]
pub(crate) struct GridWorker {
    gaps: Gaps,
    search: Search,
    median: LeastMedian,
    surroundings: Surroundings,
    consensus: Consensus,
    silhouette: Silhouette,
    /// The last node by consensus in the column, and its plane.
    before: Option<(i64, Plane)>,
    /// What is left of a node's window.
    samples: Vec<Neighbour>,
    lengths: Vec<f64>,
    /// Rows of the grid column before, for which there is room from the outset in the next one.
    rows: usize,
}

impl GridWorker {
    /// Distance in x from the outermost column at which nodes may still have a value,
    /// given columns in ascending x that include all within reach of there.
    pub(crate) fn margin_mm(
        &mut self,
        strips: &[Strip],
        x_mm: f64,
        settings: &RegridSettings,
    ) -> Option<f64> {
        let window = Window::new(strips, x_mm, settings, &mut self.gaps)?;
        Some(settings.support.margin * window.greatest_spacing().x_mm)
    }

    /// The grid column with lattice index `i`, from columns in ascending x that include all
    /// within reach. `None` when all its nodes are masked.
    pub(crate) fn column(
        &mut self,
        strips: &[Strip],
        i: i64,
        settings: &RegridSettings,
    ) -> Option<GridColumn> {
        let lattice = Lattice {
            pitch_mm: settings.pitch_mm,
        };
        let x_mm = lattice.line_mm(i);
        if x_mm < settings.roi.x_mm.0 || x_mm > settings.roi.x_mm.1 {
            return None;
        }
        let window = Window::new(strips, x_mm, settings, &mut self.gaps)?;
        let greatest = window.greatest_spacing();
        let near_x_mm = settings.support.radius * greatest.x_mm;
        let near_y_mm = settings.support.radius * greatest.y_mm;
        let noise = match settings.estimator {
            Estimator::Consensus => noise(
                around(window.strips, NOISE_COLUMNS, x_mm).iter(),
                &mut self.lengths,
            ),
            Estimator::LeastMedian | Estimator::ExhaustiveLeastMedian | Estimator::LeastSquares => {
                None
            }
        };
        let mut column = GridColumn {
            i,
            j_first: 0,
            z_mm: Vec::with_capacity(self.rows),
            quality: Vec::with_capacity(self.rows),
        };
        self.before = None;
        self.search.begin(&window, x_mm);
        let first_row = |y_mm: f64| {
            let low = (y_mm - near_y_mm).max(settings.roi.y_mm.0);
            lattice.first_at_or_above(low)
        };
        let mut next = self.search.lowest(&window, near_x_mm).map(first_row);
        while let Some(j) = next {
            let y_mm = lattice.line_mm(j);
            if y_mm > settings.roi.y_mm.1 {
                break;
            }
            match self.search.near(&window, y_mm, [near_x_mm, near_y_mm]) {
                Near::Some => {}
                Near::Above(y) => {
                    next = Some(first_row(y).max(j + 1));
                    continue;
                }
                Near::Nothing => break,
            }
            let node = Node { y_mm, i, j, noise };
            if let Some(value) = self.node(&window, node, settings) {
                append(&mut column, j, value);
            }
            next = Some(j + 1);
        }
        self.rows = column.z_mm.len();
        (!column.z_mm.is_empty()).then_some(column)
    }

    /// z at a node and its quality, or `None` to mask it.
    fn node(
        &mut self,
        window: &Window<'_>,
        node: Node,
        settings: &RegridSettings,
    ) -> Option<(f64, NodeQuality)> {
        // Outliers take no place in a window, so that as much is known of the surface.
        let clean_share = node.noise.map_or(1.0, |noise| noise.clean_share);
        let neighbours = (settings.neighbours as f64 / clean_share).round() as usize;
        let nearest = self.search.nearest(window, node.y_mm, neighbours);
        if nearest.len() < LEAST_WINDOW {
            return None;
        }
        let spacing = local_spacing(window, nearest, &mut self.lengths);
        let dense = nearest.len() == neighbours;
        let support = &settings.support;
        // Inliers are some of the samples: where those do not suffice, inliers will not.
        let all = self.surroundings.place_of_all(nearest, spacing, support);
        // How far outside of all samples the node lies.
        let outside = match all {
            Place::Among => 0.0,
            Place::Beside { distance } => distance,
            Place::Alone => return None,
        };
        let allowed = match settings.estimator {
            Estimator::Consensus => BESIDE,
            _ => support.margin,
        };
        if outside > allowed {
            return None;
        }
        if settings.estimator == Estimator::LeastSquares {
            let fit = Fit::least_squares(nearest)?;
            let agrees = fit.agrees(support.inlier_floor * spacing.mean_mm, dense);
            let supported = self.surroundings.supported(nearest, support, &agrees);
            return supported.then(|| (fit.plane.c, quality(nearest, &fit.plane, agrees)));
        }
        let mut draws = Draws::new(settings.seed, node.i, node.j);
        if settings.estimator == Estimator::Consensus {
            self.samples.clear();
            self.samples.extend_from_slice(nearest);
            let at = At {
                window,
                node,
                neighbours,
                spacing,
                dense,
                outside,
                settings,
            };
            return self.by_consensus(&at, &mut draws);
        }
        // Samples that are left: the first of these, or, once some are taken out, of the others.
        let (mut left, mut is_whole) = (nearest.len(), true);
        while left >= LEAST_WINDOW {
            let samples = if is_whole { nearest } else { &self.samples };
            let samples = &samples[..left];
            let fit = if settings.estimator == Estimator::ExhaustiveLeastMedian {
                exhaustive::least_median(samples, &mut self.lengths)?
            } else {
                self.median.fit(samples, settings.draws, &mut draws)?
            };
            if fit.tolerance > support.inlier_ceiling * spacing.mean_mm {
                // No surface has a majority; the nearer half may show one.
                left /= 2;
                continue;
            }
            let agrees = fit.agrees(support.inlier_floor * spacing.mean_mm, dense);
            if self.surroundings.supported(nearest, support, &agrees) {
                return Some((fit.plane.c, quality(nearest, &fit.plane, agrees)));
            }
            // The majority lies on another surface than the node, as at a corner in front of
            // a wall. Without it the node's own surface may be found.
            if is_whole {
                self.samples.clear();
                self.samples.extend_from_slice(&nearest[..left]);
                is_whole = false;
            }
            self.samples.truncate(left);
            self.samples.retain(|n| !agrees(n));
            if self.samples.len() == left {
                return None;
            }
            left = self.samples.len();
        }
        None
    }
}

/// How far outside of the hull of its surface's samples a node may lie, in local spacings,
/// if the line of the silhouette has it inside.
const BESIDE: f64 = 0.7;
/// Columns on either side that tell of the noise.
const NOISE_COLUMNS: usize = 8;

/// A node to estimate.
#[derive(Debug, Clone, Copy)]
struct Node {
    y_mm: f64,
    i: i64,
    j: i64,
    /// The noise in the window, where it is known.
    noise: Option<Noise>,
}

/// A node, and what is known of its window.
struct At<'a> {
    window: &'a Window<'a>,
    node: Node,
    /// Samples that a window is to have.
    neighbours: usize,
    spacing: Spacing,
    /// Whether it has them.
    dense: bool,
    /// How far outside of all samples the node lies, in local spacings.
    outside: f64,
    settings: &'a RegridSettings,
}

/// Share of the spacing that follows from the area of the window, as a circle around the
/// node, that is believed: at a straight edge half of that circle is empty, which makes
/// the spacing seem wider by the square root of 2.
const AREA_SHARE: f64 = 0.7;

/// The spacing around a node, from the distances in y of the window's samples to the next
/// ones in their columns, but no less than the window's area lets expect.
fn local_spacing(window: &Window<'_>, nearest: &[Neighbour], lengths: &mut Vec<f64>) -> Spacing {
    // Without branches, for which of them are 0 is hard to foresee.
    lengths.resize(2 * nearest.len(), 0.0);
    let mut number = 0;
    for n in nearest {
        for gap in window.strips[n.strip].gaps(n.index) {
            lengths[number] = gap;
            number += usize::from(gap > 0.0);
        }
    }
    lengths.truncate(number);
    let limit_mm = window.greatest_sample_spacing_mm;
    let along = typical(lengths).map_or(limit_mm, |spacing| spacing.min(limit_mm));
    let area = nearest
        .last()
        .map_or(0.0, |n| PI * n.distance2 / window.stretch);
    let by_area = (area / nearest.len().max(1) as f64).sqrt();
    window.widened(window.spacing(along), AREA_SHARE * by_area)
}

/// Adds a node above all others of the column, masking those in between.
fn append(column: &mut GridColumn, j: i64, (z_mm, quality): (f64, NodeQuality)) {
    if column.z_mm.is_empty() {
        column.j_first = j;
    }
    let row = (j - column.j_first).unsigned_abs();
    column.z_mm.resize(row as usize, f64::NAN);
    column.z_mm.push(z_mm);
    column.quality.resize(row as usize, NodeQuality::default());
    column.quality.push(quality);
}

/// What is told of a node with this plane. The window's samples come in ascending distance.
fn quality(
    window: &[Neighbour],
    plane: &Plane,
    agrees: impl Fn(&Neighbour) -> bool,
) -> NodeQuality {
    let (mut inliers, mut squares) = (0_u32, 0.0);
    for n in window {
        let residual = plane.residual(n);
        let is_inlier = agrees(n);
        inliers += u32::from(is_inlier);
        squares += if is_inlier { residual * residual } else { 0.0 };
    }
    let nearest = window.iter().find(|n| agrees(n));
    let nearest2 = nearest.map_or(f64::INFINITY, |n| n.dx * n.dx + n.dy * n.dy);
    let freedom = f64::from(inliers) - 3.0;
    NodeQuality {
        inliers: u16::try_from(inliers).unwrap_or(u16::MAX),
        samples: u16::try_from(window.len()).unwrap_or(u16::MAX),
        scale_mm: (squares / freedom.max(1.0)).sqrt() as f32,
        nearest_mm: nearest2.sqrt() as f32,
    }
}
