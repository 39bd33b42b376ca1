//! Distances in sets of points: how far apart columns are, and points of a cloud.
//!
//! All lengths here are lattice counts.

use crate::gather::Point;

/// Median (the upper one of an even number).
pub(crate) fn median(values: &mut [u32]) -> Option<u32> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable(middle).1)
}

/// The most frequent distance: the median of the values in that window, a tenth wide on
/// either side of a value, that holds most of them; of equal windows the lowest.
pub(crate) fn most_frequent(values: &mut [u32]) -> Option<u32> {
    values.sort_unstable();
    let mut best: &[u32] = &[];
    let mut end = 0;
    for (start, &low) in values.iter().enumerate() {
        // From `low` up to a value whose tenth below and the lowest's tenth above meet.
        let high = f64::from(low) * (1.1 / 0.9);
        while values.get(end).is_some_and(|&v| f64::from(v) <= high) {
            end += 1;
        }
        if end - start > best.len() {
            best = &values[start..end];
        }
    }
    best.get(best.len() / 2).copied()
}

/// Mean distance of the points of a cloud seen along z: the square root of the area they
/// cover per point. At least 1.
///
/// The area is that of the square cells with a point in them; the cells are three mean
/// distances wide, found by repetition from the bounding box's area.
pub(crate) fn mean_distance(points: &[Point]) -> f64 {
    let (width, height) = extent(points);
    let number = points.len().max(1) as f64;
    if width == 0 || height == 0 {
        return (f64::from(width.max(height)) / number).max(1.0);
    }
    let mut distance = (f64::from(width) * f64::from(height) / number).sqrt();
    let mut cells: Vec<(i32, i32)> = Vec::with_capacity(points.len());
    for _ in 0..5 {
        let cell = (3.0 * distance).max(1.0);
        let index = |coordinate: i32| (f64::from(coordinate) / cell).floor() as i32;
        cells.clear();
        cells.extend(points.iter().map(|p| (index(p.x), index(p.y))));
        cells.sort_unstable();
        cells.dedup();
        distance = (cells.len() as f64 * cell * cell / number).sqrt();
    }
    distance.max(1.0)
}

/// Extent in x and y.
pub(crate) fn extent(points: &[Point]) -> (u32, u32) {
    let range = |value: fn(&Point) -> i32| {
        let low = points.iter().map(value).min().unwrap_or(0);
        let high = points.iter().map(value).max().unwrap_or(0);
        high.abs_diff(low)
    };
    (range(|p| p.x), range(|p| p.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_frequent_distance_tolerates_jitter_and_gaps() {
        let mut gaps = vec![2000, 98, 100, 101, 103, 99, 300, 301, 302, 200, 100];
        assert_eq!(most_frequent(&mut gaps), Some(100));
        assert_eq!(most_frequent(&mut []), None);
        assert_eq!(most_frequent(&mut [7]), Some(7));
    }

    #[test]
    fn median_of_an_even_number_is_the_upper_one() {
        assert_eq!(median(&mut [4, 1, 3, 2]), Some(3));
        assert_eq!(median(&mut []), None);
    }
}
