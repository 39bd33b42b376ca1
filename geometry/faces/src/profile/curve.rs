//! Straight lines and circular arcs through stations of a profile.

use super::stations::Station;

/// Rounds of Newton's method for the least root, and change at which it has ended.
const ROUNDS: usize = 20;
const ENDED: f64 = 1e-10;

/// A piece of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Curve {
    /// Through a point (s, t), with a unit normal.
    Line { through: [f64; 2], normal: [f64; 2] },
    /// With a centre (s, t); `side` is 1 where it lies below the arc, -1 where above.
    Arc {
        centre: [f64; 2],
        radius_mm: f64,
        side: f64,
    },
}

impl Curve {
    /// How many numbers it has.
    pub(super) fn freedom(&self) -> f64 {
        match self {
            Self::Line { .. } => 2.0,
            Self::Arc { .. } => 3.0,
        }
    }

    /// How far a point lies above it along its normal, and its slope there.
    pub(super) fn off(&self, s_mm: f64, t_mm: f64) -> (f64, f64) {
        match self {
            Self::Line { through, normal } => (
                (s_mm - through[0]) * normal[0] + (t_mm - through[1]) * normal[1],
                -normal[0] / normal[1].max(f64::MIN_POSITIVE),
            ),
            Self::Arc {
                centre,
                radius_mm,
                side,
            } => {
                let (s, t) = (s_mm - centre[0], t_mm - centre[1]);
                let off = side * (libm::hypot(s, t) - radius_mm);
                (off, -s / t.abs().max(1e-6 * radius_mm) * side)
            }
        }
    }

    /// Its t at s; `None` beyond the ends of a circle.
    pub(super) fn height(&self, s_mm: f64) -> Option<f64> {
        match self {
            Self::Line { through, normal } => {
                Some(through[1] - (s_mm - through[0]) * normal[0] / normal[1])
            }
            Self::Arc {
                centre,
                radius_mm,
                side,
            } => {
                let s = s_mm - centre[0];
                let left = radius_mm * radius_mm - s * s;
                (left >= 0.0).then(|| centre[1] + side * left.sqrt())
            }
        }
    }
}

/// Weighted moments of stations; with z = s^2 + t^2.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Moments {
    all: f64,
    s: f64,
    t: f64,
    ss: f64,
    st: f64,
    tt: f64,
    sz: f64,
    tz: f64,
    zz: f64,
}

impl Moments {
    fn combined(&self, other: &Self, sign: f64) -> Self {
        Self {
            all: self.all + sign * other.all,
            s: self.s + sign * other.s,
            t: self.t + sign * other.t,
            ss: self.ss + sign * other.ss,
            st: self.st + sign * other.st,
            tt: self.tt + sign * other.tt,
            sz: self.sz + sign * other.sz,
            tz: self.tz + sign * other.tz,
            zz: self.zz + sign * other.zz,
        }
    }

    /// With one more station.
    pub(super) fn with(&self, station: &Station) -> Self {
        let (s, t, w) = (station.s_mm, station.t_mm, station.weight);
        let z = s * s + t * t;
        let own = Self {
            all: w,
            s: w * s,
            t: w * t,
            ss: w * s * s,
            st: w * s * t,
            tt: w * t * t,
            sz: w * s * z,
            tz: w * t * z,
            zz: w * z * z,
        };
        self.combined(&own, 1.0)
    }

    /// Of those that another does not hold.
    pub(super) fn without(&self, other: &Self) -> Self {
        self.combined(other, -1.0)
    }

    /// Mean moments about the middle, and the middle.
    fn centred(&self) -> ([f64; 2], Self) {
        let w = self.all;
        let (a, b) = (self.s / w, self.t / w);
        let (ss, st, tt) = (
            self.ss / w - a * a,
            self.st / w - a * b,
            self.tt / w - b * b,
        );
        // z of a centred point is z - 2 a s - 2 b t + c of the point itself.
        let c = a * a + b * b;
        let (z, sz, tz) = ((self.ss + self.tt) / w, self.sz / w, self.tz / w);
        let (raw_ss, raw_st, raw_tt) = (self.ss / w, self.st / w, self.tt / w);
        let along_s = sz - 2.0 * a * raw_ss - 2.0 * b * raw_st + c * a;
        let along_t = tz - 2.0 * a * raw_st - 2.0 * b * raw_tt + c * b;
        let plain = z - 2.0 * a * a - 2.0 * b * b + c;
        let zz = self.zz / w + 4.0 * a * a * raw_ss + 4.0 * b * b * raw_tt + c * c
            - 4.0 * a * sz
            - 4.0 * b * tz
            + 2.0 * c * z
            + 8.0 * a * b * raw_st
            - 4.0 * a * c * a
            - 4.0 * b * c * b;
        let own = Self {
            all: 1.0,
            s: 0.0,
            t: 0.0,
            ss,
            st,
            tt,
            sz: along_s - a * plain,
            tz: along_t - b * plain,
            zz,
        };
        ([a, b], own)
    }

