//! Points, lines and circles in the plan.

use std::f64::consts::{PI, TAU};

/// A point or a direction in the plan.
pub(crate) type P2 = [f64; 2];

/// Circle and line nearer to touching than this count as touching, millimetres.
const TOUCH_MM: f64 = 1e-7;

pub(crate) fn add(a: P2, b: P2) -> P2 {
    [a[0] + b[0], a[1] + b[1]]
}

pub(crate) fn sub(a: P2, b: P2) -> P2 {
    [a[0] - b[0], a[1] - b[1]]
}

pub(crate) fn scale(a: P2, by: f64) -> P2 {
    [a[0] * by, a[1] * by]
}

pub(crate) fn dot(a: P2, b: P2) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub(crate) fn cross(a: P2, b: P2) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

pub(crate) fn norm(a: P2) -> f64 {
    libm::hypot(a[0], a[1])
}

pub(crate) fn distance(a: P2, b: P2) -> f64 {
    norm(sub(a, b))
}

pub(crate) fn unit(a: P2) -> P2 {
    scale(a, 1.0 / norm(a))
}

/// Turned by a right angle, counter-clockwise.
pub(crate) fn left(a: P2) -> P2 {
    [-a[1], a[0]]
}

pub(crate) fn polar(angle: f64) -> P2 {
    [libm::cos(angle), libm::sin(angle)]
}

/// The angle of a direction, from 0 to below a full turn.
pub(crate) fn angle(a: P2) -> f64 {
    positive(libm::atan2(a[1], a[0]))
}

/// An angle brought to 0 to below a full turn.
pub(crate) fn positive(angle: f64) -> f64 {
    let rest = angle % TAU;
    let rest = if rest < 0.0 { rest + TAU } else { rest };
    if rest >= TAU { 0.0 } else { rest }
}

/// What pieces of outlines lie on. Lines run along `d`, circles counter-clockwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Support {
    /// A point of the line and its unit direction; the parameter is a length.
    Line { p: P2, d: P2 },
    /// Centre and radius; the parameter is an angle.
    Circle { c: P2, r: f64 },
}

/// Where two supports meet.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Meeting {
    Apart,
    Points(Vec<P2>),
    /// They touch; along `reach` to both sides they are as good as one.
    Touch {
        at: P2,
        reach: f64,
    },
}

impl Support {
    pub(crate) fn line(from: P2, to: P2) -> Self {
        Self::Line {
            p: from,
            d: unit(sub(to, from)),
        }
    }

    pub(crate) fn at(&self, t: f64) -> P2 {
        match *self {
            Self::Line { p, d } => add(p, scale(d, t)),
            Self::Circle { c, r } => add(c, scale(polar(t), r)),
        }
    }

    /// Unit tangent in the sense of the parameter.
    pub(crate) fn tangent(&self, t: f64) -> P2 {
        match *self {
            Self::Line { d, .. } => d,
            Self::Circle { .. } => left(polar(t)),
        }
    }

    pub(crate) fn parameter(&self, at: P2) -> f64 {
        match *self {
            Self::Line { p, d } => dot(sub(at, p), d),
            Self::Circle { c, .. } => angle(sub(at, c)),
        }
    }

    pub(crate) fn distance(&self, at: P2) -> f64 {
        match *self {
            Self::Line { p, d } => cross(d, sub(at, p)).abs(),
            Self::Circle { c, r } => (distance(at, c) - r).abs(),
        }
    }

    /// Length of a step of 1 of the parameter.
    pub(crate) fn speed(&self) -> f64 {
        match *self {
            Self::Line { .. } => 1.0,
            Self::Circle { r, .. } => r,
        }
    }

