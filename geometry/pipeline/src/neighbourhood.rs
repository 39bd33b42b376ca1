//! What the nodes around a place say of it.

use range_image::{RangeImage, RegionMap};

/// Depths are told up to this.
pub(crate) const DEEPEST: u8 = 2;

/// How far the node lies from the border of its region, in nodes, as far as [`DEEPEST`]: 0
/// where one of its eight neighbours is of another region or none.
pub(crate) fn depth(regions: &RegionMap, column: usize, row: usize) -> u8 {
    let label = regions.label(column, row);
    let all_own = |far: usize| {
        let columns = column.checked_sub(far).map(|first| first..=column + far);
        let rows = row.checked_sub(far).map(|first| first..=row + far);
        columns.zip(rows).is_some_and(|(columns, rows)| {
            columns.clone().all(|c| {
                rows.clone().all(|r| {
                    c < regions.columns() && r < regions.rows() && regions.label(c, r) == label
                })
            })
        })
    };
    (1..=DEEPEST)
        .take_while(|&far| all_own(usize::from(far)))
        .last()
        .unwrap_or(0)
}

/// How steeply z rises along x and y on the surface of a node's own region.
pub(crate) fn rise(image: &RangeImage, regions: &RegionMap, column: usize, row: usize) -> [f64; 2] {
    let label = regions.label(column, row);
    let z_mm = |c: Option<usize>, r: Option<usize>| {
        let (c, r) = (c?, r?);
        let own = c < image.columns() && r < image.rows() && regions.label(c, r) == label;
        if own { image.z_mm(c, r) } else { None }
    };
    let between = |low: Option<f64>, high: Option<f64>| match (low, high) {
        (Some(low), Some(high)) => (high - low) / (2.0 * image.pitch_mm()),
        _ => 0.0,
    };
    [
        between(
            z_mm(column.checked_sub(1), Some(row)),
            z_mm(Some(column + 1), Some(row)),
        ),
        between(
            z_mm(Some(column), row.checked_sub(1)),
            z_mm(Some(column), Some(row + 1)),
        ),
    ]
}
