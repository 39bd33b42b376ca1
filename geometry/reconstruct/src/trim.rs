//! Which nodes lie inside a trimmed face.

use nurbs::PiecewiseCubic;

/// A face's loops as polygons in pitches, ready to be asked column by column.
pub(crate) struct Trim {
    segments: Vec<[[f64; 2]; 2]>,
}

/// Greatest length of a chord by which a curve is replaced, in units of its parameter.
const CHORD: f64 = 0.25;

impl Trim {
    /// From the parameter curves of each loop; `to_pitches` maps millimetres to pitches with node
    /// `(column, row)` at `(column, row)`. A curve begins where the one before it ends, whatever
    /// digits its own start has: in a gap between them a column would cross the loop once only.
    pub(crate) fn new<'a, L>(
        loops: impl IntoIterator<Item = L>,
        pitch_mm: f64,
        to_pitches: impl Fn([f64; 2]) -> [f64; 2],
    ) -> Self
    where
        L: Iterator<Item = &'a PiecewiseCubic<2>>,
    {
        let mut segments = Vec::new();
        for curves in loops {
            let mut points: Vec<[f64; 2]> = Vec::new();
            for curve in curves {
                for k in 0..curve.pieces.len() {
                    let width = curve.breaks[k + 1] - curve.breaks[k];
                    let straight = curve.pieces[k].iter().all(|c| c[2] == 0.0 && c[3] == 0.0);
                    let chords = if straight {
                        1.0
                    } else {
                        (width / pitch_mm / CHORD).ceil()
                    };
                    let count = chords.clamp(1.0, 1e5) as usize;
                    let at = |p: usize| width * p as f64 / count as f64;
                    points.extend((1..=count).map(|p| to_pitches(curve.piece_value(k, at(p), 0))));
                }
            }
            if let Some(&last) = points.last() {
                let before = core::iter::once(&last).chain(&points);
                segments.extend(before.zip(&points).map(|(from, to)| [*from, *to]));
            }
        }
        Self { segments }
    }

    /// Calls `visit(column, row)` for each node inside, by even and odd crossings along
    /// each column.
    pub(crate) fn nodes(&self, columns: usize, rows: usize, mut visit: impl FnMut(usize, usize)) {
        self.spans(columns, |column, low, high| {
            let first = low.ceil().max(0.0) as usize;
            let end = (high.ceil().max(0.0) as usize).min(rows);
            for row in first..end {
                visit(column, row);
            }
        });
    }

    /// Area inside in square pitches, each place counted with its weight: one strip for
    /// each column, cut into pieces of at most a pitch.
    pub(crate) fn area(&self, columns: usize, weight: impl Fn(f64, f64) -> f64) -> f64 {
        let mut area = 0.0;
        self.spans(columns, |column, low, high| {
            let count = (high - low).ceil().max(1.0);
            let width = (high - low) / count;
            for k in 0..count as usize {
                area += width * weight(column as f64, low + (k as f64 + 0.5) * width);
            }
        });
        area
    }

    /// Calls `visit(column, low, high)` for each stretch of each column that lies inside.
    fn spans(&self, columns: usize, mut visit: impl FnMut(usize, f64, f64)) {
        let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); columns];
        for [a, b] in &self.segments {
            let (a, b) = if a[0] <= b[0] { (a, b) } else { (b, a) };
            // Half-open, so that a corner on a column counts once.
            let first = a[0].ceil().max(0.0) as usize;
            let end = (b[0].ceil().max(0.0) as usize).min(columns);
            for (column, found) in crossings.iter_mut().enumerate().take(end).skip(first) {
                let t = (column as f64 - a[0]) / (b[0] - a[0]);
                found.push(a[1] + t * (b[1] - a[1]));
            }
        }
        for (column, mut found) in crossings.into_iter().enumerate() {
            found.sort_by(f64::total_cmp);
            for pair in found.chunks_exact(2) {
                visit(column, pair[0], pair[1]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ends of curves that meet in a corner are computed, each in its own way.
    #[test]
    fn a_column_through_a_corner_is_not_lost() {
        let line = |from: [f64; 2], to: [f64; 2]| PiecewiseCubic::line(from, to, 1.0).unwrap();
        for (end, start) in [(-1e-12, 1e-12), (1e-12, -1e-12), (0.0, 0.0)] {
            let curves = [
                line([0.3, 0.4], [3.0 + end, 6.3]),
                line([3.0 + start, 6.3], [6.4, 0.4]),
                line([6.4, 0.4], [0.3, 0.4]),
            ];
            let trim = Trim::new([curves.iter()], 1.0, |p| p);
            let mut inside = [0; 7];
            trim.nodes(7, 7, |column, _| inside[column] += 1);
            assert_eq!(inside, [0, 1, 4, 6, 4, 2, 1], "{end} {start}");
            let area = trim.area(7, |_, _| 1.0);
            assert!((area / (0.5 * 6.1 * 5.9) - 1.0).abs() < 0.05, "{area}");
        }
    }

    #[test]
    fn a_ring_holds_the_nodes_between_its_circles() {
        let circle = |radius: f64| {
            let quarters = (0..4).map(|q| {
                let points = [0.0, 1.0, 2.0, 3.0].map(|k: f64| {
                    let angle = (f64::from(q) + k / 3.0) * core::f64::consts::FRAC_PI_2;
                    let (sin, cos) = libm::sincos(angle);
                    [10.3 + radius * cos, 10.2 + radius * sin]
                });
                let length = radius * core::f64::consts::FRAC_PI_2;
                PiecewiseCubic::through_thirds(0.0, length, &points).unwrap()
            });
            quarters.collect::<Vec<_>>()
        };
        let loops = [circle(8.0), circle(3.0)];
        let trim = Trim::new(loops.iter().map(|curves| curves.iter()), 1.0, |p| p);
        let mut inside = vec![false; 21 * 21];
        trim.nodes(21, 21, |column, row| inside[column * 21 + row] = true);
        let area = trim.area(21, |_, _| 2.0);
        let expected = 2.0 * core::f64::consts::PI * (64.0 - 9.0);
        assert!((area / expected - 1.0).abs() < 0.005, "{area} {expected}");
        for column in 0..21 {
            for row in 0..21 {
                let (x, y) = (column as f64 - 10.3, row as f64 - 10.2);
                let radius = (x * x + y * y).sqrt();
                if (radius - 8.0).abs() > 0.1 && (radius - 3.0).abs() > 0.1 {
                    assert_eq!(inside[column * 21 + row], radius < 8.0 && radius > 3.0);
                }
            }
        }
    }
}