    pub(crate) fn meet(&self, other: &Self) -> Meeting {
        match (*self, *other) {
            (Self::Line { p, d }, Self::Line { p: q, d: e }) => {
                let sine = cross(d, e);
                if sine.abs() < 1e-9 {
                    return Meeting::Apart;
                }
                let t = cross(sub(q, p), e) / sine;
                Meeting::Points(vec![add(p, scale(d, t))])
            }
            (Self::Line { p, d }, Self::Circle { c, r })
            | (Self::Circle { c, r }, Self::Line { p, d }) => {
                let foot = add(p, scale(d, dot(sub(c, p), d)));
                let off = distance(foot, c);
                chords(r - off, r + off, foot, d, r)
            }
            (Self::Circle { c, r }, Self::Circle { c: e, r: s }) => {
                let apart = distance(c, e);
                if apart < 1e-9 {
                    return Meeting::Apart;
                }
                let u = unit(sub(e, c));
                let reach = r.min(s);
                // Nearest and farthest sums of the triangle of both radii and the centres.
                let gaps = [r + s - apart, apart - (r - s).abs()];
                if gaps[0] < -TOUCH_MM || gaps[1] < -TOUCH_MM {
                    return Meeting::Apart;
                }
                if gaps[0] < TOUCH_MM {
                    return touch(add(c, scale(u, r)), reach);
                }
                if gaps[1] < TOUCH_MM {
                    let side = if r > s { 1.0 } else { -1.0 };
                    // One within the other: nearly equal ones are as good as one for long.
                    let reach = reach * r.max(s) / (r - s).abs().max(TOUCH_MM);
                    return touch(add(c, scale(u, side * r)), reach);
                }
                let along = (apart * apart + r * r - s * s) / (2.0 * apart);
                let half = (r * r - along * along).max(0.0).sqrt();
                let foot = add(c, scale(u, along));
                let n = scale(left(u), half);
                Meeting::Points(vec![sub(foot, n), add(foot, n)])
            }
        }
    }
}

fn touch(at: P2, radius: f64) -> Meeting {
    Meeting::Touch {
        at,
        reach: 2.0 * (2.0 * radius * TOUCH_MM).sqrt(),
    }
}

/// Where a line crosses a circle whose centre has the foot `foot` on it.
fn chords(gap: f64, sum: f64, foot: P2, d: P2, r: f64) -> Meeting {
    if gap < -TOUCH_MM {
        return Meeting::Apart;
    }
    if gap < TOUCH_MM {
        return touch(foot, r);
    }
    let half = (gap * sum).sqrt();
    let h = scale(d, half);
    Meeting::Points(vec![sub(foot, h), add(foot, h)])
}

/// A piece of an outline between two points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Piece {
    /// A straight line.
    Line {
        /// Where it begins, millimetres.
        from: [f64; 2],
        /// Where it ends, millimetres.
        to: [f64; 2],
    },
    /// A circular arc, less than a full turn.
    Arc {
        /// Where it begins, millimetres.
        from: [f64; 2],
        /// Where it ends, millimetres.
        to: [f64; 2],
        /// The centre of its circle, millimetres.
        center: [f64; 2],
        /// It runs counter-clockwise.
        ccw: bool,
    },
}

impl Piece {
    /// Where it begins.
    #[must_use]
    pub fn from(&self) -> [f64; 2] {
        let (Self::Line { from, .. } | Self::Arc { from, .. }) = *self;
        from
    }

    /// Where it ends.
    #[must_use]
    pub fn to(&self) -> [f64; 2] {
        let (Self::Line { to, .. } | Self::Arc { to, .. }) = *self;
        to
    }

    pub(crate) fn support(&self) -> Support {
        match *self {
            Self::Line { from, to } => Support::line(from, to),
            Self::Arc {
                from, to, center, ..
            } => Support::Circle {
                c: center,
                r: 0.5 * (distance(from, center) + distance(to, center)),
            },
        }
    }

    /// The angle that an arc turns through, signed; 0 of a line.
    pub(crate) fn sweep(&self) -> f64 {
        match *self {
            Self::Line { .. } => 0.0,
            Self::Arc {
                from,
                to,
                center,
                ccw,
            } => {
                let turn = positive(angle(sub(to, center)) - angle(sub(from, center)));
                if ccw { turn } else { -positive(-turn) }
            }
        }
    }

    pub(crate) fn length(&self) -> f64 {
        match *self {
            Self::Line { from, to } => distance(from, to),
            Self::Arc { from, center, .. } => distance(from, center) * self.sweep().abs(),
        }
    }

    /// The point at a part of the length, 0 to 1.
    pub(crate) fn at(&self, part: f64) -> P2 {
        match *self {
            Self::Line { from, to } => add(from, scale(sub(to, from), part)),
            Self::Arc { from, center, .. } => {
                let from = sub(from, center);
                let turned = angle(from) + part * self.sweep();
                add(center, scale(polar(turned), norm(from)))
            }
        }
    }

    /// Unit tangent at a part of the length, 0 to 1.
    pub(crate) fn tangent(&self, part: f64) -> P2 {
        match *self {
            Self::Line { from, to } => unit(sub(to, from)),
            Self::Arc { center, ccw, .. } => {
                let along = left(unit(sub(self.at(part), center)));
                if ccw { along } else { scale(along, -1.0) }
            }
        }
    }

