//! Least squares of a tensor-product spline over the nodes of a grid (Koo & Lee, section
//! 4.4, equations (5) and (6)).
//!
//! Over a full grid the normal equations separate into one banded system along x and one
//! along y. With masked nodes they do not; then small systems may be eliminated ([`Normal`]),
//! and the full grid's equations precondition conjugate gradients for others. Masked nodes count
//! with a small weight, and with what was filled in there, so that no control point is left
//! undetermined.

use range_image::Monitor;
use rayon::prelude::*;

use crate::axis::{Axis, DEGREE};
use crate::normal::Normal;

/// What a masked node's residual counts, where a node with a value counts 1. Lower weights make
/// conjugate gradients slow; since masked nodes are filled from the surface itself, they hardly
/// draw it.
const MASKED_WEIGHT: f64 = 1e-4;
/// Most steps of conjugate gradients, and the drop of the residual at which they end.
const MOST_STEPS: usize = 400;
const DROP: f64 = 1e-9;
/// Times that coefficients are eliminated for: the second mends what the first has lost in digits.
const ELIMINATIONS: usize = 2;
/// Columns that a task takes at once.
const CHUNK: usize = 16;

/// Coefficients along y of each column: `z` column by column, `rows` each.
pub(crate) fn along_v(v: &Axis, z: &[f64]) -> Vec<f64> {
    let rows = v.at.len();
    let columns = z.len() / rows;
    let mut out = vec![0.0; columns * v.count];
    out.par_chunks_mut(v.count * CHUNK)
        .zip(z.par_chunks(rows * CHUNK))
        .for_each(|(out, z)| {
            for (line, z) in out.chunks_mut(v.count).zip(z.chunks(rows)) {
                gather(v, z, line);
                v.solve(line);
            }
        });
    out
}

fn gather(axis: &Axis, z: &[f64], line: &mut [f64]) {
    line.fill(0.0);
    for (node, &z) in axis.at.iter().zip(z) {
        let place = &mut line[node.first..=node.first + DEGREE];
        for (sum, value) in place.iter_mut().zip(node.values) {
            *sum += value * z;
        }
    }
}

/// Coefficients along x of each line of `width` values: `data` has a line for each node.
pub(crate) fn along_u(u: &Axis, data: &[f64], width: usize) -> Vec<f64> {
    let mut out = transposed_gather(u, data, width);
    solve_columns(u, &mut out, width);
    out
}

fn transposed_gather(u: &Axis, data: &[f64], width: usize) -> Vec<f64> {
    let mut out = vec![0.0; u.count * width];
    for (node, line) in u.at.iter().zip(data.chunks(width)) {
        for (k, &value) in node.values.iter().enumerate() {
            let at = (node.first + k) * width;
            for (sum, z) in out[at..at + width].iter_mut().zip(line) {
                *sum += value * z;
            }
        }
    }
    out
}

fn solve_columns(u: &Axis, data: &mut [f64], width: usize) {
    let solved: Vec<Vec<f64>> = (0..width)
        .into_par_iter()
        .with_min_len(CHUNK)
        .map(|j| {
            let mut column: Vec<f64> = data.iter().skip(j).step_by(width).copied().collect();
            u.solve(&mut column);
            column
        })
        .collect();
    for (j, column) in solved.iter().enumerate() {
        for (place, value) in data.iter_mut().skip(j).step_by(width).zip(column) {
            *place = *value;
        }
    }
}

/// Least squares over a full grid: coefficients, y fastest.
pub(crate) fn full(u: &Axis, v: &Axis, z: &[f64]) -> Vec<f64> {
    along_u(u, &along_v(v, z), v.count)
}

/// Values at all nodes, column by column.
pub(crate) fn values(u: &Axis, v: &Axis, coefficients: &[f64]) -> Vec<f64> {
    let rows = v.at.len();
    let mut out = vec![0.0; u.at.len() * rows];
    out.par_chunks_mut(rows)
        .with_min_len(CHUNK)
        .zip(&u.at)
        .for_each(|(out, node)| {
            let line = section(node, coefficients, v.count);
            for (z, node) in out.iter_mut().zip(&v.at) {
                *z = at(&line, node);
            }
        });
    out
}

/// The coefficients along y of the section through a node of x.
pub(crate) fn section(node: &crate::axis::AtNode, coefficients: &[f64], width: usize) -> Vec<f64> {
    let mut line = vec![0.0; width];
    for (k, &value) in node.values.iter().enumerate() {
        let from = (node.first + k) * width;
        for (sum, c) in line.iter_mut().zip(&coefficients[from..from + width]) {
            *sum += value * c;
        }
    }
    line
}

pub(crate) fn at(line: &[f64], node: &crate::axis::AtNode) -> f64 {
    let place = &line[node.first..=node.first + DEGREE];
    let products = place.iter().zip(node.values).map(|(c, value)| c * value);
    products.sum()
}

