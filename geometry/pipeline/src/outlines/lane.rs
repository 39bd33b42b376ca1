//! A column as the regions see it.

use range_image::Column;
use reconstruct::{OutlineSample, Seen};

use super::owner::Owners;

/// Samples missing between two of a region that may have been lost: the region goes on.
const LOST: usize = 2;
/// Missing samples told of beyond an end.
const MISSING: usize = 2;
/// Gaps before an end over which the usual gap is measured.
const LATEST: usize = 4;
/// Distance from a place within which a sample is the one that was expected there, and within
/// which a region's own run covers a place of the column beside, in usual gaps.
const THERE: f64 = 0.6;
const COVERED: f64 = 1.25;
/// Samples at an end are no part of it that send back less light than this share of what those
/// before them let expect: more than half of their spot misses the surface, and so does its middle.
/// These are so many at most and at least. At most so many of the former, one after the other.
const LIT: f64 = 0.5;
const BEFORE: usize = 5;
const LEAST_BEFORE: usize = 3;
const DIM: usize = 2;

/// A column that falls apart into more runs is no part's: each place would be looked up in all.
const MOST_RUNS: usize = 1000;

/// A sample of a region.
#[derive(Debug, Clone, Copy)]
struct Own {
    y_mm: f64,
    intensity: u8,
    /// An outline may be near, and is no foot.
    is_edge: bool,
    /// It stands on what was left out.
    is_foot: bool,
}

/// A stretch of a column whose samples are of one region.
#[derive(Debug, Clone)]
struct Run {
    region: u16,
    first_mm: f64,
    last_mm: f64,
    /// Usual distances of samples at its two ends, millimetres.
    gap_mm: [f64; 2],
    /// Which of its ends may be those of a surface.
    is_open: [bool; 2],
}

/// A column: where regions have samples in it, and what lies near their outlines.
#[derive(Debug, Clone)]
pub(super) struct Lane {
    pub(super) x_mm: f64,
    runs: Vec<Run>,
    /// Heights of the runs' samples near outlines, the numbers of their runs, and whether they
    /// are there or lost.
    edge: Vec<(f64, usize, bool)>,
    /// It falls apart into so many runs that it tells nothing.
    is_unclear: bool,
}

impl Lane {
    pub(super) fn of(column: &Column, owners: &Owners<'_>) -> Self {
        let x_mm = column.x_mm();
        // Of each region its samples, ascending.
        let mut regions: Vec<(u16, Vec<Own>)> = Vec::new();
        for sample in column.samples() {
            let owner = owners.of(x_mm, sample.y_mm, sample.z_mm);
            if owner.region == 0 {
                continue;
            }
            let own = Own {
                y_mm: sample.y_mm,
                intensity: sample.intensity,
                is_edge: owner.is_edge && !owner.is_foot,
                is_foot: owner.is_foot,
            };
            match regions
                .iter_mut()
                .find(|(region, _)| *region == owner.region)
            {
                Some((_, samples)) => samples.push(own),
                None => regions.push((owner.region, vec![own])),
            }
        }
        let mut lane = Self {
            x_mm,
            runs: Vec::new(),
            edge: Vec::new(),
            is_unclear: false,
        };
        for (region, samples) in &regions {
            let usual_mm = usual_mm(&mut gaps(samples), owners.pitch_mm());
            let mut rest = samples.as_slice();
            while !rest.is_empty() {
                let goes_on = |pair: &[Own]| lost_between(pair, usual_mm) <= LOST;
                let count = 1 + rest.windows(2).take_while(|pair| goes_on(pair)).count();
                let (run, beyond) = rest.split_at(count);
                lane.add(*region, lit(run), usual_mm);
                rest = beyond;
            }
        }
        if lane.runs.len() > MOST_RUNS {
            (lane.runs, lane.edge, lane.is_unclear) = (Vec::new(), Vec::new(), true);
        }
        lane
    }

