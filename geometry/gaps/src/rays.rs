//! The rays of a scan that went to gaps and to what is around them, those that came back with nothing
//! included.

use std::collections::BTreeMap;
use std::ops::RangeBounds;

use range_image::Column;

use crate::odds::{Counts, Usual};
use crate::sight::Sight;

/// How many nodes inside a gap a node lies: from 1 on within it, 0 and less in the regions around it.
pub(crate) type Depth = i8;

/// Counts of a gap by depth.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tally {
    pub(crate) by_depth: BTreeMap<Depth, Counts>,
}

impl Tally {
    /// Counts of some depths together.
    pub(crate) fn of(&self, depths: impl RangeBounds<Depth>) -> Counts {
        let each = self.by_depth.range(depths);
        each.fold(Counts::default(), |sum, (_, own)| sum.with(*own))
    }
}

/// Rays counted by what they met.
pub(crate) struct Rays<'a> {
    sight: &'a Sight<'a>,
    /// Usual step between rays of a column.
    step: f64,
    /// Heights of surfaces at nodes; NaN where there is none.
    surface_mm: Vec<f64>,
    /// To which gap a node belongs, and how.
    tags: Vec<Option<(u32, Depth)>>,
    near_mm: f64,
    tallies: Vec<Tally>,
    elsewhere: Counts,
    /// Of each column the share of rays on surfaces that are lost.
    lost: Vec<f64>,
}

/// Most rays in a row that are taken for lost.
const MOST_LOST: f64 = 4000.0;
/// What comes from within so many standard deviations of the surface, and so many pitches for what is
/// between nodes, comes from it.
const NEAR: f64 = 6.0;
const NEAR_PITCHES: f64 = 0.3;
/// Fewer rays of a column tell no share.
const FEWEST: f64 = 20.0;
/// Shares are never taken to be less.
const LEAST_LOST: f64 = 1e-3;
const LEAST_ASTRAY: f64 = 2e-3;

impl<'a> Rays<'a> {
    pub(crate) fn new(
        sight: &'a Sight<'a>,
        step: f64,
        surface_mm: Vec<f64>,
        tags: Vec<Option<(u32, Depth)>>,
        gaps: usize,
    ) -> Self {
        Self {
            sight,
            step,
            surface_mm,
            tags,
            near_mm: NEAR * sight.noise_mm + NEAR_PITCHES * sight.image.pitch_mm(),
            tallies: vec![Tally::default(); gaps],
            elsewhere: Counts::default(),
            lost: Vec::new(),
        }
    }

    /// Counts the rays of a column.
    pub(crate) fn take(&mut self, column: &Column) {
        let image = self.sight.image;
        let pitch_mm = image.pitch_mm();
        let own = libm::round((column.x_mm() - image.x_mm(0)) / pitch_mm);
        if !(own >= 0.0 && own < image.columns() as f64) {
            return;
        }
        let own = own as usize;
        let samples = column.samples().iter();
        let mut rays: Vec<(f64, f64)> = samples
            .map(|s| (self.sight.ray(s.y_mm, s.z_mm), s.z_mm))
            .filter(|(ray, _)| ray.is_finite())
            .collect();
        rays.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let so_far = self.elsewhere;
        let mut before: Option<(f64, f64)> = None;
        for (ray, z_mm) in rays {
            if let Some((last, last_z_mm)) = before {
                let steps = libm::round((ray - last) / self.step);
                if (2.0..=MOST_LOST).contains(&steps) {
                    let apart = (ray - last) / steps;
                    for k in 1..steps as usize {
                        self.count(own, last + apart * k as f64, last_z_mm.max(z_mm), None);
                    }
                }
            }
            self.count(own, ray, z_mm, Some(z_mm));
            before = Some((ray, z_mm));
        }
        let rays = self.elsewhere.all() - so_far.all();
        if rays >= FEWEST {
            let lost = self.elsewhere.lost - so_far.lost;
            self.lost.push(f64::from(lost) / rays);
        }
    }

    /// Counts a ray that came back from a height, or did not. `near_mm` is where what it meets is sought
    /// from.
    fn count(&mut self, column: usize, ray: f64, near_mm: f64, returned_mm: Option<f64>) {
        if let Some((node, height_mm)) = self.met(column, ray, near_mm) {
            self.tell(node, height_mm, returned_mm);
        }
    }

