//! Edge points of a whole scan: along its columns, and across them.

use super::{EdgeKind, EdgeSettings, edges};

/// Edge points of columns of [x, y, z], millimetres, along each column and across the columns: for
/// each point what edge it is, if any; sharp where one direction says so.
///
/// Columns come in the order of x, their points in that of y. Across, every column gives to each row,
/// `pitch_mm` apart, its point that is nearest, no farther than half of that.
#[must_use]
pub fn edges_of_columns(
    columns: &[Vec<[f64; 3]>],
    pitch_mm: f64,
    settings: &EdgeSettings,
) -> Vec<Vec<Option<EdgeKind>>> {
    let along = columns.iter().map(|column| {
        let line: Vec<[f64; 2]> = column.iter().map(|&[_, y, z]| [y, z]).collect();
        edges(&line, settings)
    });
    let mut found: Vec<Vec<Option<EdgeKind>>> = along.collect();
    for row in rows(columns, pitch_mm) {
        let point = |&(column, k): &(usize, usize)| {
            let [x, _, z] = columns[column][k];
            [x, z]
        };
        let line: Vec<[f64; 2]> = row.iter().map(point).collect();
        for (&(column, k), kind) in row.iter().zip(edges(&line, settings)) {
            let own = &mut found[column][k];
            *own = match (*own, kind) {
                (Some(EdgeKind::Sharp), _) | (_, Some(EdgeKind::Sharp)) => Some(EdgeKind::Sharp),
                (own, kind) => own.or(kind),
            };
        }
    }
    found
}

/// Most rows; of a pitch too fine for that there are none.
const MOST_ROWS: f64 = 1e6;

/// Points across the columns, as (column, point).
fn rows(columns: &[Vec<[f64; 3]>], pitch_mm: f64) -> Vec<Vec<(usize, usize)>> {
    let heights = columns.iter().flatten().map(|own| own[1]);
    let finite = heights.filter(|y| y.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
        (low.min(y), high.max(y))
    });
    let count = (high - low) / pitch_mm + 1.0;
    if !(1.0..=MOST_ROWS).contains(&count) {
        return Vec::new();
    }
    let mut rows = vec![Vec::new(); count as usize + 1];
    for (column, points) in columns.iter().enumerate() {
        let mut nearest: Option<(usize, f64, usize)> = None;
        for (k, &[_, y, _]) in points.iter().enumerate() {
            if !y.is_finite() {
                continue;
            }
            let place = (y - low) / pitch_mm;
            let row = (place + 0.5) as usize;
            let off = (place - row as f64).abs();
            match &mut nearest {
                Some((own, best, point)) if *own == row => {
                    if off < *best {
                        (*best, *point) = (off, k);
                    }
                }
                _ => {
                    if let Some((row, _, point)) = nearest.replace((row, off, k)) {
                        rows[row].push((column, point));
                    }
                }
            }
        }
        if let Some((row, _, point)) = nearest {
            rows[row].push((column, point));
        }
    }
    rows
}
