//! Arcs through the corridor on top of samples.

use crate::trace::Piece;

/// An arc must span so many samples, and so many times what a line does.
const LEAST_SAMPLES: usize = 6;
const LONGER: usize = 2;
/// Radii of arcs: controls lose digits on larger ones.
const MOST_RADIUS_MM: f64 = 2000.0;
const LEAST_RADIUS_MM: f64 = 0.05;
/// Least share of the radius that the arc's ends are above or below its centre: it then is a
/// graph over the way, and no near half circle.
const LEAST_RISE: f64 = 0.2;

/// The longest arc from a height at a sample, where it reaches well beyond the line that ends at
/// `line_end`.
pub(crate) fn arc_from(
    run: &[[f64; 2]],
    at: usize,
    here: [f64; 2],
    line_end: usize,
    tolerance_mm: f64,
) -> Option<(usize, Piece)> {
    let least = at + LEAST_SAMPLES.max(LONGER * (line_end - at));
    // Arcs end where the height jumps.
    let jump = (at + 1..run.len()).find(|&k| run[k][0] <= run[k - 1][0]);
    let last = jump.unwrap_or(run.len()) - 1;
    let holds = |end: usize| through(run, at, here, end, tolerance_mm);
    if least > last {
        return None;
    }
    let mut good = (least, holds(least)?);
    let mut stride = least - at;
    while good.0 < last {
        let next = (good.0 + stride).min(last);
        match holds(next) {
            Some(piece) => {
                good = (next, piece);
                stride *= 2;
            }
            None if stride == 1 => break,
            None => stride = stride.div_ceil(2).min(next - good.0 - 1).max(1),
        }
    }
    Some(good)
}

/// The arc to a sample, if it stays in the corridor.
fn through(
    run: &[[f64; 2]],
    at: usize,
    here: [f64; 2],
    end: usize,
    tolerance_mm: f64,
) -> Option<Piece> {
    let middle = usize::midpoint(at, end);
    let lifted = |k: usize| [run[k][0], run[k][1] + tolerance_mm / 2.0];
    let to = lifted(end);
    let [cs, cz] = centre(here, lifted(middle), to)?;
    let (ds, dz) = (here[0] - cs, here[1] - cz);
    let square = ds * ds + dz * dz;
    let radius = square.sqrt();
    if !(LEAST_RADIUS_MM..=MOST_RADIUS_MM).contains(&radius) {
        return None;
    }
    let is_hump = lifted(middle)[1] > cz;
    let sign = if is_hump { 1.0 } else { -1.0 };
    if [dz, to[1] - cz]
        .iter()
        .any(|rise| rise * sign < LEAST_RISE * radius)
    {
        return None;
    }
    run[at + 1..=end]
        .iter()
        .all(|[s, z]| {
            let z_arc = cz + sign * (square - (s - cs) * (s - cs)).max(0.0).sqrt();
            (*z..=z + tolerance_mm).contains(&z_arc)
        })
        .then_some(Piece {
            to,
            centre: Some([cs, cz]),
        })
}

/// Centre of the circle through three points, if they do not lie on a line.
fn centre(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Option<[f64; 2]> {
    let (p, q) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let cross = 2.0 * (p[0] * q[1] - p[1] * q[0]);
    if cross == 0.0 {
        return None;
    }
    let (pp, qq) = (p[0] * p[0] + p[1] * p[1], q[0] * q[0] + q[1] * q[1]);
    let s = (q[1] * pp - p[1] * qq) / cross;
    let z = (p[0] * qq - q[0] * pp) / cross;
    (s.is_finite() && z.is_finite()).then_some([a[0] + s, a[1] + z])
}
