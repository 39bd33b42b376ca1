//! The curve of a surface over a line or a circle of the plan.

use nurbs::{BSplineCurve, PiecewiseCubic};

use crate::height::Height;
use crate::part::Frame;
use crate::plan::{P2, Support, add, cross, distance, dot, left, norm, scale, sub, unit};
use crate::solid::SolidCurve;

/// Farthest that a spline may be from either surface, millimetres.
const NEAR_MM: f64 = 2e-6;
/// Most spans of a spline.
const MOST_SPANS: usize = 512;

/// A curve in closed form, in the frame of the part, in the sense of the support's parameter.
pub(crate) enum Exact {
    Line,
    /// A circle or an ellipse with half axes `a`, along x, and `b`; `a` is not the shorter one.
    Round {
        c: [f64; 3],
        axis: [f64; 3],
        x: [f64; 3],
        a: f64,
        b: f64,
    },
}

/// The curve, if it has a closed form.
pub(crate) fn exact(on: &Support, from: f64, to: f64, height: &Height) -> Option<Exact> {
    let up = [0.0, 0.0, 1.0];
    match (*on, height) {
        (Support::Line { .. }, Height::Level { .. } | Height::Plane { .. }) => Some(Exact::Line),
        (Support::Circle { c, r }, Height::Level { z }) => Some(Exact::Round {
            c: [c[0], c[1], *z],
            axis: up,
            x: [1.0, 0.0, 0.0],
            a: r,
            b: r,
        }),
        (Support::Circle { c, r }, Height::Plane { slope, .. }) => {
            let g = norm(*slope);
            let steep = libm::hypot(1.0, g);
            let x = unit(*slope);
            Some(Exact::Round {
                c: [c[0], c[1], height.at(c)],
                axis: [-slope[0] / steep, -slope[1] / steep, 1.0 / steep],
                x: [x[0] / steep, x[1] / steep, g / steep],
                a: r * steep,
                b: r,
            })
        }
        (Support::Circle { c, r }, Height::Cone { c: e, .. } | Height::Ring { c: e, .. })
            if distance(c, *e) < 1e-7 =>
        {
            Some(Exact::Round {
                c: [c[0], c[1], height.at(on.at(from))],
                axis: up,
                x: [1.0, 0.0, 0.0],
                a: r,
                b: r,
            })
        }
        (Support::Line { p, d }, Height::Cone { c, .. }) => {
            // Straight from the apex, unless it leads across it.
            let t = dot(sub(*c, p), d);
            let beside = cross(d, sub(*c, p)).abs() < 1e-7;
            (beside && (t <= from + 1e-9 || t >= to - 1e-9)).then_some(Exact::Line)
        }
        (
            Support::Line { p, d },
            Height::Ring {
                c,
                ring,
                z,
                r,
                side,
            },
        ) => {
            let foot = dot(sub(*c, p), d);
            let off = cross(d, sub(*c, p));
            let middle = 0.5 * (from + to) - foot;
            let radius = if *ring == 0.0 {
                ((r - off) * (r + off)).max(0.0).sqrt()
            } else if off.abs() < 1e-7 && (from - foot) * (to - foot) > 0.0 {
                *r
            } else {
                return None;
            };
            let shift = if *ring == 0.0 {
                foot
            } else {
                foot + middle.signum() * ring
            };
            let center = add(p, scale(d, shift));
            Some(upright(
                [center[0], center[1], *z],
                d,
                radius,
                radius,
                *side,
            ))
        }
        (
            Support::Line { p, d },
            Height::Bar {
                p: q,
                d: e,
                z,
                r,
                side,
            },
        ) => {
            let sine = cross(*e, d);
            if sine.abs() < 1e-9 {
                return Some(Exact::Line);
            }
            // Where the lines cross; the cut is wider by the angle.
            let t = -cross(*e, sub(p, *q)) / sine;
            let center = add(p, scale(d, t));
            let long = (r / sine).abs();
            Some(upright([center[0], center[1], *z], d, long, *r, *side))
        }
        (_, Height::Bar { .. } | Height::Cone { .. } | Height::Ring { .. } | Height::Spline(_)) => {
            None
        }
    }
}

/// An ellipse in the upright plane along `d`, run along `d` on its upper or lower half.
fn upright(c: [f64; 3], d: P2, along: f64, r: f64, side: f64) -> Exact {
    // Along d over the top is clockwise around the normal to the left of d.
    let n = scale(left(d), side);
    Exact::Round {
        c,
        axis: [n[0], n[1], 0.0],
        x: [d[0], d[1], 0.0],
        a: along,
        b: r,
    }
}

