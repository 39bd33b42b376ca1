//! A cutter on an edge.
//!
//! Along an edge the tip that just touches the point at `s` stands at `z(s) - h(rho(s))`, with `s`
//! counted from the foot of the cutter's axis, `rho = sqrt(d^2 + s^2)` for an edge that passes the
//! axis at `d`, and `h` the cutter's profile. `h` is convex and grows with `rho`, so that this is
//! concave in `s`: there is one highest tip, and an end of the edge is it where the best `s` lies
//! beyond that end.

use crate::cutter::{Cutter, Kind};
use crate::facet::height;

/// Rounds for the place on a bull-nose; Newton's method takes five or so.
const ROUNDS: usize = 60;

/// An edge that is not vertical. Millimetres.
#[derive(Debug, Clone)]
pub(crate) struct Edge {
    start: [f64; 3],
    /// Unit direction as seen from above.
    along: [f64; 2],
    length: f64,
    /// Rise by length as seen from above.
    slope: f64,
    top: f64,
}

impl Edge {
    pub(crate) fn new(start: [f64; 3], end: [f64; 3]) -> Option<Self> {
        let [dx, dy, dz] = [end[0] - start[0], end[1] - start[1], end[2] - start[2]];
        let length = (dx * dx + dy * dy).sqrt();
        (length > 0.0).then(|| Self {
            start,
            along: [dx / length, dy / length],
            length,
            slope: dz / length,
            top: start[2].max(end[2]),
        })
    }

    /// The tip of a cutter that touches it between its ends; `None` where it passes the cutter by, or
    /// is touched at an end, which is a corner's business, or where that is no higher than `floor_mm`.
    pub(crate) fn tip_mm(&self, cutter: &Cutter, at: [f64; 2], floor_mm: f64) -> Option<f64> {
        let (px, py) = (self.start[0] - at[0], self.start[1] - at[1]);
        let from = px * self.along[0] + py * self.along[1];
        let apart = px * self.along[1] - py * self.along[0];
        let radius = cutter.radius_mm();
        let reach = radius * radius - apart * apart;
        if reach < 0.0 {
            return None;
        }
        let to = from + self.length;
        // No point of it is nearer to the axis than this.
        let nearest = from.max(-to).max(0.0);
        if self.top - height(cutter, apart * apart + nearest * nearest) <= floor_mm {
            return None;
        }
        if cutter.kind() == Kind::Bull
            && (falls(cutter, self.slope, apart, from) || !falls(cutter, self.slope, apart, to))
        {
            return None;
        }
        let s = best_place(cutter, self.slope, apart.abs(), reach.sqrt());
        if s < from || s > to {
            return None;
        }
        // Rounding must not lift the point above the edge's higher end.
        let z = (self.start[2] + self.slope * (s - from)).min(self.top);
        Some(z - height(cutter, apart * apart + s * s))
    }
}

/// Whether the tip that touches an edge at `s` gets lower from there on.
fn falls(cutter: &Cutter, slope: f64, apart: f64, s: f64) -> bool {
    let rho = (apart * apart + s * s).sqrt();
    let out = rho - cutter.disc_mm();
    if out <= 0.0 {
        return slope < 0.0 || (slope == 0.0 && s >= 0.0);
    }
    let r = cutter.corner_mm();
    let rise = ((r - out) * (r + out)).max(0.0).sqrt();
    slope * rho * rise < out * s
}

/// The highest of `slope s - h(sqrt(apart^2 + s^2))` over all `s`.
pub(crate) fn highest(cutter: &Cutter, slope: f64, apart: f64) -> Option<f64> {
    let radius = cutter.radius_mm();
    let reach = radius * radius - apart * apart;
    if reach < 0.0 {
        return None;
    }
    let s = best_place(cutter, slope, apart, reach.sqrt());
    Some(slope * s - height(cutter, apart * apart + s * s))
}

/// The `s` of an endless edge that the cutter touches; `reach` is how far it can.
fn best_place(cutter: &Cutter, slope: f64, apart: f64, reach: f64) -> f64 {
    match cutter.kind() {
        Kind::Flat => {
            if slope == 0.0 {
                0.0
            } else {
                reach.copysign(slope)
            }
        }
        // h' = s / sqrt(reach^2 - s^2) is the slope there.
        Kind::Ball => reach * slope / (1.0 + slope * slope).sqrt(),
        Kind::Bull if slope == 0.0 => 0.0,
        Kind::Bull => on_corner(cutter, slope.abs(), apart).copysign(slope),
    }
}

