//! Character lines: where the shape changes abruptly (Koo & Lee, section 3).
//!
//! Those that run along the grid from one side to the other are found here: a crease gets
//! triple knots, on which pieces of the surface meet ([`split_at_creases`]), and a step parts
//! the grid. Lines in other directions are found node by node ([`Features`]), so that fairing
//! leaves them sharp; surfaces are parted on them where that pays ([`crate::parted`]).

use nurbs::{BSplineSurface, KnotVector};

use crate::axis::DEGREE;
use crate::grid::HeightGrid;
use crate::knots::derivative::{both_sides, one_sided};

/// Standard deviations of noise that are no jump.
const NOISE_FACTOR: f64 = 5.0;
/// A jump is this many times what is usual in the grid.
const UNUSUAL: f64 = 8.0;
/// Share of the lines across that must show a crease, or a step, for it to run all along.
const SHARE: f64 = 0.6;
/// Least jump, in tolerances, over one node, of z and of the slope: a smooth surface would
/// bridge lower ones.
const MATTERS: [f64; 2] = [4.0, 1.0];
/// Fewest lines that can tell, and as a part of all.
const FEWEST_LINES: usize = 4;
const LEAST_PART: usize = 4;
/// Middles to either side in which one line shows.
const REACH: usize = 3;

/// What happens on a character line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineKind {
    /// z jumps.
    Step,
    /// The slope across the line jumps.
    Crease,
}

/// A character line along the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CharacterLine {
    /// Whether it runs at one x, up the grid, or else at one y.
    pub is_at_x: bool,
    /// That x or y, in nodes from the first.
    pub at: f64,
    /// What happens on it.
    pub kind: LineKind,
    /// Median jump: millimetres for a step, mm/mm for a crease.
    pub jump: f64,
}

/// The lines along the grid on which z or the slope breaks over most of their length, as far
/// as they matter for a surface within a tolerance in millimetres.
#[must_use]
pub fn grid_lines(grid: &HeightGrid, tolerance_mm: f64) -> Vec<CharacterLine> {
    let rows: Vec<Vec<f64>> = (0..grid.rows()).map(|j| grid.row(j)).collect();
    let columns: Vec<Vec<f64>> = (0..grid.columns())
        .map(|i| grid.column(i).to_vec())
        .collect();
    let noise_mm = grid.noise_mm();
    let mut lines = across(&rows, grid.pitch_mm(), noise_mm, tolerance_mm, true);
    lines.extend(across(
        &columns,
        grid.pitch_mm(),
        noise_mm,
        tolerance_mm,
        false,
    ));
    lines
}

