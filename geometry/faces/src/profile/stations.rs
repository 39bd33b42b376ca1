//! A profile as it is seen: the means of samples in bins along it.

use shapes::{MOST_FREE, Placed, Sample, Sweep};

/// Samples count in full up to about so many deviations (Cauchy's weights), and are left out beyond
/// as many as fits hold.
const WIDE: f64 = 2.0;
const HELD: f64 = 4.0;
/// Rounds of weighing samples.
const ROUNDS: usize = 3;
/// Bins of a profile, at most: what is longer has its bins wider.
const MOST_BINS: usize = 600;
/// Samples of a bin that tell where the profile lies.
const FEWEST: usize = 4;
/// A mean is no better known than that of so many samples with noise alone: a twentieth of their
/// deviation is the scanner's own along the profile, and no averaging takes it away.
const MOST_TELLING: f64 = 400.0;
/// Bins that a slope is taken over, at least, and most stations to either side for that.
const SLOPE_OVER: f64 = 1.5;
const MOST_BESIDE: usize = 3;
/// Samples from which deviations are told.
const LEAST: usize = 100;

/// A place of the profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Station {
    pub(super) s_mm: f64,
    pub(super) t_mm: f64,
    pub(super) slope: f64,
    /// Inverse of its variance along the profile's normal, per square millimetre.
    pub(super) weight: f64,
}

/// A profile and the samples that it was seen by.
pub(super) struct Profile {
    placed: Vec<Placed>,
    bin: Vec<usize>,
    /// Of each bin; `None` where there are too few samples.
    pub(super) stations: Vec<Option<Station>>,
    /// How far samples lie off it, in their deviations, and their weights by that.
    pub(super) off: Vec<f64>,
    weights: Vec<f64>,
    width_mm: f64,
    /// Their deviation from it, in what they are said to have.
    pub(super) deviation: f64,
}

impl Profile {
    /// The profile in bins of this width, or of more where these would hold fewer samples than
    /// `per_bin`.
    pub(super) fn of(
        sweep: &Sweep,
        samples: &[Sample],
        width_mm: f64,
        per_bin: f64,
    ) -> Option<Self> {
        if samples.len() < LEAST {
            return None;
        }
        let placed: Vec<Placed> = samples.iter().map(|s| sweep.place(&s.point_mm)).collect();
        let s_mm = || placed.iter().map(|p| p.s_mm);
        let low = s_mm().fold(f64::INFINITY, f64::min);
        let length = s_mm().fold(f64::NEG_INFINITY, f64::max) - low;
        let most = (samples.len() as f64 / per_bin).clamp(1.0, MOST_BINS as f64);
        let width = width_mm.max(length / most);
        let bins = (length / width) as usize + 1;
        let bin = s_mm().map(|s| (((s - low) / width) as usize).min(bins - 1));
        let mut profile = Self {
            bin: bin.collect(),
            stations: vec![None; bins],
            off: Vec::new(),
            weights: vec![1.0; samples.len()],
            width_mm: width,
            deviation: f64::INFINITY,
            placed,
        };
        for _ in 0..ROUNDS {
            profile.average(samples);
            profile.weigh(samples)?;
        }
        Some(profile)
    }

    /// Weighted means in the bins, and the slopes between these.
    fn average(&mut self, samples: &[Sample]) {
        let slopes: Vec<f64> = self
            .stations
            .iter()
            .map(|s| s.map_or(0.0, |s| s.slope))
            .collect();
        let mut sums = vec![(0_usize, 0.0, 0.0, 0.0); self.stations.len()];
        for ((placed, bin), (weight, sample)) in self
            .placed
            .iter()
            .zip(&self.bin)
            .zip(self.weights.iter().zip(samples))
        {
            let deviation_mm = sample.deviation_mm(&placed.normal(slopes[*bin]));
            let weight = weight / (deviation_mm * deviation_mm);
            let (count, all, s, t) = &mut sums[*bin];
            *count += 1;
            *all += weight;
            *s += weight * placed.s_mm;
            *t += weight * placed.t_mm;
        }
        let station = |&(count, weight, s, t): &(usize, f64, f64, f64)| {
            (count >= FEWEST && weight > 0.0).then(|| Station {
                s_mm: s / weight,
                t_mm: t / weight,
                slope: 0.0,
                weight,
            })
        };
        self.stations = sums.iter().map(station).collect();
        let means: Vec<(usize, Station)> = (0..sums.len())
            .filter_map(|k| Some((k, self.stations[k]?)))
            .collect();
        // Rows of samples that fall in two bins would give two means in the same place.
        let run = |j: usize, k: usize| {
            let (_, before) = means[k.saturating_sub(j)];
            let (_, after) = means[(k + j).min(means.len() - 1)];
            (after.s_mm - before.s_mm, after.t_mm - before.t_mm)
        };
        for (k, (bin, _)) in means.iter().enumerate() {
            let is_long = |j: &usize| run(*j, k).0 > SLOPE_OVER * self.width_mm;
            let beside = (1..MOST_BESIDE).find(is_long).unwrap_or(MOST_BESIDE);
            let (run, rise) = run(beside, k);
            if let Some(station) = &mut self.stations[*bin]
                && run > 0.0
            {
                station.slope = rise / run;
            }
        }
    }

