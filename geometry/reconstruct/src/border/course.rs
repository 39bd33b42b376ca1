//! Places beside a path.

use nurbs::PiecewiseCubic;

use crate::polygon::{cross, dot, minus, norm};

/// Chords by which a piece is replaced to find the nearest place of it; each is at most so
/// long, pitches.
const CHORD: f64 = 0.5;

/// A path as chords, with the parameters of their ends.
pub(crate) struct Course {
    chords: Vec<(f64, [f64; 2])>,
    /// Lengths of the bundles.
    reaches: Vec<f64>,
}

/// Chords that are looked at together, or not at all where all of them are too far away.
const BUNDLE: usize = 16;

impl Course {
    pub(crate) fn of(path: &PiecewiseCubic<2>) -> Self {
        let mut chords = vec![(path.domain().0, path.start())];
        for k in 0..path.pieces.len() {
            let width = path.breaks[k + 1] - path.breaks[k];
            let straight = path.pieces[k].iter().all(|c| c[2] == 0.0 && c[3] == 0.0);
            let count = if straight {
                1
            } else {
                (width / CHORD).ceil().clamp(1.0, 1e5) as usize
            };
            for p in 1..=count {
                let at = width * p as f64 / count as f64;
                chords.push((path.breaks[k] + at, path.piece_value(k, at, 0)));
            }
        }
        let reaches = (0..chords.len() - 1).step_by(BUNDLE).map(|from| {
            let bundle = &chords[from..=(from + BUNDLE).min(chords.len() - 1)];
            let lengths = bundle
                .windows(2)
                .map(|pair| norm(minus(pair[1].1, pair[0].1)));
            lengths.sum()
        });
        Self {
            reaches: reaches.collect(),
            chords,
        }
    }

    /// The two ends of each chord.
    pub(crate) fn chords(&self) -> impl Iterator<Item = [[f64; 2]; 2]> {
        self.chords.windows(2).map(|pair| [pair[0].1, pair[1].1])
    }

    /// The parameter at which the path is nearest to a point, and how far to the left of it
    /// the point lies. `None` when it is farther away than `near`, pitches.
    pub(crate) fn place(
        &self,
        path: &PiecewiseCubic<2>,
        point: [f64; 2],
        near: f64,
    ) -> Option<(f64, f64)> {
        let mut best = (near, None);
        let mut bundle = 0;
        while bundle + 1 < self.chords.len() {
            let end = (bundle + BUNDLE).min(self.chords.len() - 1);
            let reach = self.reaches[bundle / BUNDLE];
            if norm(minus(point, self.chords[bundle].1)) <= reach + near {
                for pair in self.chords[bundle..=end].windows(2) {
                    let ((from, a), (to, b)) = (pair[0], pair[1]);
                    let along = minus(b, a);
                    let share = (dot(minus(point, a), along) / dot(along, along)).clamp(0.0, 1.0);
                    let off = norm(minus(point, [0, 1].map(|d| a[d] + share * along[d])));
                    if off < best.0 {
                        best = (off, Some(from + share * (to - from)));
                    }
                }
            }
            bundle = end;
        }
        let at = best.1?;
        let tangent = path.derivative(at, 1);
        let left = cross(tangent, minus(point, path.evaluate(at))) / norm(tangent);
        Some((at, left))
    }
}