fn across(
    sections: &[Vec<f64>],
    pitch_mm: f64,
    noise_mm: f64,
    tolerance_mm: f64,
    is_at_x: bool,
) -> Vec<CharacterLine> {
    // Jumps of z, slope and second derivative, per node.
    let jumps: Vec<Vec<[f64; 3]>> = sections
        .iter()
        .map(|z| {
            let sides = both_sides(z);
            let jump = |[before, after]: &[[f64; 4]; 2]| {
                core::array::from_fn(|order| after[order] - before[order])
            };
            sides.iter().map(jump).collect()
        })
        .collect();
    let usual = |order: usize| {
        let all = jumps.iter().flatten().map(|jump| jump[order].abs());
        median(all.filter(|jump| !jump.is_nan()).collect())
    };
    let gain = |order: usize| {
        let weights = one_sided()[order];
        (2.0 * weights.iter().map(|w| w * w).sum::<f64>()).sqrt()
    };
    let least = [0, 1].map(|order| {
        let noise = NOISE_FACTOR * noise_mm * gain(order) / (sections.len() as f64).sqrt();
        (UNUSUAL * usual(order))
            .max(noise)
            .max(MATTERS[order] * tolerance_mm)
    });
    let middles = jumps.first().map_or(0, Vec::len);
    let mut found: Vec<(f64, CharacterLine, usize)> = Vec::new();
    for k in 0..middles {
        let here: Vec<[f64; 3]> = jumps
            .iter()
            .filter_map(|line| line.get(k).copied())
            .filter(|jump| !jump[0].is_nan())
            .collect();
        if here.len() < FEWEST_LINES.max(sections.len() / LEAST_PART) {
            continue;
        }
        let of = |order: usize| median(here.iter().map(|jump| jump[order].abs()).collect());
        let (j0, j1, j2) = (of(0), of(1), of(2));
        let holds = |test: &dyn Fn(&[f64; 3]) -> bool| {
            here.iter().filter(|jump| test(jump)).count() as f64 >= SHARE * here.len() as f64
        };
        let is_step = |jump: &[f64; 3]| jump[0].abs() > jump[1].abs() && jump[0].abs() > least[0];
        let is_crease =
            |jump: &[f64; 3]| jump[0].abs() <= 0.75 * jump[1].abs() && jump[1].abs() > least[1];
        let middle = k as f64 + 0.5;
        // Beside the line the cubics reach across it; there the next derivative jumps, too.
        if j0 > least[0] && holds(&is_step) {
            let line = CharacterLine {
                is_at_x,
                at: middle,
                kind: LineKind::Step,
                jump: j0,
            };
            found.push((j0 - j1 / 2.0, line, k));
        } else if j1 > least[1] && holds(&is_crease) {
            let at = median(here.iter().map(|jump| middle - jump[0] / jump[1]).collect());
            let line = CharacterLine {
                is_at_x,
                at,
                kind: LineKind::Crease,
                jump: j1 / pitch_mm,
            };
            found.push((j1 - j2 / 2.0, line, k));
        }
    }
    let is_crease = |line: &CharacterLine| line.kind == LineKind::Crease;
    found.sort_by(|a, b| {
        is_crease(&a.1)
            .cmp(&is_crease(&b.1))
            .then(b.0.total_cmp(&a.0))
            .then(a.2.cmp(&b.2))
    });
    let mut lines: Vec<(usize, CharacterLine)> = Vec::new();
    for (_, line, k) in found {
        if lines.iter().all(|(other, _)| other.abs_diff(k) > REACH) {
            lines.push((k, line));
        }
    }
    lines.sort_by_key(|(k, _)| *k);
    lines.into_iter().map(|(_, line)| line).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The pieces of a cubic surface between its triple knots. Neighbours share their border's
/// control points, so that they meet on it exactly.
#[must_use]
pub fn split_at_creases(surface: &BSplineSurface) -> Vec<BSplineSurface> {
    let (us, vs) = (parts(surface.u_knots()), parts(surface.v_knots()));
    let rows = surface.v_knots().control_count();
    let mut pieces = Vec::new();
    for (u_knots, u_first) in &us {
        for (v_knots, v_first) in &vs {
            let points = (0..u_knots.control_count())
                .flat_map(|i| {
                    let start = (u_first + i) * rows + v_first;
                    let line = surface.points().get(start..start + v_knots.control_count());
                    line.unwrap_or_default().iter().copied()
                })
                .collect();
            if let Ok(piece) = BSplineSurface::new(u_knots.clone(), v_knots.clone(), points) {
                pieces.push(piece);
            }
        }
    }
    pieces
}

/// The knots between those of full multiplicity, each with its first control point.
fn parts(knots: &KnotVector) -> Vec<(KnotVector, usize)> {
    let all = knots.knots();
    let (mut parts, mut start) = (Vec::new(), 0);
    let mut rest = all.to_vec();
    let mut p = DEGREE + 1;
    while knots.degree() == DEGREE && p + DEGREE < rest.len().saturating_sub(DEGREE) {
        let t = rest[p];
        if rest[p..p + DEGREE].iter().any(|&knot| knot != t) {
            p += 1;
            continue;
        }
        let mut left = rest[..p + DEGREE].to_vec();
        left.push(t);
        let mut right = vec![t];
        right.extend(&rest[p..]);
        if let Ok(left) = KnotVector::new(DEGREE, left) {
            parts.push((left, start));
        }
        start += p - 1;
        rest = right;
        p = DEGREE + 1;
    }
    if let Ok(last) = KnotVector::new(knots.degree(), rest) {
        parts.push((last, start));
    }
    parts
}

/// Points on each side that tell of a feature, through which a parabola is fitted.
const SIDE: usize = 7;
/// Lines to either side over which jumps are averaged.
const BESIDE: usize = 2;
/// Beside a feature another must show at least this share of its jump to be one.
const LOBE: f64 = 0.6;
/// Least change of slope that is a crease, mm/mm: 8.5 degrees from level.
const LEAST_CREASE: f64 = 0.15;

/// Between which neighbouring nodes a feature runs, in any direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Features {
    /// `[column * rows + row]`: between this node and the next along x.
    pub along_x: Vec<bool>,
    /// The same along y.
    pub along_y: Vec<bool>,
}

