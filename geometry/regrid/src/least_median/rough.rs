//! Planes in single precision, and what rounding may do to residuals from them.
//!
//! Bounds are in units of rounding, `u`. With R as far as x and y reach, a difference of two is
//! off by 4 u R: each is rounded, and their difference is. With h for the sum of `|pz|`, `|qz|`
//! and `|rz|`, where q and r are taken from p, heights are off by 2 u h. That makes
//!
//! - 32 u R^2 in `cross = qx ry - rx qy` by the differences in it, 16 u R^2 by rounding it;
//! - 16 u R h in the numerators of a and b, likewise;
//! - 48 u R^2 in a squared length, so 832 u R^4 in the product of two, of which those counts
//!   that the least sine makes 1 / 2500 of them, and the product of two more roundings.

use super::lanes::Lanes;
use super::window::{Extent, UNIT};
use crate::plane::LEAST_SINE;

/// What rounding does to the planes of one window.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    spread: f32,
    /// How much `cross^2` less the least one may be off: in proportion to `cross`, and at least.
    sine: [f32; 2],
    /// How much a residual may be off: in proportion to the plane's size, over `cross` and
    /// without, and at least.
    slack: [f32; 3],
}

impl Bounds {
    /// Of a window of moderate extent.
    ///
    /// `cross^2 - least_sine^2 |q|^2 |r|^2` is off by `(2 * 48 + 16) u R^2 |cross|` by its first
    /// term, and by 0.42 u R^4 by its second. Triples that surely span a plane have a `cross` of
    /// more than 1.7e-4 R^2, so it is off by less than 2 % of itself. Therefore a is off by
    /// `1.02 u (16 R h + 48 R^2 |a|) / |cross|`, b likewise, and samples are at most 2 R from
    /// p: of what that makes in a residual, 110 `u R^2 / |cross| (h + R |a| + R |b|)` is more.
    ///
    /// To this comes what is rounded in `z - (pz - a px - b py) - a x - b y`: 14 units of the
    /// greatest of each product, 6 of heights. All that in double precision, too, is covered by
    /// some more units; but there heights are not above the reference.
    pub(super) fn new(extent: &Extent) -> Self {
        let Extent {
            spread,
            height,
            reference,
        } = *extent;
        let area = spread * spread;
        let reference = (16.0 * f64::EPSILON * reference.abs()) as f32;
        // Products too small to be rounded in proportion, divided by the least `cross`.
        let least = 1e-30;
        Self {
            spread,
            sine: [120.0 * UNIT * area, 0.5 * UNIT * area * area],
            slack: [
                128.0 * UNIT * area,
                20.0 * UNIT,
                20.0 * UNIT * height + reference + least,
            ],
        }
    }
}

/// Planes by lanes, above the window's reference.
pub(super) struct Solved<L: Lanes> {
    pub(super) a: L::f32s,
    pub(super) b: L::f32s,
    pub(super) c: L::f32s,
    /// How much a residual in single precision may differ from the one in double precision.
    pub(super) slack: L::f32s,
    /// Triples that surely span a plane; the others' numbers mean nothing.
    pub(super) good: L::m32s,
    /// Triples that surely span none.
    pub(super) bad: L::m32s,
}

/// The planes through three corners each, as [`crate::plane::Plane::through_points`] has them but
/// for rounding.
#[inline(always)]
pub(super) fn solve<L: Lanes>(
    lanes: L,
    [p, q, r]: [[L::f32s; 3]; 3],
    bounds: &Bounds,
) -> Solved<L> {
    let splat = |number| lanes.splat_f32s(number);
    let (mul, add) = (|a, b| lanes.mul_f32s(a, b), |a, b| lanes.add_f32s(a, b));
    let (fused, abs) = (
        |a, b, c| lanes.mul_add_e_f32s(a, b, c),
        |a| lanes.abs_f32s(a),
    );
    let less = |a, b, c| lanes.negate_mul_add_e_f32s(a, b, c);
    let minor = |a, b, c, d| less(c, d, mul(a, b));
    let sub = |a, b| lanes.sub_f32s(a, b);
    let length2 = |x, y| fused(y, y, mul(x, x));

    let (qx, qy, qz) = (sub(q[0], p[0]), sub(q[1], p[1]), sub(q[2], p[2]));
    let (rx, ry, rz) = (sub(r[0], p[0]), sub(r[1], p[1]), sub(r[2], p[2]));
    let cross = minor(qx, ry, rx, qy);
    let lengths2 = mul(length2(qx, qy), length2(rx, ry));
    let least = splat((LEAST_SINE * LEAST_SINE) as f32);
    let excess = less(least, lengths2, mul(cross, cross));
    let unsure = fused(splat(bounds.sine[0]), abs(cross), splat(bounds.sine[1]));
    let good = lanes.less_than_f32s(unsure, excess);
    let bad = lanes.less_than_f32s(excess, lanes.neg_f32s(unsure));

    let inverse = lanes.div_f32s(splat(1.0), cross);
    let a = mul(minor(qz, ry, rz, qy), inverse);
    let b = mul(minor(qx, rz, rx, qz), inverse);
    let c = less(b, p[1], less(a, p[0], p[2]));

    let heights = add(abs(p[2]), add(abs(qz), abs(rz)));
    let size = fused(splat(bounds.spread), add(abs(a), abs(b)), heights);
    let [over_cross, own, least] = bounds.slack.map(splat);
    let slack = fused(size, fused(over_cross, abs(inverse), own), least);
    Solved {
        a,
        b,
        c,
        slack,
        good,
        bad,
    }
}

/// What lies below a height by a plane's slopes, fused where that is fast, which the slack covers
/// either way.
#[inline(always)]
pub(super) fn level<L: Lanes>(lanes: L, [a, b]: [L::f32s; 2], [x, y, z]: [L::f32s; 3]) -> L::f32s {
    lanes.negate_mul_add_e_f32s(b, y, lanes.negate_mul_add_e_f32s(a, x, z))
}
