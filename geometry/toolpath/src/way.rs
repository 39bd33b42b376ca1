//! What a cutter leaves that moves straight.

use crate::cutter::{Cutter, Kind};

/// Rounds of halving for the way of a bull-nose, at most.
const ROUNDS: usize = 60;
/// How near to the least height the way of a bull-nose is sought, millimetres.
const NEAR_MM: f64 = 1e-10;

/// A straight way of the tip as seen from above.
#[derive(Debug, Clone)]
pub(crate) struct Way {
    from: [f64; 3],
    along: [f64; 2],
    length: f64,
    slope: f64,
    /// The lowest that the tip gets, millimetres.
    pub(crate) lowest_mm: f64,
}

impl Way {
    pub(crate) fn new(a: [f64; 3], b: [f64; 3]) -> Self {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = (dx * dx + dy * dy).sqrt();
        let lowest_mm = a[2].min(b[2]);
        if length < 1e-9 {
            // Straight down or up: what its lowest place takes.
            return Self {
                from: [a[0], a[1], lowest_mm],
                along: [1.0, 0.0],
                length: 0.0,
                slope: 0.0,
                lowest_mm,
            };
        }
        Self {
            from: a,
            along: [dx / length, dy / length],
            length,
            slope: (b[2] - a[2]) / length,
            lowest_mm,
        }
    }

    /// The tip after so much of the way, millimetres.
    pub(crate) fn tip_mm(&self, way_mm: f64) -> [f64; 3] {
        [
            self.from[0] + way_mm * self.along[0],
            self.from[1] + way_mm * self.along[1],
            self.from[2] + way_mm * self.slope,
        ]
    }

    /// The height that is left at a place, and after how much of the way; `None` out of reach, or
    /// where that is no lower than `ceiling_mm`.
    ///
    /// What the cutter leaves is `z(t) + h(rho(t))`, convex along the way, so that there is one least.
    pub(crate) fn leaves(
        &self,
        cutter: &Cutter,
        at: [f64; 2],
        ceiling_mm: f64,
    ) -> Option<(f64, f64)> {
        let (px, py) = (at[0] - self.from[0], at[1] - self.from[1]);
        let foot = px * self.along[0] + py * self.along[1];
        let aside = px * self.along[1] - py * self.along[0];
        let aside = aside * aside;
        let radius = cutter.radius_mm();
        let reach = radius * radius - aside;
        if reach < 0.0 {
            return None;
        }
        let reach = reach.sqrt();
        let (low, high) = ((foot - reach).max(0.0), (foot + reach).min(self.length));
        if low > high {
            return None;
        }
        let nearest = foot.clamp(low, high);
        let off = nearest - foot;
        let least = cutter.profile((aside + off * off).sqrt());
        if self.lowest_mm + least >= ceiling_mm {
            return None;
        }
        let value = |t: f64| {
            let off = t - foot;
            self.from[2] + self.slope * t + cutter.profile((aside + off * off).sqrt())
        };
        let t = match cutter.kind() {
            _ if self.slope == 0.0 => nearest,
            Kind::Flat if self.slope > 0.0 => low,
            Kind::Flat => high,
            Kind::Ball => {
                let lean = self.slope / (1.0 + self.slope * self.slope).sqrt();
                (foot - lean * reach).clamp(low, high)
            }
            Kind::Bull => self.least_of_bull(cutter, [foot, aside], [low, high], ceiling_mm)?,
        };
        let left = value(t);
        (left < ceiling_mm).then_some((left, t))
    }

    fn least_of_bull(
        &self,
        cutter: &Cutter,
        [foot, aside]: [f64; 2],
        [mut low, mut high]: [f64; 2],
        ceiling_mm: f64,
    ) -> Option<f64> {
        let r = cutter.corner_mm();
        let mut t = foot.clamp(low, high);
        for _ in 0..ROUNDS {
            let off = t - foot;
            let rho = (aside + off * off).sqrt();
            let out = rho - cutter.disc_mm();
            let (mut z, mut rise) = (self.from[2] + self.slope * t, self.slope);
            if out > 0.0 {
                let root = ((r - out) * (r + out)).max(1e-300).sqrt();
                z += r - root;
                rise += out / root * off / rho;
            }
            // It lies above its tangents.
            let bound = z + (rise * (low - t)).min(rise * (high - t));
            if bound >= ceiling_mm {
                return None;
            }
            if z - bound < NEAR_MM {
                break;
            }
            if rise < 0.0 {
                low = t;
            } else {
                high = t;
            }
            t = f64::midpoint(low, high);
        }
        Some(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cutter_leaves_what_the_least_of_many_places_leaves() {
        for cutter in ["flat:6", "ball:6", "bull:6:1"] {
            let cutter: Cutter = cutter.parse().unwrap();
            for (a, b) in [
                ([0.0, 0.0, 1.0], [5.0, 1.0, 1.0]),
                ([0.0, 0.0, 1.0], [5.0, -2.0, 4.0]),
                ([-1.0, 0.5, 3.0], [1.0, 4.0, -2.0]),
                ([1.0, 1.0, 3.0], [1.0, 1.0, 2.0]),
            ] {
                let way = Way::new(a, b);
                for at in [[0.5, 0.7], [2.0, -1.9], [2.5, 2.9], [4.0, 0.1]] {
                    let forced = (0..=100_000)
                        .filter_map(|k| {
                            let share = f64::from(k) / 1e5;
                            let p: [f64; 3] = std::array::from_fn(|i| a[i] + share * (b[i] - a[i]));
                            let rho = libm::hypot(p[0] - at[0], p[1] - at[1]);
                            cutter.height_mm(rho).map(|h| p[2] + h)
                        })
                        .fold(f64::INFINITY, f64::min);
                    let left = way.leaves(&cutter, at, f64::INFINITY);
                    let Some((left, t)) = left else {
                        assert_eq!(forced, f64::INFINITY, "{cutter} {a:?} {at:?}");
                        continue;
                    };
                    // Places miss the rim by a step of the way.
                    let missed = forced - left;
                    assert!((-1e-9..2e-4).contains(&missed), "{cutter} {at:?}: {missed}");
                    let [x, y, z] = way.tip_mm(t);
                    let rho = libm::hypot(x - at[0], y - at[1]);
                    assert!((z + cutter.profile(rho) - left).abs() < 1e-12);
                    assert_eq!(way.leaves(&cutter, at, left), None);
                }
            }
        }
    }
}
