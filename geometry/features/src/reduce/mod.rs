//! Fewer points (Jun & Park, section 4.2): vector sampling, and sampling by rate. Edge points are
//! never removed.

/// What is removed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reduction {
    /// Vector sampling: the distance bound delta, millimetres, and the angle bound theta, radians.
    pub vector: Option<(f64, f64)>,
    /// Sampling by rate: of what vector sampling leaves, every point goes whose number is a multiple
    /// of this. 1 removes all but edge points.
    pub rate: Option<usize>,
}

/// Which points of each line stay, by vector sampling along each, then by rate over all lines, whose
/// points are numbered through from 1.
///
/// `lines` are scan lines of [x, y, z], millimetres; `is_edge` says of each point whether it is an
/// edge point; missing ones are none.
#[must_use]
pub fn reduced(
    lines: &[Vec<[f64; 3]>],
    is_edge: &[Vec<bool>],
    reduction: &Reduction,
) -> Vec<Vec<bool>> {
    let none = Vec::new();
    let edges = |k: usize| is_edge.get(k).unwrap_or(&none).as_slice();
    let by_vectors = |(k, line): (usize, &Vec<[f64; 3]>)| match reduction.vector {
        Some((distance_mm, angle)) => vector_sampling(line, edges(k), distance_mm, angle),
        None => vec![true; line.len()],
    };
    let mut kept: Vec<Vec<bool>> = lines.iter().enumerate().map(by_vectors).collect();
    if let Some(rate) = reduction.rate {
        let mut number = 0_usize;
        for (k, line) in kept.iter_mut().enumerate() {
            sampling_by_rate(line, edges(k), rate, &mut number);
        }
    }
    kept
}

/// Which points of one line stay: of three successive points a, b, c, b goes where the angle between
/// b - a and c - a is under the bound (radians), unless it is an edge point or lies farther than
/// `distance_mm` from the last point that stayed. The first and the last stay.
///
/// Successive are points of the line as measured, whether they stay or not.
#[must_use]
pub fn vector_sampling(
    line: &[[f64; 3]],
    is_edge: &[bool],
    distance_mm: f64,
    angle: f64,
) -> Vec<bool> {
    let mut kept = vec![true; line.len()];
    let Some(&first) = line.first() else {
        return kept;
    };
    let mut last = first;
    let bound = libm::cos(angle.clamp(0.0, core::f64::consts::PI));
    for k in 1..line.len().saturating_sub(1) {
        let (a, b, c) = (line[k - 1], line[k], line[k + 1]);
        let (v1, v2) = (minus(b, a), minus(c, a));
        let lengths = libm::sqrt(dot(v1, v1) * dot(v2, v2));
        // Where a point comes twice there is no angle, and nothing is lost.
        let is_straight = lengths == 0.0 || dot(v1, v2) > bound * lengths;
        let off = minus(b, last);
        let is_near = dot(off, off) <= distance_mm * distance_mm;
        let is_edge = is_edge.get(k).copied().unwrap_or(false);
        kept[k] = is_edge || !(is_straight && is_near);
        if kept[k] {
            last = b;
        }
    }
    kept
}

/// Drops every point whose number is a multiple of `rate`, but edge points. `number` goes on from
/// line to line; only points that are still there count. A rate of 0 drops nothing.
pub fn sampling_by_rate(kept: &mut [bool], is_edge: &[bool], rate: usize, number: &mut usize) {
    if rate == 0 {
        return;
    }
    for (k, own) in kept.iter_mut().enumerate().filter(|(_, own)| **own) {
        *number += 1;
        let is_edge = is_edge.get(k).copied().unwrap_or(false);
        *own = is_edge || !number.is_multiple_of(rate);
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEGREES_30: f64 = core::f64::consts::FRAC_PI_6;

    fn level(count: usize, pitch: f64) -> Vec<[f64; 3]> {
        (0..count).map(|k| [1.0, k as f64 * pitch, 2.0]).collect()
    }

    fn indices(kept: &[bool]) -> Vec<usize> {
        (0..kept.len()).filter(|&k| kept[k]).collect()
    }

    /// At 0.25 mm, the first point farther than 0.9 mm from the last that stayed is the fourth.
    #[test]
    fn a_straight_line_is_thinned_to_the_distance() {
        let kept = vector_sampling(&level(14, 0.25), &[], 0.9, DEGREES_30);
        assert_eq!(indices(&kept), [0, 4, 8, 12, 13]);
        let kept = vector_sampling(&level(7, 1.0), &[], 0.9, DEGREES_30);
        assert_eq!(indices(&kept).len(), 7);
        // A bound that is met just so is not passed.
        let kept = vector_sampling(&level(7, 0.5), &[], 1.0, DEGREES_30);
        assert_eq!(indices(&kept), [0, 3, 6]);
    }

    /// The angle is at the first of the three: b stays at (0, 0), (1, 0), (1, h) where atan h is
    /// greater than the bound.
    #[test]
    fn the_angle_is_seen_from_the_first_point() {
        for (h, stays) in [(0.57, false), (0.58, true), (-0.57, false), (-0.58, true)] {
            let line = [[0.0; 3], [0.0, 1.0, 0.0], [0.0, 1.0, h]];
            let kept = vector_sampling(&line, &[], 10.0, DEGREES_30);
            assert_eq!(kept, [true, stays, true], "{h}");
        }
        // Going back is an angle of 180 degrees.
        let back = [[0.0; 3], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]];
        assert_eq!(vector_sampling(&back, &[], 10.0, DEGREES_30), [true; 3]);
    }

    #[test]
    fn edge_points_stay_whatever_is_asked_for() {
        let line = level(9, 0.1);
        let mut edges = vec![false; 9];
        edges[5] = true;
        let kept = vector_sampling(&line, &edges, 10.0, DEGREES_30);
        assert_eq!(indices(&kept), [0, 5, 8]);
        let all = Reduction {
            vector: Some((10.0, DEGREES_30)),
            rate: Some(1),
        };
        let kept = reduced(&[line.clone(), line], &[edges], &all);
        assert_eq!(indices(&kept[0]), [5]);
        assert!(indices(&kept[1]).is_empty());
    }

    /// Numbers go on from line to line.
    #[test]
    fn every_nth_goes() {
        let by_rate = |rate: usize| Reduction {
            vector: None,
            rate: Some(rate),
        };
        let lines = [level(5, 1.0), level(4, 1.0)];
        let kept = reduced(&lines, &[], &by_rate(2));
        assert_eq!(indices(&kept[0]), [0, 2, 4]);
        assert_eq!(indices(&kept[1]), [1, 3]);
        let kept = reduced(&lines, &[], &by_rate(3));
        assert_eq!(indices(&kept[0]), [0, 1, 3, 4]);
        assert_eq!(indices(&kept[1]), [1, 2]);
        assert_eq!(indices(&reduced(&lines, &[], &by_rate(0))[0]).len(), 5);
    }

    #[test]
    fn short_lines_and_points_that_come_twice_are_no_trouble() {
        assert!(vector_sampling(&[], &[], 0.9, DEGREES_30).is_empty());
        assert_eq!(
            vector_sampling(&level(2, 0.1), &[], 0.9, DEGREES_30),
            [true; 2]
        );
        let twice = [[0.0; 3], [0.0; 3], [0.0, 0.1, 0.0]];
        assert_eq!(
            vector_sampling(&twice, &[], 0.9, DEGREES_30),
            [true, false, true]
        );
    }
}
