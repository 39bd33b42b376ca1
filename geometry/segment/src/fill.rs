//! Lone masked nodes get a working value, so that dropouts do not tear surfaces apart.

use rayon::prelude::*;

use crate::grid::Grid;

/// Rounds of filling; each closes gaps by what the last has filled.
const ROUNDS: usize = 2;
/// So many of the 8 neighbours must have a value: 3 do along a straight outline.
const LEAST_NEIGHBOURS: usize = 5;

/// z with working values at masked nodes that lie among nodes with values.
///
/// A value is the mean of the two opposite neighbours that differ least, which at a step lie
/// along it. Working values help to see surfaces; they never get a label.
pub(crate) fn filled(grid: &Grid<'_>) -> Vec<f64> {
    let mut z = grid.z_mm.to_vec();
    for _ in 0..ROUNDS {
        let found: Vec<(usize, f64)> = (0..grid.nodes())
            .into_par_iter()
            .filter(|&node| z[node].is_nan())
            .filter_map(|node| Some((node, value(grid, &z, node)?)))
            .collect();
        for (node, value) in found {
            z[node] = value;
        }
    }
    z
}

fn value(grid: &Grid<'_>, z: &[f64], node: usize) -> Option<f64> {
    let (column, row) = grid.column_row(node);
    let at = |c: isize, r: isize| {
        let column = column.checked_add_signed(c).filter(|&c| c < grid.columns)?;
        let row = row.checked_add_signed(r).filter(|&r| r < grid.rows)?;
        let z = z[column * grid.rows + row];
        (!z.is_nan()).then_some(z)
    };
    let mut neighbours = 0;
    let mut best: Option<(f64, f64)> = None;
    for (c, r) in [(1, 0), (0, 1), (1, 1), (1, -1)] {
        let pair = (at(c, r), at(-c, -r));
        neighbours += usize::from(pair.0.is_some()) + usize::from(pair.1.is_some());
        if let (Some(a), Some(b)) = pair {
            let difference = (a - b).abs();
            if best.is_none_or(|(least, _)| difference < least) {
                best = Some((difference, 0.5 * (a + b)));
            }
        }
    }
    best.filter(|_| neighbours >= LEAST_NEIGHBOURS)
        .map(|(_, value)| value)
}