impl Features {
    /// Steps and creases that stand out of the noise: parabolas through seven nodes on each
    /// side, averaged over five lines, miss each other or meet at an angle. Masked nodes
    /// tell of nothing.
    #[must_use]
    pub fn of(grid: &HeightGrid, noise_mm: f64) -> Self {
        let (columns, rows) = (grid.columns(), grid.rows());
        let z = grid.raw_z_mm();
        let along_x = found_along(
            columns,
            rows,
            |i, j| z[i * rows + j],
            grid.pitch_mm(),
            noise_mm,
        );
        let turned = found_along(
            rows,
            columns,
            |j, i| z[i * rows + j],
            grid.pitch_mm(),
            noise_mm,
        );
        let mut along_y = vec![false; columns * rows];
        for (n, &is_feature) in turned.iter().enumerate() {
            along_y[(n % columns) * rows + n / columns] = is_feature;
        }
        Self { along_x, along_y }
    }
}

/// For `lines` lines of `count` nodes: `[k * lines + line]` between node k and the next.
fn found_along(
    count: usize,
    lines: usize,
    z: impl Fn(usize, usize) -> f64,
    pitch_mm: f64,
    noise_mm: f64,
) -> Vec<bool> {
    let weights = parabola();
    let gain = weights.map(|w| (2.0 * w.iter().map(|w| w * w).sum::<f64>()).sqrt());
    let mut jumps = vec![[f64::NAN; 2]; count * lines];
    for k in SIDE - 1..count.saturating_sub(SIDE) {
        for line in 0..lines {
            let mut jump = [0.0; 2];
            for (m, (value, slope)) in weights[0].iter().zip(&weights[1]).enumerate() {
                let (before, after) = (z(k - m, line), z(k + 1 + m, line));
                jump[0] += value * (after - before);
                jump[1] += slope * (after + before);
            }
            jumps[k * lines + line] = jump;
        }
    }
    let mut is_feature = vec![false; count * lines];
    let mut line_scores = vec![0.0; count];
    for line in 0..lines {
        line_scores.fill(0.0);
        for (k, score) in line_scores.iter_mut().enumerate() {
            let from = line.saturating_sub(BESIDE);
            let to = (line + BESIDE + 1).min(lines);
            let (mut sum, mut seen) = ([0.0; 2], 0.0);
            for other in from..to {
                let jump = jumps[k * lines + other];
                if !jump[0].is_nan() {
                    sum = [sum[0] + jump[0], sum[1] + jump[1]];
                    seen += 1.0;
                }
            }
            if seen == 0.0 || jumps[k * lines + line][0].is_nan() {
                continue;
            }
            let [j0, j1] = sum.map(|sum| (sum / seen).abs());
            let noise = NOISE_FACTOR * noise_mm / f64::sqrt(seen);
            let step = j0 / (noise * gain[0]).max(LEAST_CREASE * pitch_mm);
            let crease = j1 / (noise * gain[1]).max(LEAST_CREASE * pitch_mm);
            *score = step.max(crease);
        }
        for k in 0..count {
            let most = |reach: usize| {
                let from = k.saturating_sub(reach);
                let near = line_scores[from..(k + reach + 1).min(count)].iter();
                near.copied().fold(0.0, f64::max)
            };
            // The line may run between two middles; parabolas that reach across it miss each
            // other, too, but by less.
            is_feature[k * lines + line] = line_scores[k] > 1.0
                && line_scores[k] >= 0.9 * most(SIDE / 2)
                && line_scores[k] >= LOBE * most(SIDE);
        }
    }
    is_feature
}