/// A spline along the curve, within [`NEAR_MM`] of both surfaces where that can be had.
pub(crate) fn spline(
    on: &Support,
    from: f64,
    to: f64,
    height: &Height,
    ends: [[f64; 3]; 2],
    frame: &Frame,
) -> SolidCurve {
    let mut best = None;
    let mut spans = 4;
    while spans <= MOST_SPANS {
        let curve = through(on, from, to, height, ends, spans);
        let off = curve
            .as_ref()
            .map_or(f64::INFINITY, |curve| worst(curve, on, height));
        if best.as_ref().is_none_or(|(least, _)| off < *least) {
            best = curve.map(|curve| (off, curve));
        }
        if off < NEAR_MM {
            break;
        }
        spans *= 2;
    }
    let made = best.and_then(|(_, curve)| {
        let spline = curve.to_bspline(1e-12);
        let points = spline.points().iter().map(|&p| frame.point(p)).collect();
        BSplineCurve::new(spline.knots().clone(), points).ok()
    });
    made.map_or(SolidCurve::Line, SolidCurve::Spline)
}

/// Farthest from either surface between the points that it was put through.
fn worst(curve: &PiecewiseCubic<3>, on: &Support, height: &Height) -> f64 {
    let points = curve.sampled(4);
    let off = points.iter().map(|p| {
        let beside = on.distance([p[0], p[1]]);
        beside.max(height.off(*p))
    });
    off.fold(0.0, f64::max)
}

/// The cubic spline with two continuous derivatives through points of the curve, by the length of
/// its chords; the points are closer to the ends, where rounds may stand upright.
fn through(
    on: &Support,
    from: f64,
    to: f64,
    height: &Height,
    ends: [[f64; 3]; 2],
    spans: usize,
) -> Option<PiecewiseCubic<3>> {
    let points: Vec<[f64; 3]> = (0..=spans)
        .map(|k| match k {
            0 => ends[0],
            _ if k == spans => ends[1],
            _ => {
                let part = k as f64 / spans as f64;
                let part = part - libm::sin(std::f64::consts::TAU * part) / 6.5;
                let q = on.at(from + (to - from) * part);
                [q[0], q[1], height.at(q)]
            }
        })
        .collect();
    let length = |a: &[f64; 3], b: &[f64; 3]| {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - b) * (a - b))
            .sum::<f64>()
            .sqrt()
    };
    let mut breaks = vec![0.0];
    for pair in points.windows(2) {
        breaks.push(breaks[breaks.len() - 1] + length(&pair[0], &pair[1]));
    }
    let width: Vec<f64> = breaks.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let slopes = slopes(&points, &width);
    let pieces = (0..spans)
        .map(|k| {
            core::array::from_fn(|d| {
                let (h, p, q) = (width[k], points[k][d], points[k + 1][d]);
                let (a, b) = (slopes[k][d], slopes[k + 1][d]);
                let rise = (q - p) / h;
                [
                    p,
                    a,
                    (3.0 * rise - 2.0 * a - b) / h,
                    (a + b - 2.0 * rise) / (h * h),
                ]
            })
        })
        .collect();
    PiecewiseCubic::new(breaks, pieces).ok()
}

/// Slopes of the cubic spline at its points; the third derivative goes on across the second and
/// the last but one (de Boor 1978, chapter IV, "not-a-knot").
fn slopes(points: &[[f64; 3]], h: &[f64]) -> Vec<[f64; 3]> {
    let n = points.len() - 1;
    let rise = |k: usize, d: usize| (points[k + 1][d] - points[k][d]) / h[k];
    // Rows of a tridiagonal system: below, diagonal, above, right-hand side.
    let mut rows: Vec<([f64; 3], [f64; 3])> = Vec::with_capacity(n + 1);
    let s = h[0] + h[1];
    rows.push((
        [0.0, h[1], s],
        core::array::from_fn(|d| {
            ((h[0] + 2.0 * s) * h[1] * rise(0, d) + h[0] * h[0] * rise(1, d)) / s
        }),
    ));
    for k in 1..n {
        rows.push((
            [h[k], 2.0 * (h[k - 1] + h[k]), h[k - 1]],
            core::array::from_fn(|d| 3.0 * (h[k] * rise(k - 1, d) + h[k - 1] * rise(k, d))),
        ));
    }
    let s = h[n - 1] + h[n - 2];
    rows.push((
        [s, h[n - 2], 0.0],
        core::array::from_fn(|d| {
            let (last, before) = (h[n - 1], h[n - 2]);
            (last * last * rise(n - 2, d) + (2.0 * s + last) * before * rise(n - 1, d)) / s
        }),
    ));
    for k in 1..=n {
        let ([_, diagonal, above], right) = rows[k - 1];
        let by = rows[k].0[0] / diagonal;
        rows[k].0[1] -= by * above;
        for (own, right) in rows[k].1.iter_mut().zip(right) {
            *own -= by * right;
        }
    }
    let mut slopes = vec![[0.0; 3]; n + 1];
    for k in (0..=n).rev() {
        let ([_, diagonal, above], right) = rows[k];
        let next = if k < n { slopes[k + 1] } else { [0.0; 3] };
        slopes[k] = core::array::from_fn(|d| (right[d] - above * next[d]) / diagonal);
    }
    slopes
}