    /// How far samples are off, and what they weigh by that.
    fn weigh(&mut self, samples: &[Sample]) -> Option<()> {
        let off = |((placed, bin), sample): ((&Placed, &usize), &Sample)| {
            let Some(station) = &self.stations[*bin] else {
                return f64::INFINITY;
            };
            let rise = placed.t_mm - station.t_mm - station.slope * (placed.s_mm - station.s_mm);
            let along = (1.0 + station.slope * station.slope).sqrt();
            rise / along / sample.deviation_mm(&placed.normal(station.slope))
        };
        let all = self.placed.iter().zip(&self.bin).zip(samples);
        self.off = all.map(off).collect();
        self.deviation = deviation(self.off.iter().copied());
        if !self.deviation.is_finite() {
            return None;
        }
        let wide = WIDE * self.deviation.max(f64::MIN_POSITIVE);
        let weight = |off: &f64| (1.0 + (off / wide).powi(2)).recip();
        self.weights = self.off.iter().map(weight).collect();
        Some(())
    }

    /// Leaves out what is too far off to be noise, gives all else the same weight and measures
    /// the deviation of the stations by that of the samples about them.
    pub(super) fn held(mut self, samples: &[Sample]) -> Self {
        let most = HELD * self.deviation;
        let held = |off: &f64| f64::from(u8::from(off.abs() <= most));
        self.weights = self.off.iter().map(held).collect();
        self.average(samples);
        let mut counts = vec![0.0; self.stations.len()];
        for (bin, weight) in self.bin.iter().zip(&self.weights) {
            counts[*bin] += weight;
        }
        let variance = (self.deviation * self.deviation).max(f64::MIN_POSITIVE);
        for (station, count) in self.stations.iter_mut().zip(counts) {
            if let Some(station) = station {
                station.weight /= variance * (1.0 + count / MOST_TELLING);
            }
        }
        self
    }

    /// The samples' offs by the free numbers of the motion, with what the profile makes up for
    /// taken out, and what the offs weigh.
    pub(super) fn equations(
        &self,
        sweep: &Sweep,
        samples: &[Sample],
    ) -> Vec<([f64; MOST_FREE], f64, f64)> {
        let mut equations = Vec::with_capacity(samples.len());
        let mut sums = vec![([0.0; MOST_FREE], 0.0); self.stations.len()];
        for (k, sample) in samples.iter().enumerate() {
            let bin = self.bin[k];
            let Some(station) = &self.stations[bin] else {
                continue;
            };
            let along = (1.0 + station.slope * station.slope).sqrt();
            let deviation_mm = sample.deviation_mm(&self.placed[k].normal(station.slope));
            let weight = self.weights[k] / (deviation_mm * deviation_mm);
            let by = sweep.changes(&sample.point_mm);
            let by = by.map(|(s, t)| (t - station.slope * s) / along);
            let (sum, all) = &mut sums[bin];
            sum.iter_mut()
                .zip(by)
                .for_each(|(sum, by)| *sum += weight * by);
            *all += weight;
            equations.push((bin, by, self.off[k] * deviation_mm, weight));
        }
        let projected = |(bin, mut by, off, weight): (usize, [f64; MOST_FREE], f64, f64)| {
            let (sum, all) = &sums[bin];
            by.iter_mut()
                .zip(sum)
                .for_each(|(by, sum)| *by -= sum / all);
            (by, off, weight)
        };
        equations.into_iter().map(projected).collect()
    }
}

/// The standard deviation of normal numbers, by the median of their sizes.
pub(super) fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    /// Of normal numbers, their standard deviation to the median of their sizes.
    const OF_MEDIAN: f64 = 1.4826;
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return f64::INFINITY;
    }
    OF_MEDIAN * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}