    /// The straight line nearest to the stations, and the weighted squares that it leaves.
    pub(super) fn line(&self) -> (Curve, f64) {
        let (through, m) = self.centred();
        let half = 0.5 * (m.ss - m.tt);
        let root = libm::hypot(half, m.st);
        // The direction of most spread; with t single valued in s, it grows with s.
        let angle = 0.5 * libm::atan2(m.st, half);
        let (sin, cos) = libm::sincos(angle);
        let normal = if cos < 0.0 { [sin, -cos] } else { [-sin, cos] };
        let least = (0.5 * (m.ss + m.tt) - root).max(0.0);
        (Curve::Line { through, normal }, least * self.all)
    }

    /// The circle nearest to the stations and the weighted squares that it leaves (Pratt 1987,
    /// "Direct least-squares fitting of algebraic surfaces"; solved as Chernov 2010 does). `None`
    /// where it is a line, or not to be told.
    pub(super) fn circle(&self) -> Option<([f64; 2], f64, f64)> {
        let (middle, m) = self.centred();
        let z = m.ss + m.tt;
        let area = m.ss * m.tt - m.st * m.st;
        let a2 = 4.0 * area - 3.0 * z * z - m.zz;
        let a1 = m.zz * z + 4.0 * area * z - m.sz * m.sz - m.tz * m.tz - z * z * z;
        let a0 = m.sz * m.sz * m.tt + m.tz * m.tz * m.ss - m.zz * area - 2.0 * m.sz * m.tz * m.st
            + z * z * area;
        let mut x = 0.0_f64;
        for _ in 0..ROUNDS {
            let slope = a1 + x * (2.0 * a2 + 16.0 * x * x);
            let value = a0 + x * (a1 + x * (a2 + 4.0 * x * x));
            let next = x - value / slope;
            if !next.is_finite() || next < 0.0 {
                break;
            }
            let has_ended = (next - x).abs() <= ENDED * next;
            x = next;
            if has_ended {
                break;
            }
        }
        let det = x * x - x * z + area;
        let s = 0.5 * (m.sz * (m.tt - x) - m.tz * m.st) / det;
        let t = 0.5 * (m.tz * (m.ss - x) - m.sz * m.st) / det;
        let radius_mm = (s * s + t * t + z + 2.0 * x).sqrt();
        let centre = [middle[0] + s, middle[1] + t];
        (radius_mm.is_finite() && det != 0.0).then_some((centre, radius_mm, x * self.all))
    }

    /// The arc between two s, and the weighted squares that it leaves. `None` where the circle
    /// does not reach so far.
    pub(super) fn arc(&self, low_mm: f64, high_mm: f64) -> Option<(Curve, f64)> {
        let (centre, radius_mm, left) = self.circle()?;
        let reaches =
            (low_mm - centre[0]).abs() < radius_mm && (high_mm - centre[0]).abs() < radius_mm;
        let side = if self.t / self.all < centre[1] {
            -1.0
        } else {
            1.0
        };
        let arc = Curve::Arc {
            centre,
            radius_mm,
            side,
        };
        reaches.then_some((arc, left))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(t_mm: impl Fn(f64) -> f64, low: i32, high: i32) -> Moments {
        (low..high).fold(Moments::default(), |sum, k| {
            let s_mm = 0.2 * f64::from(k);
            let (t_mm, slope) = (t_mm(s_mm), 0.0);
            sum.with(&Station {
                s_mm,
                t_mm,
                slope,
                weight: 1e4,
            })
        })
    }

    #[test]
    fn a_circle_is_found_from_a_short_arc_far_away() {
        let on = |s: f64| 40.0 - libm::sqrt(25.0 - (s - 30.0) * (s - 30.0));
        let (arc, left) = moments(on, 140, 160).arc(28.0, 31.8).unwrap();
        let Curve::Arc {
            centre,
            radius_mm,
            side,
        } = arc
        else {
            panic!("{arc:?}")
        };
        assert!((radius_mm - 5.0).abs() < 1e-6 && side < 0.0, "{arc:?}");
        assert!(
            (centre[0] - 30.0).abs() < 1e-6 && (centre[1] - 40.0).abs() < 1e-6,
            "{arc:?}"
        );
        assert!(left < 1e-4, "{left}");
        assert!((arc.height(30.0).unwrap() - 35.0).abs() < 1e-6);
        let (off, slope) = arc.off(33.0, on(33.0) + 0.01);
        assert!(
            (slope - 0.75).abs() < 0.01 && (off - 0.008).abs() < 1e-4,
            "{off} {slope}"
        );
        assert!(moments(on, 140, 160).arc(28.0, 36.0).is_none());
    }

    #[test]
    fn what_is_left_is_that_of_the_distances() {
        let rough = |s: f64| 3.0 + 0.4 * s + 0.02 * libm::sin(40.0 * s);
        let all = moments(rough, 0, 300);
        let (line, left) = all.line();
        let squares = |curve: &Curve| {
            let off = (0..300).map(|k| curve.off(0.2 * f64::from(k), rough(0.2 * f64::from(k))).0);
            off.map(|off| 1e4 * off * off).sum::<f64>()
        };
        assert!((left / squares(&line) - 1.0).abs() < 1e-6, "{left}");
        assert!((line.off(1.0, 1.0).1 - 0.4).abs() < 1e-3);
        let (arc, left) = all.arc(0.0, 60.0).unwrap();
        assert!((left / squares(&arc) - 1.0).abs() < 1e-3, "{left} {arc:?}");
    }
}