    /// The same piece run the other way.
    pub(crate) fn reversed(&self) -> Self {
        match *self {
            Self::Line { from, to } => Self::Line { from: to, to: from },
            Self::Arc {
                from,
                to,
                center,
                ccw,
            } => Self::Arc {
                from: to,
                to: from,
                center,
                ccw: !ccw,
            },
        }
    }

    /// What it adds to the area within a loop.
    pub(crate) fn area(&self) -> f64 {
        let chord = 0.5 * cross(self.from(), self.to());
        match *self {
            Self::Line { .. } => chord,
            Self::Arc { from, center, .. } => {
                let (r, sweep) = (distance(from, center), self.sweep());
                chord + 0.5 * r * r * (sweep - libm::sin(sweep))
            }
        }
    }

    /// The angle by which the direction from a point to the piece turns along it.
    fn winding(&self, seen_from: P2) -> f64 {
        let (a, b) = (sub(self.from(), seen_from), sub(self.to(), seen_from));
        let straight = libm::atan2(cross(a, b), dot(a, b));
        let Self::Arc {
            from, center, ccw, ..
        } = *self
        else {
            return straight;
        };
        let in_circle = distance(seen_from, center) < distance(from, center);
        // From within its circle an arc is always seen to turn in its own sense.
        match (in_circle, ccw) {
            (true, true) if straight < 0.0 => straight + TAU,
            (true, false) if straight > 0.0 => straight - TAU,
            _ => straight,
        }
    }
}

/// Area within a loop, positive if it runs counter-clockwise.
pub(crate) fn area(pieces: &[Piece]) -> f64 {
    pieces.iter().map(Piece::area).sum()
}

/// A point that is not on the loop is within it.
pub(crate) fn encloses(pieces: &[Piece], at: P2) -> bool {
    let turn: f64 = pieces.iter().map(|piece| piece.winding(at)).sum();
    turn.abs() > PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn supports_meet_where_they_do() {
        let line = Support::line([0.0, 3.0], [1.0, 3.0]);
        let circle = Support::Circle {
            c: [2.0, 0.0],
            r: 5.0,
        };
        let Meeting::Points(points) = line.meet(&circle) else {
            panic!("no points");
        };
        assert!(distance(points[0], [-2.0, 3.0]) < 1e-12);
        assert!(distance(points[1], [6.0, 3.0]) < 1e-12);
        let small = Support::Circle {
            c: [2.0, 3.0],
            r: 2.0,
        };
        let Meeting::Touch { at, .. } = circle.meet(&small) else {
            panic!("{:?}", circle.meet(&small));
        };
        assert!(distance(at, [2.0, 5.0]) < 1e-12);
        let far = Support::Circle {
            c: [2.0, 8.0],
            r: 2.0,
        };
        assert_eq!(circle.meet(&far), Meeting::Apart);
    }

    #[test]
    fn a_half_disc() {
        let arc = Piece::Arc {
            from: [2.0, 0.0],
            to: [-2.0, 0.0],
            center: [0.0, 0.0],
            ccw: true,
        };
        let half = [
            arc,
            Piece::Line {
                from: [-2.0, 0.0],
                to: [2.0, 0.0],
            },
        ];
        assert!((area(&half) - 2.0 * PI).abs() < 1e-12);
        for (at, inside) in [
            ([0.0, 1.9], true),
            ([1.0, 0.1], true),
            ([0.0, -0.1], false),
            ([1.9, 1.9], false),
            ([0.0, 2.1], false),
        ] {
            assert_eq!(encloses(&half, at), inside, "{at:?}");
        }
        // A place on the chord of an arc, of a ring's half.
        let ring = [
            Piece::Line {
                from: [-2.0, 0.0],
                to: [-3.0, 0.0],
            },
            Piece::Arc {
                from: [-3.0, 0.0],
                to: [3.0, 0.0],
                center: [0.0; 2],
                ccw: true,
            },
            Piece::Line {
                from: [3.0, 0.0],
                to: [2.0, 0.0],
            },
            Piece::Arc {
                from: [2.0, 0.0],
                to: [-2.0, 0.0],
                center: [0.0; 2],
                ccw: false,
            },
        ];
        assert!(!encloses(&ring, [0.5, 0.0]) && encloses(&ring, [0.5, -2.5]));
        let back: Vec<Piece> = half.iter().rev().map(Piece::reversed).collect();
        assert!((area(&back) + 2.0 * PI).abs() < 1e-12);
        assert!(encloses(&back, [0.0, 1.9]) && !encloses(&back, [0.0, 2.1]));
    }
}
