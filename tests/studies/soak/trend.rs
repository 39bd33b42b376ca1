//! What grows and what does not.

use anyhow::{Result, ensure};

/// What a process takes while nothing is under way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    /// Since the begin.
    pub(crate) at_s: f64,
    /// Resident.
    pub(crate) memory_bytes: u64,
    pub(crate) descriptors: u64,
    pub(crate) threads: u64,
}

/// Samples, oldest first.
#[derive(Debug, Default)]
pub(crate) struct Trend(Vec<Sample>);

/// Descriptors and threads that come and go: the pool for what blocks ends a thread that has had
/// nothing to do for ten seconds. What leaks one a round has leaked more of them in a third.
const COME_AND_GO: u64 = 2;
/// Fewer say nothing about a trend.
const FEWEST: usize = 9;

impl Trend {
    pub(crate) fn add(&mut self, sample: Sample) {
        self.0.push(sample);
    }

    /// Median of the second third of the samples, and of the last; the first third is for
    /// what is made at the first use of anything.
    fn thirds(&self, of: impl Fn(&Sample) -> u64) -> (u64, u64) {
        let third = self.0.len() / 3;
        let median = |samples: &[Sample]| {
            let mut values: Vec<u64> = samples.iter().map(&of).collect();
            values.sort_unstable();
            values.get(values.len() / 2).copied().unwrap_or_default()
        };
        let (_, rest) = self.0.split_at(third);
        let (second, last) = rest.split_at(third);
        (median(second), median(last))
    }

    /// Growth of memory in bytes a second: the slope of the line of least squares through
    /// what follows the first third.
    fn slope(&self) -> f64 {
        let samples = &self.0[self.0.len() / 3..];
        let count = samples.len().max(1) as f64;
        let mean = |of: &dyn Fn(&Sample) -> f64| samples.iter().map(of).sum::<f64>() / count;
        let (time, memory) = (mean(&|s| s.at_s), mean(&|s| s.memory_bytes as f64));
        let (mut along, mut square) = (0.0, 0.0);
        for sample in samples {
            let dt = sample.at_s - time;
            along += dt * (sample.memory_bytes as f64 - memory);
            square += dt * dt;
        }
        if square > 0.0 { along / square } else { 0.0 }
    }

    pub(crate) fn tell(&self) {
        println!(
            "{:<24} {:>12} {:>12}",
            "MEDIAN OF", "SECOND THIRD", "LAST THIRD"
        );
        let (second, last) = self.thirds(|sample| sample.memory_bytes);
        let mb = |bytes: u64| bytes as f64 * 1e-6;
        println!(
            "{:<24} {:>12.2} {:>12.2}",
            "memory, MB",
            mb(second),
            mb(last)
        );
        let (second, last) = self.thirds(|sample| sample.descriptors);
        println!("{:<24} {second:>12} {last:>12}", "descriptors");
        let (second, last) = self.thirds(|sample| sample.threads);
        println!("{:<24} {second:>12} {last:>12}", "threads");
        println!(
            "memory grows by {:.3} MB an hour over {} samples",
            self.slope() * 3_600.0 * 1e-6,
            self.0.len()
        );
    }

    /// Fails for what is not flat.
    pub(crate) fn check(&self, within_mb: f64) -> Result<()> {
        ensure!(
            self.0.len() >= FEWEST,
            "{} rounds are too few to tell a trend: take more --minutes",
            self.0.len()
        );
        let (second, last) = self.thirds(|sample| sample.memory_bytes);
        let growth_mb = (last as f64 - second as f64) * 1e-6;
        ensure!(
            growth_mb <= within_mb,
            "memory grew by {growth_mb:.2} MB, more than {within_mb} MB"
        );
        for (name, (second, last)) in [
            ("descriptors", self.thirds(|sample| sample.descriptors)),
            ("threads", self.thirds(|sample| sample.threads)),
        ] {
            ensure!(
                last <= second + COME_AND_GO,
                "{name} grew from {second} to {last}"
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trend(of: impl Fn(u64) -> Sample) -> Trend {
        Trend((0..30).map(of).collect())
    }

    #[test]
    fn what_grows_is_told_from_what_jitters() {
        let flat = |k: u64| Sample {
            at_s: k as f64,
            memory_bytes: 50_000_000 + k % 3 * 1_000_000 + if k < 8 { 0 } else { 20_000_000 },
            descriptors: 20,
            threads: 9,
        };
        trend(flat).check(2.0).unwrap();
        let leak = |k: u64| Sample {
            memory_bytes: 50_000_000 + k * 300_000,
            ..flat(k)
        };
        let error = trend(leak).check(2.0).unwrap_err();
        assert_eq!(error.to_string(), "memory grew by 3.00 MB, more than 2 MB");
        assert!((trend(leak).slope() - 300_000.0).abs() < 1e-3);
        let busy = |k: u64| Sample {
            threads: 9 + k / 10,
            ..flat(k)
        };
        trend(busy).check(2.0).unwrap();
        let lost = |k: u64| Sample {
            descriptors: 20 + k / 3,
            ..flat(k)
        };
        let error = trend(lost).check(2.0).unwrap_err();
        assert_eq!(error.to_string(), "descriptors grew from 25 to 28");
        assert!(Trend(trend(flat).0[..8].to_vec()).check(2.0).is_err());
    }
}
