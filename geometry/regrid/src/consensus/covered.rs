//! Samples of what lies behind, beneath the surface in front of it.
//!
//! The rays of a column are not parallel. Past an edge that faces away from the middle of the
//! fan they go on outwards, and meet what lies far behind at a y at which the surface in front
//! still has samples. Of two surfaces seen along z the front one hides the other, so the edge
//! runs where the front one's samples end, and what lies beneath them tells nothing of it.

use super::side::Labelled;

/// Spacings between two samples of the front surface, next to each other in a column, within
/// which it is not interrupted. One may be missing.
const GAP: f64 = 2.2;
/// Spacings beyond the last sample of the front surface within which it may go on, in a column
/// that has covered samples.
const BEYOND: f64 = 1.0;

/// Takes out the samples that the other of two surfaces covers; keeps its buffers.
#[derive(Debug, Default)]
pub(super) struct Covered {
    /// Places in the order of their columns and, in these, of y.
    order: Vec<usize>,
    /// Of each place in that order, the `v` of the next samples of the other surface below and
    /// above.
    below: Vec<f64>,
    above: Vec<f64>,
    is_covered: Vec<bool>,
}

impl Covered {
    /// `is_behind` tells of each sample whether it lies behind the other surface.
    pub(super) fn take_out(&mut self, samples: &mut Vec<Labelled>, is_behind: &[bool]) {
        if !is_behind.contains(&true) {
            return;
        }
        self.order.clear();
        self.order.extend(0..samples.len());
        let key = |k: &usize| (samples[*k].strip, samples[*k].v);
        self.order.sort_unstable_by(|k, l| {
            let (k, l) = (key(k), key(l));
            k.0.cmp(&l.0).then(k.1.total_cmp(&l.1))
        });
        self.is_covered.clear();
        self.is_covered.resize(samples.len(), false);
        let mut any = false;
        for column in self
            .order
            .chunk_by(|k, l| samples[*k].strip == samples[*l].strip)
        {
            let next = |next: &mut Vec<f64>, places: &mut dyn Iterator<Item = usize>| {
                next.clear();
                // The last of either surface.
                let mut last = [f64::NAN; 2];
                for k in places {
                    let own = usize::from(samples[k].label > 0.0);
                    next.push(last[1 - own]);
                    last[own] = samples[k].v;
                }
            };
            next(&mut self.below, &mut column.iter().copied());
            next(&mut self.above, &mut column.iter().rev().copied());
            self.above.reverse();
            let behind = || (0..column.len()).filter(|p| is_behind[column[*p]]);
            let between = |p: usize| self.above[p] - self.below[p] <= GAP;
            if !behind().any(between) {
                continue;
            }
            any = true;
            for p in behind() {
                let v = samples[column[p]].v;
                let next_to = v - self.below[p] <= BEYOND || self.above[p] - v <= BEYOND;
                self.is_covered[column[p]] = next_to || between(p);
            }
        }
        if any {
            let mut covered = self.is_covered.iter();
            samples.retain(|_| !covered.next().copied().unwrap_or(false));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::side::SEEN;
    use super::*;

    /// Columns of samples one spacing apart: of the front surface up to `front`, of the back
    /// one from `back` on.
    fn columns(front: f64, back: f64) -> (Vec<Labelled>, Vec<bool>) {
        let (mut samples, mut is_behind) = (Vec::new(), Vec::new());
        for strip in 0..6 {
            let start = 0.37 * strip as f64 % 1.0;
            for row in -8..8 {
                for (label, off) in [(1.0, 0.0), (-1.0, 0.45)] {
                    let v = f64::from(row) + start + off;
                    if if label > 0.0 { v <= front } else { v >= back } {
                        samples.push(Labelled {
                            u: strip as f64 - 2.5,
                            v,
                            label,
                            trust: SEEN,
                            trust_beside: SEEN,
                            strip,
                        });
                        is_behind.push(label < 0.0);
                    }
                }
            }
        }
        (samples, is_behind)
    }

    #[test]
    fn what_lies_beneath_the_front_tells_nothing() {
        let (mut samples, is_behind) = columns(2.0, -3.0);
        let front = samples.iter().filter(|s| s.label > 0.0).count();
        Covered::default().take_out(&mut samples, &is_behind);
        let back: Vec<f64> = samples
            .iter()
            .filter(|s| s.label < 0.0)
            .map(|s| s.v)
            .collect();
        assert_eq!(samples.len() - back.len(), front, "the front stays");
        assert!(back.iter().all(|v| *v > 2.0), "{back:?}");
        assert!(back.iter().any(|v| *v < 3.5), "{back:?}");
    }

    #[test]
    fn what_does_not_overlap_stays() {
        // The last of the front and the first of the back are nearer than a spacing.
        let (mut samples, is_behind) = columns(0.0, 0.1);
        let before = samples.len();
        Covered::default().take_out(&mut samples, &is_behind);
        assert_eq!(samples.len(), before);
    }

    #[test]
    fn what_lies_in_front_is_not_covered() {
        let (mut samples, _) = columns(2.0, -3.0);
        let before = samples.len();
        let nothing = vec![false; before];
        Covered::default().take_out(&mut samples, &nothing);
        assert_eq!(samples.len(), before);
    }
}