/// On a bull-nose. With `w` the sine of the angle around the corner, `rho = disc + r w`, and the
/// slope of the profile along the edge is `w / sqrt(1 - w^2) s / rho`; where it is the edge's,
/// `f(w) = w s - slope rho sqrt(1 - w^2)` is zero. `f` grows with `w`.
fn on_corner(cutter: &Cutter, slope: f64, apart: f64) -> f64 {
    let (disc, r) = (cutter.disc_mm(), cutter.corner_mm());
    let square = apart * apart;
    let along = |w: f64| {
        let rho = disc + r * w;
        (rho, (rho * rho - square).max(0.0).sqrt())
    };
    let (mut low, mut high) = (((apart - disc) / r).clamp(0.0, 1.0), 1.0);
    let mut w = (slope / (1.0 + slope * slope).sqrt()).clamp(low, high);
    for _ in 0..ROUNDS {
        let (rho, s) = along(w);
        let cosine = ((1.0 - w) * (1.0 + w)).max(0.0).sqrt();
        let f = w * s - slope * rho * cosine;
        if f > 0.0 {
            high = w;
        } else {
            low = w;
        }
        let steep = s + w * rho * r / s - slope * (r * cosine - rho * w / cosine);
        let next = w - f / steep;
        let next = if next > low && next < high {
            next
        } else {
            f64::midpoint(low, high)
        };
        // The height is flat there: an error of the place counts by its square.
        if (next - w).abs() <= 1e-13 || high - low <= 1e-15 {
            w = next;
            break;
        }
        w = next;
    }
    along(w).1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The highest tip over many points of an edge.
    fn by_force(cutter: &Cutter, a: [f64; 3], b: [f64; 3], at: [f64; 2]) -> f64 {
        let steps = 200_000;
        let mut best = f64::NEG_INFINITY;
        for k in 0..=steps {
            let t = f64::from(k) / f64::from(steps);
            let p: [f64; 3] = std::array::from_fn(|i| a[i] + t * (b[i] - a[i]));
            let distance = libm::hypot(p[0] - at[0], p[1] - at[1]);
            if let Some(height) = cutter.height_mm(distance) {
                best = best.max(p[2] - height);
            }
        }
        best
    }

    #[test]
    fn every_cutter_touches_an_edge_as_by_force() {
        for cutter in ["flat:8", "ball:8", "bull:8:1", "bull:8:3.5"] {
            let cutter: Cutter = cutter.parse().unwrap();
            for (a, b) in [
                ([-9.0, -2.0, 1.0], [8.0, 3.0, 4.0]),
                ([-9.0, 2.5, 1.0], [8.0, 2.5, 1.0]),
                ([-5.0, -7.0, -60.0], [4.0, 6.5, 75.0]),
                ([3.0, -9.0, 0.0], [3.0, 9.0, 0.5]),
            ] {
                let tip = Edge::new(a, b)
                    .unwrap()
                    .tip_mm(&cutter, [0.1, 0.2], f64::NEG_INFINITY)
                    .unwrap();
                let forced = by_force(&cutter, a, b, [0.1, 0.2]);
                // Points miss the very best by a step of the slope where it is at the rim.
                assert!(tip >= forced - 1e-12, "{cutter} {a:?}: {tip} {forced}");
                assert!(tip <= forced + 2e-3, "{cutter} {a:?}: {tip} {forced}");
            }
        }
    }

    #[test]
    fn a_bull_nose_meets_its_condition_to_the_last_digits() {
        let cutter = Cutter::bull(10.0, 2.0).unwrap();
        for (slope, apart) in [(0.3, 0.0), (0.3, 2.9), (0.3, 3.1), (5.0, 4.5), (200.0, 1.0)] {
            let s = on_corner(&cutter, slope, apart);
            let value = |s: f64| slope * s - height(&cutter, apart * apart + s * s);
            let reach = (25.0_f64 - apart * apart).sqrt();
            let steps = [1e-4, -1e-4, 1e-6, -1e-6];
            for step in steps.into_iter().filter(|step| s + step < reach) {
                assert!(value(s) >= value(s + step) - 1e-12, "{slope} {apart}");
            }
        }
    }
}
