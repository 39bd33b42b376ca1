//! The mean of all lines that lie between two sets of samples.

/// How far from the line that is known others are looked at, spacings.
const OFFSET: f64 = 4.0;
/// Greatest slope of those lines against it.
const SLOPE: f64 = 0.5;

/// Offset and slope of a line.
type Vertex = [f64; 2];

/// Lines `across = offset + slope * along`, all those that have left so far every sample on
/// its own side: a convex polygon of offsets and slopes, since each sample cuts it by a
/// straight line.
#[derive(Debug, Default)]
pub(crate) struct Between {
    corners: Vec<Vertex>,
    cut: Vec<Vertex>,
}

impl Between {
    /// Begins with all lines near `across = 0`.
    pub(crate) fn begin(&mut self) {
        self.corners.clear();
        self.corners.extend([
            [-OFFSET, -SLOPE],
            [OFFSET, -SLOPE],
            [OFFSET, SLOPE],
            [-OFFSET, SLOPE],
        ]);
    }

    /// Keeps the lines that leave this sample above them, where `side` is positive, or below.
    pub(crate) fn keep(&mut self, along: f64, across: f64, side: f64) {
        let room = |corner: &Vertex| side * (across - corner[0] - corner[1] * along);
        if self.corners.iter().all(|corner| room(corner) >= 0.0) {
            return;
        }
        self.cut.clear();
        for (k, corner) in self.corners.iter().enumerate() {
            let next = &self.corners[(k + 1) % self.corners.len()];
            let (here, there) = (room(corner), room(next));
            if here >= 0.0 {
                self.cut.push(*corner);
            }
            if (here < 0.0) != (there < 0.0) {
                let share = here / (here - there);
                self.cut
                    .push([0, 1].map(|i| corner[i] + share * (next[i] - corner[i])));
            }
        }
        core::mem::swap(&mut self.corners, &mut self.cut);
    }

    /// Offset and slope of the mean of the lines left; `None` where there is none.
    pub(crate) fn mean(&self) -> Option<Vertex> {
        let (first, rest) = self.corners.split_first()?;
        let (mut area, mut sum) = (0.0, [0.0; 2]);
        for pair in rest.windows(2) {
            let [p, q] = [0, 1].map(|k| [0, 1].map(|i| pair[k][i] - first[i]));
            let twice = p[0] * q[1] - p[1] * q[0];
            area += twice;
            for i in 0..2 {
                sum[i] += twice * (p[i] + q[i]) / 3.0;
            }
        }
        (area > 0.0).then(|| [0, 1].map(|i| first[i] + sum[i] / area))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_rows_leave_the_lines_between_them() {
        let mut between = Between::default();
        between.begin();
        for along in [-10.0, -2.0, 3.0, 10.0] {
            between.keep(along, 0.5, 1.0);
            between.keep(along, -0.1, -1.0);
        }
        let [offset, slope] = between.mean().unwrap();
        assert!((offset - 0.2).abs() < 1e-12 && slope.abs() < 1e-12);
    }

    #[test]
    fn the_mean_is_that_of_the_polygon() {
        // Lines through (0, 0..1) below (1, 1): offset at least 0, offset + slope at most 1,
        // slope at least -0.5: a triangle of 1.5 by 1.5 less its part with slopes above 0.5.
        let mut between = Between::default();
        between.begin();
        between.keep(0.0, 0.0, -1.0);
        between.keep(1.0, 1.0, 1.0);
        let (whole, part) = (1.5 * 1.5 / 2.0, 0.5 * 0.5 / 2.0);
        let offset = (whole * 0.5 - part * 0.5 / 3.0) / (whole - part);
        let slope = (whole * 0.0 - part * (0.5 + 0.5 / 3.0)) / (whole - part);
        let mean = between.mean().unwrap();
        assert!((mean[0] - offset).abs() < 1e-12 && (mean[1] - slope).abs() < 1e-12);
    }

    #[test]
    fn no_line_separates_what_is_mixed() {
        let mut between = Between::default();
        between.begin();
        between.keep(0.0, 0.2, -1.0);
        between.keep(0.0, 0.1, 1.0);
        assert_eq!(between.mean(), None);
    }
}
