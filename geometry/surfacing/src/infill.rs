//! Values for masked nodes, carried on smoothly from those around.
//!
//! They are no data: they keep control points determined where there are none, and let a
//! full grid's fast solution stand for that of a grid with holes while knots are placed.

/// Sweeps that smooth each level.
const SWEEPS: usize = 8;

/// `z` (column by column, NaN where masked) with masked nodes filled: averages over ever
/// coarser cells, then refined back and smoothed level by level.
pub(crate) fn fill(z: &[f64], columns: usize, rows: usize) -> Vec<f64> {
    if z.iter().all(|z| !z.is_nan()) {
        return z.to_vec();
    }
    if columns <= 1 && rows <= 1 {
        return z
            .iter()
            .map(|z| if z.is_nan() { 0.0 } else { *z })
            .collect();
    }
    let (half_columns, half_rows) = (columns.div_ceil(2), rows.div_ceil(2));
    let mut sums = vec![(0.0, 0.0); half_columns * half_rows];
    for i in 0..columns {
        for j in 0..rows {
            let z = z[i * rows + j];
            if !z.is_nan() {
                let cell = &mut sums[(i / 2) * half_rows + j / 2];
                *cell = (cell.0 + z, cell.1 + 1.0);
            }
        }
    }
    let coarse: Vec<f64> = sums.iter().map(|(sum, count)| sum / count).collect();
    let coarse = fill(&coarse, half_columns, half_rows);
    let is_data: Vec<bool> = z.iter().map(|z| !z.is_nan()).collect();
    let mut filled: Vec<f64> = (0..columns * rows)
        .map(|n| {
            let (i, j) = (n / rows, n % rows);
            if is_data[n] {
                z[n]
            } else {
                // Cells' middles lie at 0.5, 2.5, ... nodes.
                bilinear(&coarse, half_columns, half_rows, i, j)
            }
        })
        .collect();
    for _ in 0..SWEEPS {
        smooth(&mut filled, &is_data, columns, rows);
    }
    filled
}

fn bilinear(coarse: &[f64], columns: usize, rows: usize, i: usize, j: usize) -> f64 {
    let place = |n: usize, count: usize| {
        let t = ((n as f64 - 0.5) / 2.0).clamp(0.0, (count - 1) as f64);
        let low = (t as usize).min(count.saturating_sub(2));
        (low, (low + 1).min(count - 1), t - low as f64)
    };
    let ((i0, i1, s), (j0, j1, t)) = (place(i, columns), place(j, rows));
    let at = |i: usize, j: usize| coarse[i * rows + j];
    (at(i0, j0) * (1.0 - t) + at(i0, j1) * t) * (1.0 - s)
        + (at(i1, j0) * (1.0 - t) + at(i1, j1) * t) * s
}

/// Moves masked nodes to the mean of their neighbours, in place.
fn smooth(z: &mut [f64], is_data: &[bool], columns: usize, rows: usize) {
    for i in 0..columns {
        for j in 0..rows {
            let n = i * rows + j;
            if is_data[n] {
                continue;
            }
            let neighbours = [
                (i > 0).then(|| n - rows),
                (i + 1 < columns).then(|| n + rows),
                (j > 0).then(|| n - 1),
                (j + 1 < rows).then(|| n + 1),
            ];
            let (mut sum, mut count) = (0.0, 0.0);
            for at in neighbours.into_iter().flatten() {
                sum += z[at];
                count += 1.0;
            }
            if count > 0.0 {
                z[n] = sum / count;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_is_filled_between_its_borders() {
        let (columns, rows) = (37, 29);
        let plane = |n: usize| 2.0 + 0.1 * (n / rows) as f64 - 0.2 * (n % rows) as f64;
        let mut z: Vec<f64> = (0..columns * rows).map(plane).collect();
        for i in 10..25 {
            for j in 8..20 {
                z[i * rows + j] = f64::NAN;
            }
        }
        let filled = fill(&z, columns, rows);
        let off = filled.iter().enumerate().map(|(n, f)| (f - plane(n)).abs());
        let worst = off.fold(0.0, f64::max);
        assert!(worst < 0.2, "{worst}");
        assert_eq!(filled[0], plane(0));
    }
}
