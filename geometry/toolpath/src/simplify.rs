//! Lines with few corners.

/// The corners of a line that are needed for it to stay within a tolerance of all of them (Ramer 1972,
/// Douglas & Peucker 1973).
pub(crate) fn simplified(corners: &[[f64; 2]], tolerance_mm: f64) -> Vec<[f64; 2]> {
    let mut keep = vec![false; corners.len()];
    let mut open = vec![(0, corners.len().saturating_sub(1))];
    while let Some((from, to)) = open.pop() {
        let (Some(&a), Some(&b)) = (corners.get(from), corners.get(to)) else {
            continue;
        };
        (keep[from], keep[to]) = (true, true);
        let along = [b[0] - a[0], b[1] - a[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        let off = |p: [f64; 2]| {
            let way = [p[0] - a[0], p[1] - a[1]];
            let share = if square > 0.0 {
                ((way[0] * along[0] + way[1] * along[1]) / square).clamp(0.0, 1.0)
            } else {
                0.0
            };
            libm::hypot(way[0] - share * along[0], way[1] - share * along[1])
        };
        let worst = (from + 1..to)
            .map(|k| (k, off(corners[k])))
            .fold((0, 0.0), |m, n| if n.1 > m.1 { n } else { m });
        if worst.1 > tolerance_mm {
            open.push((worst.0, to));
            open.push((from, worst.0));
        }
    }
    let kept = corners.iter().zip(&keep).filter(|(_, keep)| **keep);
    kept.map(|(corner, _)| *corner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_parts_lose_their_corners_and_bends_keep_them() {
        let mut line: Vec<[f64; 2]> = (0..=10).map(|k| [f64::from(k), 0.0]).collect();
        line[4][1] = 0.009;
        line.extend((1..=10).map(|k| [10.0, f64::from(k)]));
        // There and back: the far end is kept though both ends are the same.
        line.extend((0..10).rev().map(|k| [10.0, f64::from(k)]));
        let few = simplified(&line, 0.01);
        assert_eq!(few, [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [10.0, 0.0]]);
        assert_eq!(simplified(&line, 0.001).len(), 7);
        assert_eq!(simplified(&[], 0.01), Vec::<[f64; 2]>::new());
        assert_eq!(simplified(&[[1.0, 2.0]], 0.01), [[1.0, 2.0]]);
    }
}