/// Least squares over the nodes of which `is_data` holds; the others draw weakly to what
/// `filled` has there. `start` is where the iteration begins; cancelled, it ends where it is.
/// `may_eliminate`: exactly, where that is little work. Iterations end before what the data hardly
/// hold has settled, and so leave it nearer to what was filled in.
pub(crate) fn masked(
    u: &Axis,
    v: &Axis,
    (filled, is_data): (&[f64], &[bool]),
    start: Vec<f64>,
    may_eliminate: bool,
    monitor: &dyn Monitor,
) -> Vec<f64> {
    let weight = |n: usize| if is_data[n] { 1.0 } else { MASKED_WEIGHT };
    let weighted = |mut z: Vec<f64>| {
        for (n, z) in z.iter_mut().enumerate() {
            *z *= weight(n);
        }
        z
    };
    let project = |z: &[f64]| -> Vec<f64> {
        let rows = v.at.len();
        let mut lines = vec![0.0; u.at.len() * v.count];
        lines
            .par_chunks_mut(v.count * CHUNK)
            .zip(z.par_chunks(rows * CHUNK))
            .for_each(|(lines, z)| {
                for (line, z) in lines.chunks_mut(v.count).zip(z.chunks(rows)) {
                    gather(v, z, line);
                }
            });
        transposed_gather(u, &lines, v.count)
    };
    let precondition = |residual: &[f64]| -> Vec<f64> {
        let mut out = residual.to_vec();
        for line in out.chunks_mut(v.count) {
            v.solve(line);
        }
        solve_columns(u, &mut out, v.count);
        out
    };
    let mut x = start;
    let left = |x: &[f64]| {
        let fitted = values(u, v, x);
        let off = filled.iter().zip(&fitted).map(|(z, f)| z - f).collect();
        project(&weighted(off))
    };
    let normal = may_eliminate.then(|| Normal::new(u, v, weight));
    if let Some(normal) = normal.flatten() {
        for _ in 0..ELIMINATIONS {
            let step = normal.solve(left(&x));
            x.iter_mut().zip(step).for_each(|(x, step)| *x += step);
        }
        return x;
    }
    let mut residual = left(&x);
    let mut preconditioned = precondition(&residual);
    let mut direction = preconditioned.clone();
    let mut size = dot(&residual, &preconditioned);
    let enough = DROP * DROP * dot(&project(filled), &precondition(&project(filled)));
    for _ in 0..MOST_STEPS {
        if size <= enough || monitor.is_cancelled() {
            break;
        }
        let image = project(&weighted(values(u, v, &direction)));
        let curvature = dot(&direction, &image);
        if curvature <= 0.0 {
            break;
        }
        let step = size / curvature;
        for ((x, r), (d, a)) in x
            .iter_mut()
            .zip(&mut residual)
            .zip(direction.iter().zip(&image))
        {
            *x += step * d;
            *r -= step * a;
        }
        preconditioned = precondition(&residual);
        let next = dot(&residual, &preconditioned);
        let turn = next / size;
        size = next;
        for (d, p) in direction.iter_mut().zip(&preconditioned) {
            *d = p + turn * *d;
        }
    }
    x
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Breaks;
    use range_image::Unmonitored;

    fn axis(nodes: usize, spans: usize) -> Axis {
        Axis::new(&Breaks::uniform(nodes, spans)).unwrap()
    }

    fn data(columns: usize, rows: usize) -> Vec<f64> {
        (0..columns * rows)
            .map(|n| ((n * 7919) % 101) as f64 * 0.01)
            .collect()
    }

    #[test]
    fn the_residual_is_orthogonal_to_the_basis() {
        let (u, v) = (axis(23, 5), axis(31, 7));
        let z = data(23, 31);
        let fitted = values(&u, &v, &full(&u, &v, &z));
        let off: Vec<f64> = z.iter().zip(&fitted).map(|(z, f)| z - f).collect();
        let mut lines = vec![0.0; 23 * v.count];
        for (line, off) in lines.chunks_mut(v.count).zip(off.chunks(31)) {
            gather(&v, off, line);
        }
        let projected = transposed_gather(&u, &lines, v.count);
        assert!(projected.iter().all(|p| p.abs() < 1e-11), "{projected:?}");
        assert!(dot(&off, &off) > 1.0);
    }

    #[test]
    fn masked_nodes_hardly_count() {
        // What lies in the hole must not be seen in the fit around it.
        let (u, v) = (axis(40, 6), axis(40, 6));
        let is_data: Vec<bool> = (0..1600)
            .map(|n| {
                let (i, j) = (n / 40, n % 40);
                !((12..20).contains(&i) && (15..26).contains(&j))
            })
            .collect();
        let cubic = |n: usize| {
            let (x, y) = ((n / 40) as f64 * 0.1, (n % 40) as f64 * 0.1);
            1.0 + x * x * x * 0.2 - y * y + x * y * y
        };
        let filled: Vec<f64> = (0..1600)
            .map(|n| cubic(n) + if is_data[n] { 0.0 } else { 0.05 })
            .collect();
        let start = full(&u, &v, &filled);
        let before = values(&u, &v, &start);
        let masked = |start: Vec<f64>, may_eliminate: bool| {
            let data = (&filled[..], &is_data[..]);
            masked(&u, &v, data, start, may_eliminate, &Unmonitored)
        };
        let eliminated = masked(start.clone(), true);
        let coefficients = masked(start, false);
        let pairs = eliminated.iter().zip(&coefficients);
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-6));
        let after = values(&u, &v, &coefficients);
        let worst = |values: &[f64]| {
            let off = values.iter().enumerate().filter(|(n, _)| is_data[*n]);
            off.fold(0.0_f64, |worst, (n, z)| worst.max((z - cubic(n)).abs()))
        };
        assert!(worst(&before) > 5e-3, "{}", worst(&before));
        assert!(worst(&after) < 5e-4, "{}", worst(&after));
    }
}