    /// Adds a run and what of it lies near outlines.
    fn add(&mut self, region: u16, samples: &[Own], usual_mm: f64) {
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
            return;
        };
        let gap_mm = |gaps: &mut Vec<f64>| {
            let gap_mm = self::usual_mm(gaps, usual_mm);
            gap_mm.clamp(0.5 * usual_mm, 2.0 * usual_mm)
        };
        let (head, tail) = (LATEST + 1, samples.len().saturating_sub(LATEST + 1));
        let ends = [&samples[..head.min(samples.len())], &samples[tail..]];
        let number = self.runs.len();
        self.runs.push(Run {
            region,
            first_mm: first.y_mm,
            last_mm: last.y_mm,
            gap_mm: ends.map(|end| gap_mm(&mut gaps(end))),
            is_open: [first, last].map(|end| !end.is_foot),
        });
        let near = samples.iter().filter(|own| own.is_edge);
        self.edge.extend(near.map(|own| (own.y_mm, number, true)));
        for pair in samples.windows(2) {
            let lost = lost_between(pair, usual_mm);
            let step_mm = (pair[1].y_mm - pair[0].y_mm) / (lost + 1) as f64;
            let is_foot = pair[0].is_foot || pair[1].is_foot;
            if !is_foot && (pair[0].is_edge || pair[1].is_edge) {
                let places = (1..=lost).map(|k| pair[0].y_mm + k as f64 * step_mm);
                self.edge.extend(places.map(|y_mm| (y_mm, number, false)));
            }
        }
    }

    /// Samples near outlines, and runs.
    pub(super) fn entries(&self) -> usize {
        self.edge.len() + self.runs.len()
    }

    /// Tells of the samples near outlines, and of those missing in line with them.
    pub(super) fn tell(&self, all: &mut Vec<OutlineSample>) {
        let mut note = |run: &Run, y_mm: f64, seen: Seen| {
            all.push(OutlineSample {
                region: run.region,
                place_mm: [self.x_mm, y_mm],
                seen,
            });
        };
        for &(y_mm, run, is_there) in &self.edge {
            let seen = if is_there { Seen::Present } else { Seen::Lost };
            note(&self.runs[run], y_mm, seen);
        }
        for run in &self.runs {
            let ends = [(run.first_mm, -run.gap_mm[0]), (run.last_mm, run.gap_mm[1])];
            for ((end_mm, step_mm), is_open) in ends.into_iter().zip(run.is_open) {
                if !is_open {
                    continue;
                }
                for step in 1..=MISSING {
                    let y_mm = end_mm + step as f64 * step_mm;
                    if self.is_covered(y_mm, THERE * step_mm.abs(), Some(run)) {
                        break;
                    }
                    note(run, y_mm, Seen::Missing);
                }
            }
        }
    }

    /// Tells of samples missing in the columns beside, level with those near outlines.
    pub(super) fn tell_missing(
        &self,
        beside: &mut dyn Iterator<Item = &Self>,
        all: &mut Vec<OutlineSample>,
    ) {
        let there = self.edge.iter().filter(|(_, _, is_there)| *is_there);
        let mut open: Vec<(f64, &Run)> = there
            .map(|(y_mm, run, _)| (*y_mm, &self.runs[*run]))
            .collect();
        for lane in beside {
            open.retain(|(y_mm, run)| {
                let gap_mm = run.gap_mm[0].min(run.gap_mm[1]);
                !lane.is_covered(*y_mm, COVERED * gap_mm, None)
            });
            all.extend(open.iter().map(|(y_mm, run)| OutlineSample {
                region: run.region,
                place_mm: [lane.x_mm, *y_mm],
                seen: Seen::Missing,
            }));
        }
    }

    /// Whether a region has samples there, whichever, but for a run: where one goes over into
    /// another, none is missing.
    fn is_covered(&self, y_mm: f64, within_mm: f64, but_for: Option<&Run>) -> bool {
        if self.is_unclear {
            return true;
        }
        let holds = |run: &Run| y_mm >= run.first_mm - within_mm && y_mm <= run.last_mm + within_mm;
        let others = |run: &&Run| !but_for.is_some_and(|one| core::ptr::eq(one, *run));
        self.runs.iter().filter(others).any(holds)
    }
}

fn gaps(samples: &[Own]) -> Vec<f64> {
    samples
        .windows(2)
        .map(|pair| pair[1].y_mm - pair[0].y_mm)
        .collect()
}

/// The lower median of gaps, or another where there are none.
fn usual_mm(gaps: &mut Vec<f64>, otherwise_mm: f64) -> f64 {
    gaps.retain(|gap| *gap > 0.0);
    gaps.sort_unstable_by(f64::total_cmp);
    let middle = gaps.len().saturating_sub(1) / 2;
    gaps.get(middle).copied().unwrap_or(otherwise_mm)
}

/// How many samples are missing between two.
fn lost_between(pair: &[Own], usual_mm: f64) -> usize {
    let steps = ((pair[1].y_mm - pair[0].y_mm) / usual_mm).round() as usize;
    steps.saturating_sub(1)
}

/// Samples without those at the ends that are not half lit.
fn lit(mut samples: &[Own]) -> &[Own] {
    let is_dim = |end: &Own, before: &mut dyn Iterator<Item = &Own>| {
        let before: Vec<&Own> = before.take(BEFORE).collect();
        let usual = light(&before, end.y_mm).filter(|_| before.len() >= LEAST_BEFORE);
        usual.is_some_and(|usual| f64::from(end.intensity) < LIT * usual)
    };
    for _ in 0..DIM {
        match samples {
            [end, rest @ ..] if is_dim(end, &mut rest.iter()) => samples = rest,
            _ => break,
        }
    }
    for _ in 0..DIM {
        match samples {
            [rest @ .., end] if is_dim(end, &mut rest.iter().rev()) => samples = rest,
            _ => break,
        }
    }
    samples
}

/// The light that samples let expect at a place beyond them: no more than their median, and less
/// where it falls off towards there, as on what turns away.
fn light(samples: &[&Own], y_mm: f64) -> Option<f64> {
    let mut all: Vec<f64> = samples.iter().map(|own| own.intensity.into()).collect();
    let count = all.len() as f64;
    let mean = all.iter().sum::<f64>() / count;
    let mean_mm = samples.iter().map(|own| own.y_mm).sum::<f64>() / count;
    let (mut along, mut squares) = (0.0, 0.0);
    for own in samples {
        let off_mm = own.y_mm - mean_mm;
        along += off_mm * (f64::from(own.intensity) - mean);
        squares += off_mm * off_mm;
    }
    let slope = if squares > 0.0 { along / squares } else { 0.0 };
    all.sort_unstable_by(f64::total_cmp);
    let median = *all.get(all.len() / 2)?;
    Some(median.min(mean + slope * (y_mm - mean_mm)))
}