    fn tell(&mut self, node: usize, height_mm: f64, returned_mm: Option<f64>) {
        let counts = match self.tags[node] {
            Some((gap, depth)) => {
                let tally = &mut self.tallies[gap as usize];
                tally.by_depth.entry(depth).or_default()
            }
            None => &mut self.elsewhere,
        };
        let count = match returned_mm {
            None => &mut counts.lost,
            Some(z) if z < height_mm - self.near_mm => &mut counts.below,
            Some(z) if z > height_mm + self.near_mm => &mut counts.above,
            Some(_) => &mut counts.on_surface,
        };
        *count += 1;
    }

    /// The node near which a ray meets a surface, and the height there.
    fn met(&self, column: usize, ray: f64, near_mm: f64) -> Option<(usize, f64)> {
        let image = self.sight.image;
        let pitch_mm = image.pitch_mm();
        let mut height_mm = near_mm;
        let mut found = None;
        for _ in 0..ITERATIONS {
            let y_mm = self.sight.passes(ray, height_mm);
            let at = (y_mm - image.y_mm(0)) / pitch_mm;
            let row = libm::round(at);
            if !(row >= 0.0 && row < image.rows() as f64) {
                return None;
            }
            let node = column * image.rows() + row as usize;
            let own = self.surface_mm[node];
            if own.is_nan() {
                // It may pass a step: what it was sought from is too high or too low for it.
                return found;
            }
            // Along the column, on the line to the neighbour on the side where the ray passes.
            let beside = if at > row {
                node + 1
            } else {
                node.saturating_sub(1)
            };
            let slope = self
                .surface_mm
                .get(beside)
                .filter(|z| !z.is_nan() && beside / image.rows() == column)
                .map_or(0.0, |z| z - own);
            let slope = if libm::fabs(slope) > STEEPEST * pitch_mm {
                0.0
            } else {
                slope
            };
            height_mm = own + slope * libm::fabs(at - row);
            found = Some((node, height_mm));
        }
        found
    }

    /// What was counted for each gap, and on surfaces elsewhere.
    pub(crate) fn finish(mut self) -> (Vec<Tally>, Usual) {
        let of = self.elsewhere;
        // The median of columns does not mind where it glares.
        let lost = median(&mut self.lost).unwrap_or_else(|| f64::from(of.lost) / of.all().max(1.0));
        let share = |part: f64, all: f64, least: f64| (part / all.max(1.0)).clamp(least, 0.5);
        let astray = f64::from(of.below) + f64::from(of.above);
        let usual = Usual {
            rays: of.all(),
            lost: lost.clamp(LEAST_LOST, 0.5),
            astray: share(astray, of.returned(), LEAST_ASTRAY),
        };
        (self.tallies, usual)
    }
}

/// Steps towards where a ray meets a surface.
const ITERATIONS: usize = 4;
/// Neighbours that rise more steeply, in pitches by pitch, are of something else.
const STEEPEST: f64 = 4.0;

/// Nodes in place of rays, where there are none.
pub(crate) fn of_nodes(
    sight: &Sight<'_>,
    surface_mm: &[f64],
    tags: &[Option<(u32, Depth)>],
    gaps: usize,
) -> (Vec<Tally>, Usual) {
    let mut rays = Rays::new(sight, 1.0, surface_mm.to_vec(), tags.to_vec(), gaps);
    for (node, z_mm) in sight.measured.raw_z_mm().iter().enumerate() {
        let height_mm = rays.surface_mm[node];
        if !height_mm.is_nan() {
            rays.tell(node, height_mm, Some(*z_mm).filter(|z| !z.is_nan()));
        }
    }
    rays.finish()
}

/// Usual steps between the rays of columns, gathered column by column.
#[derive(Debug, Default)]
pub(crate) struct Steps {
    medians: Vec<f64>,
}

impl Steps {
    pub(crate) fn take(&mut self, sight: &Sight<'_>, column: &Column) {
        let samples = column.samples().iter();
        let mut rays: Vec<f64> = samples
            .map(|s| sight.ray(s.y_mm, s.z_mm))
            .filter(|ray| ray.is_finite())
            .collect();
        rays.sort_by(f64::total_cmp);
        let mut steps: Vec<f64> = rays.windows(2).map(|w| w[1] - w[0]).collect();
        steps.retain(|step| *step > 0.0);
        self.medians.extend(median(&mut steps));
    }

    /// The usual step; `None` where no column has two rays.
    pub(crate) fn finish(mut self) -> Option<f64> {
        median(&mut self.medians)
    }
}

/// The upper median.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    let (_, value, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*value)
}
