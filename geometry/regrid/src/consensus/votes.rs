//! Who is around a sample.

use super::side::Labelled;

/// Samples by the square cells that they lie in, each as wide as votes reach.
#[derive(Debug)]
pub(super) struct Cells<'a> {
    samples: &'a [Labelled],
    reach: f64,
    low: [f64; 2],
    cells: [usize; 2],
    /// Where the samples of each cell begin in `order`; one more for the end.
    starts: Vec<u32>,
    order: Vec<u32>,
}

/// Cells along an axis: no more, however far samples lie apart, as far ones share the last.
const MOST: usize = 64;

impl<'a> Cells<'a> {
    /// `reach` is positive.
    pub(super) fn of(samples: &'a [Labelled], reach: f64) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for s in samples {
            for (axis, at) in [s.u, s.v].into_iter().enumerate() {
                low[axis] = low[axis].min(at);
                high[axis] = high[axis].max(at);
            }
        }
        let number = |axis: usize| (((high[axis] - low[axis]) / reach) as usize + 1).min(MOST);
        let mut own = Self {
            samples,
            reach,
            low,
            cells: [number(0), number(1)],
            starts: Vec::new(),
            order: vec![0; samples.len()],
        };
        own.starts.resize(own.cells[0] * own.cells[1] + 1, 0);
        for s in samples {
            let [u, v] = own.cell(s);
            own.starts[u * own.cells[1] + v] += 1;
        }
        // Each start is where the samples of its cell end until they are put there, last first.
        let mut all = 0;
        for start in &mut own.starts {
            all += *start;
            *start = all;
        }
        for (index, s) in (0_u32..).zip(samples) {
            let [u, v] = own.cell(s);
            let start = &mut own.starts[u * own.cells[1] + v];
            *start -= 1;
            own.order[*start as usize] = index;
        }
        own
    }

    fn cell(&self, s: &Labelled) -> [usize; 2] {
        let along = |at: f64, axis: usize| {
            (((at - self.low[axis]) / self.reach) as usize).min(self.cells[axis] - 1)
        };
        [along(s.u, 0), along(s.v, 1)]
    }

    /// How many samples of other columns within reach have the same label, and how many another.
    pub(super) fn around(&self, s: &Labelled) -> [usize; 2] {
        let [u, v] = self.cell(s);
        let mut votes = [0; 2];
        for row in u.saturating_sub(1)..=(u + 1).min(self.cells[0] - 1) {
            let first = row * self.cells[1] + v.saturating_sub(1);
            let last = row * self.cells[1] + (v + 1).min(self.cells[1] - 1);
            let range = self.starts[first] as usize..self.starts[last + 1] as usize;
            for index in &self.order[range] {
                let other = &self.samples[*index as usize];
                let (du, dv) = (other.u - s.u, other.v - s.v);
                if other.strip != s.strip && du * du + dv * dv <= self.reach * self.reach {
                    votes[usize::from(other.label != s.label)] += 1;
                }
            }
        }
        votes
    }
}

#[cfg(test)]
mod tests {
    use super::super::side::tests::grid;
    use super::*;

    #[test]
    fn they_are_those_that_are_found_one_by_one() {
        for (radius, reach) in [(3.0, 2.0), (9.0, 2.0), (16.0, 0.4), (40.0, 0.3)] {
            let samples = grid(radius, |v| 0.3 * v);
            let cells = Cells::of(&samples, reach);
            for s in samples.iter().step_by(7) {
                let mut votes = [0; 2];
                for other in samples.iter().filter(|o| o.strip != s.strip) {
                    let (du, dv) = (other.u - s.u, other.v - s.v);
                    if du * du + dv * dv <= reach * reach {
                        votes[usize::from(other.label != s.label)] += 1;
                    }
                }
                assert_eq!(cells.around(s), votes, "{radius} {reach} {s:?}");
            }
        }
    }

    #[test]
    fn none_and_one_are_no_trouble() {
        let samples = grid(1.0, |_| 0.0);
        assert_eq!(Cells::of(&samples[..1], 2.0).around(&samples[0]), [0, 0]);
        assert_eq!(Cells::of(&[], 2.0).order.len(), 0);
    }
}