/// Weights with which values at 0.5, 1.5, ... give the parabola through them, and its slope,
/// at 0, by least squares.
fn parabola() -> [[f64; SIDE]; 2] {
    // Orthogonal polynomials around the middle of the seven: 1, t, t^2 - 4.
    let mut weights = [[0.0; SIDE]; 2];
    let at = -((SIDE as f64) / 2.0);
    let middle = (SIDE as f64 - 1.0) / 2.0;
    let mean_square = (0..SIDE)
        .map(|m| (m as f64 - middle) * (m as f64 - middle))
        .sum::<f64>()
        / SIDE as f64;
    let basis = |t: f64| [1.0, t, t * t - mean_square];
    let slopes = [0.0, 1.0, 2.0 * at];
    let mut norms = [0.0; 3];
    for m in 0..SIDE {
        for (norm, b) in norms.iter_mut().zip(basis(m as f64 - middle)) {
            *norm += b * b;
        }
    }
    let [values, of_slope] = &mut weights;
    for (m, (value, slope)) in values.iter_mut().zip(of_slope).enumerate() {
        let here = basis(m as f64 - middle);
        for k in 0..3 {
            *value += here[k] * basis(at)[k] / norms[k];
            *slope += here[k] * slopes[k] / norms[k];
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(z: impl Fn(f64, f64) -> f64) -> HeightGrid {
        let z = (0..60 * 50)
            .map(|n| z((n / 50) as f64 * 0.5, (n % 50) as f64 * 0.5))
            .collect();
        HeightGrid::new(0.5, [0.0; 2], 60, 50, z).unwrap()
    }

    #[test]
    fn a_ridge_along_the_grid_is_found_where_it_runs() {
        let lines = grid_lines(
            &grid(|x, y| 5.0 - (x - 13.1).abs() * 0.6 + 0.02 * (y - 9.0) * (y - 9.0)),
            0.05,
        );
        assert_eq!(lines.len(), 1, "{lines:?}");
        assert_eq!((lines[0].kind, lines[0].is_at_x), (LineKind::Crease, true));
        assert!((lines[0].at - 26.2).abs() < 1e-6, "{lines:?}");
        assert!((lines[0].jump - 1.2).abs() < 1e-6, "{lines:?}");
    }

    #[test]
    fn a_step_is_no_crease_and_a_smooth_surface_neither() {
        let lines = grid_lines(
            &grid(|x, y| libm::sin(x * 0.3) + 0.1 * y + if y > 12.2 { 2.0 } else { 0.0 }),
            0.05,
        );
        assert_eq!(lines.len(), 1, "{lines:?}");
        assert_eq!((lines[0].kind, lines[0].is_at_x), (LineKind::Step, false));
        assert_eq!(lines[0].at, 24.5);
        let smooth = grid(|x, y| 3.0 * libm::exp(-0.03 * ((x - 9.0) * (x - 9.0) + y * y)));
        assert_eq!(grid_lines(&smooth, 0.001), []);
    }

    #[test]
    fn pieces_share_their_border() {
        let u = KnotVector::new(
            3,
            vec![
                0., 0., 0., 0., 1., 2., 2., 2., 2.5, 3., 3., 3., 4., 4., 4., 4.,
            ],
        )
        .unwrap();
        let v = KnotVector::uniform(3, 3, 0.0, 6.0).unwrap();
        let points = (0..u.control_count() * v.control_count())
            .map(|n| [n as f64, (n * n % 7) as f64, (n * 5 % 11) as f64])
            .collect();
        let surface = BSplineSurface::new(u, v, points).unwrap();
        let pieces = split_at_creases(&surface);
        assert_eq!(pieces.len(), 3);
        let domains = [(0.0, 2.0), (2.0, 3.0), (3.0, 4.0)];
        for (piece, (first, last)) in pieces.iter().zip(domains) {
            assert_eq!(piece.u_knots().domain(), (first, last));
            for step in 0..=10 {
                let u = first + (last - first) * f64::from(step) / 10.0;
                for v in [0.0, 1.7, 6.0] {
                    // At the very end a piece is continued by itself, not by the next.
                    let (a, b) = (piece.evaluate(u, v), surface.evaluate(u, v));
                    for (a, b) in a.iter().zip(b) {
                        assert!((a - b).abs() < 1e-12, "{a} {b}");
                    }
                }
            }
        }
    }

    #[test]
    fn an_oblique_crease_is_a_feature_and_noise_is_none() {
        let noise = |x: f64, y: f64| {
            let n = libm::sin(x * 127.1 + y * 311.7) * 43_758.547;
            (n - libm::floor(n) - 0.5) * 0.12
        };
        let crease = grid(|x, y| (x - 0.4 * y - 9.0).abs() * 0.5 + noise(x, y));
        let found = Features::of(&crease, 0.12 / 12.0_f64.sqrt());
        let (mut near, mut far) = (0, 0);
        for (n, _) in found.along_x.iter().enumerate().filter(|(_, f)| **f) {
            let (i, j) = (n / 50, n % 50);
            let off = (i as f64 + 0.5) * 0.5 - 0.4 * j as f64 * 0.5 - 9.0;
            if off.abs() < 1.0 {
                near += 1;
            } else {
                far += 1;
            }
        }
        assert!(near >= 45 && far <= 3, "{near} near, {far} far");
    }
}
