//! The least median of squared residuals over all triples of a window.

use crate::neighbours::Neighbour;
use crate::plane::{Fit, Plane, tolerance};

/// Samples of which two are as good as one point, or three as good as on one line, give no
/// plane.
const LEAST_SINE: f64 = 1e-7;

/// The plane with the least median of squared residuals among those through three samples
/// of the window, each shifted in z to where its median is least. The median is the
/// `floor((n + 1) / 2)`-th square of `n`. Of equal planes the first is taken, triples in the
/// order of their indices. `None` when all samples are collinear.
///
/// The time it takes grows with the fourth power of the window. What it finds is what
/// `lqs(method = "lms", nsamp = "exact")` of the R package MASS finds.
pub(crate) fn least_median(window: &[Neighbour], residuals: &mut Vec<f64>) -> Option<Fit> {
    let number = window.len();
    let half = number.div_ceil(2);
    let mut best: Option<(f64, Plane)> = None;
    for (k, p) in window.iter().enumerate() {
        for (l, q) in window.iter().enumerate().skip(k + 1) {
            for r in window.iter().skip(l + 1) {
                let Some(plane) = Plane::through(p, q, r, LEAST_SINE) else {
                    continue;
                };
                residuals.clear();
                residuals.extend(window.iter().map(|n| plane.residual(n)));
                let (radius, middle) = shortest_half(residuals, half);
                if best.is_none_or(|(least, _)| radius < least) {
                    let c = plane.c + middle;
                    best = Some((radius, Plane { c, ..plane }));
                }
            }
        }
    }
    let (radius, plane) = best?;
    Some(Fit {
        plane,
        tolerance: tolerance(radius * radius, number),
    })
}

/// Half the length and the middle of the shortest interval that holds this many values.
fn shortest_half(values: &mut [f64], number: usize) -> (f64, f64) {
    values.sort_unstable_by(f64::total_cmp);
    let mut shortest = (f64::INFINITY, 0.0);
    for some in values.windows(number.max(1)) {
        if let [low, .., high] = some
            && high - low < shortest.0
        {
            shortest = (high - low, 0.5 * (low + high));
        }
    }
    (0.5 * shortest.0, shortest.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Windows and what R made of them: `tests/data/lqs.R` tells how.
    const WINDOWS: &str = include_str!("../tests/data/lqs-windows.csv");
    const PLANES: &str = include_str!("../tests/data/lqs-planes.csv");

    fn rows(text: &str) -> impl Iterator<Item = Vec<f64>> {
        let numbers = |line: &str| line.split(',').map(|n| n.parse().unwrap()).collect();
        text.lines().skip(1).map(numbers)
    }

    #[test]
    fn it_equals_lqs_of_mass_on_200_windows() {
        let samples: Vec<Vec<f64>> = rows(WINDOWS).collect();
        let mut compared = 0;
        for row in rows(PLANES) {
            let [number, a, b, c, criterion] = row[..] else {
                panic!("five numbers a row");
            };
            let window: Vec<Neighbour> = samples
                .iter()
                .filter(|s| s[0] == number)
                .map(|s| Neighbour::at(s[1], s[2], s[3]))
                .collect();
            assert!(window.len() >= 9);
            let fit = least_median(&window, &mut Vec::new()).unwrap();
            for (ours, theirs) in [(fit.plane.a, a), (fit.plane.b, b), (fit.plane.c, c)] {
                let error = (ours - theirs).abs() / (1.0 + theirs.abs());
                assert!(error < 1e-9, "window {number}: {fit:?}, {row:?}");
            }
            let expected = tolerance(criterion, window.len());
            assert!((fit.tolerance / expected - 1.0).abs() < 1e-9);
            compared += 1;
        }
        assert_eq!(compared, 200);
    }

    #[test]
    fn the_shortest_half_is_found() {
        assert_eq!(
            shortest_half(&mut [9.0, 1.0, 4.0, 3.0, 20.0], 3),
            (1.5, 2.5)
        );
        let collinear: Vec<Neighbour> = (0..8)
            .map(|k| Neighbour::at(f64::from(k), 2.0 * f64::from(k), 1.0))
            .collect();
        assert!(least_median(&collinear, &mut Vec::new()).is_none());
    }
}
