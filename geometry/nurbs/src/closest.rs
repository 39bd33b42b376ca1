//! The point of a curve or a surface nearest to a place (Piegl & Tiller 1997, section 6.1): Newton's
//! method on the squared distance, with steps that lower it.

use crate::curve::BSplineCurve;
use crate::surface::BSplineSurface;

/// Newton steps, and halvings of a step that leads away.
const STEPS: usize = 30;
const HALVINGS: usize = 12;

/// A step is the last where it moves the point by less than this part of the distance that numbers
/// of its size tell apart.
const STILL: f64 = 1e-13;

/// Places of each span and degree at which a search begins.
const STARTS: usize = 2;

/// A place found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest<T> {
    /// Its parameter, or parameters.
    pub at: T,
    /// How far it is, in the unit of the control points.
    pub distance: f64,
}

fn dot<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    a.iter().zip(&b).map(|(a, b)| a * b).sum()
}

fn minus<const D: usize>(a: [f64; D], b: [f64; D]) -> [f64; D] {
    core::array::from_fn(|d| a[d] - b[d])
}

/// Parameters to begin at: even parts of each span, and its ends.
fn starts(breaks: &[f64], degree: usize) -> Vec<f64> {
    let parts = STARTS * degree;
    let within = breaks.windows(2).flat_map(|pair| {
        let share = move |k: usize| k as f64 / parts as f64;
        (0..parts).map(move |k| pair[0] + (pair[1] - pair[0]) * share(k))
    });
    within.chain(breaks.last().copied()).collect()
}

impl<const D: usize> BSplineCurve<D> {
    /// The nearest point to a place, looked for all along the curve.
    #[must_use]
    pub fn closest(&self, place: [f64; D]) -> Closest<f64> {
        let starts = starts(&self.knots().breaks(), self.knots().degree());
        let off: Vec<f64> = starts.iter().map(|t| self.squared(place, *t)).collect();
        // Every place that is nearer than its neighbours may lead to the nearest.
        let is_low = |k: usize| {
            let before = k.checked_sub(1).is_none_or(|b| off[b] >= off[k]);
            before && off.get(k + 1).is_none_or(|after| *after >= off[k])
        };
        let found = (0..starts.len()).filter(|k| is_low(*k));
        let found = found.map(|k| self.closest_from(place, starts[k]));
        let nearest = found.min_by(|a, b| a.distance.total_cmp(&b.distance));
        nearest.unwrap_or_else(|| self.closest_from(place, self.knots().domain().0))
    }

    /// The nearest point to a place around a parameter.
    #[must_use]
    pub fn closest_from(&self, place: [f64; D], start: f64) -> Closest<f64> {
        let (first, last) = self.knots().domain();
        let mut t = start.clamp(first, last);
        let mut off = self.squared(place, t);
        for _ in 0..STEPS {
            let r = minus(self.evaluate(t), place);
            let (along, bend) = (self.derivative(t, 1), self.derivative(t, 2));
            let speed = dot(along, along);
            let curved = speed + dot(r, bend);
            let step = -dot(r, along) / if curved > 0.1 * speed { curved } else { speed };
            let moved = |share: f64| (t + share * step).clamp(first, last);
            let Some((next, nearer)) = lower(off, |share| {
                let next = moved(share);
                (next, self.squared(place, next))
            }) else {
                break;
            };
            let by = (next - t).abs() * speed.sqrt();
            (t, off) = (next, nearer);
            if by <= STILL * (1.0 + off.sqrt()) {
                break;
            }
        }
        Closest {
            at: t,
            distance: off.sqrt(),
        }
    }

    fn squared(&self, place: [f64; D], t: f64) -> f64 {
        let r = minus(self.evaluate(t), place);
        dot(r, r)
    }
}

impl<const D: usize> BSplineSurface<D> {
    /// The nearest point to a place, looked for all over the surface.
    #[must_use]
    pub fn closest(&self, place: [f64; D]) -> Closest<[f64; 2]> {
        let of = |knots: &crate::KnotVector| starts(&knots.breaks(), knots.degree());
        let (us, vs) = (of(self.u_knots()), of(self.v_knots()));
        let at = |k: usize| [us[k / vs.len()], vs[k % vs.len()]];
        let all = 0..us.len() * vs.len();
        let off: Vec<f64> = all.clone().map(|k| self.squared(place, at(k))).collect();
        let is_low = |k: usize| {
            let (i, j) = (k / vs.len(), k % vs.len());
            let near = |i: usize, j: usize| {
                let is_inside = i < us.len() && j < vs.len();
                !is_inside || off[i * vs.len() + j] >= off[k]
            };
            near(i.wrapping_sub(1), j)
                && near(i + 1, j)
                && near(i, j.wrapping_sub(1))
                && near(i, j + 1)
        };
        let found = all
            .filter(|k| is_low(*k))
            .map(|k| self.closest_from(place, at(k)));
        let nearest = found.min_by(|a, b| a.distance.total_cmp(&b.distance));
        nearest.unwrap_or_else(|| self.closest_from(place, [us[0], vs[0]]))
    }

    /// The nearest point to a place around parameters.
    #[must_use]
    pub fn closest_from(&self, place: [f64; D], start: [f64; 2]) -> Closest<[f64; 2]> {
        let domains = [self.u_knots().domain(), self.v_knots().domain()];
        let inside = |at: [f64; 2]| [0, 1].map(|d| at[d].clamp(domains[d].0, domains[d].1));
        let mut at = inside(start);
        let mut off = self.squared(place, at);
        for _ in 0..STEPS {
            let r = minus(self.evaluate(at[0], at[1]), place);
            let part = |a: usize, b: usize| self.partial(at[0], at[1], a, b);
            let (su, sv) = (part(1, 0), part(0, 1));
            let slope = [dot(r, su), dot(r, sv)];
            let plain = [dot(su, su), dot(su, sv), dot(sv, sv)];
            let bend = [part(2, 0), part(1, 1), part(0, 2)].map(|second| dot(r, second));
            let full = [0, 1, 2].map(|k| plain[k] + bend[k]);
            // At an end of the domain that the slope leads out of, along the other parameter only.
            let is_held = |d: usize| {
                let (first, last) = domains[d];
                (at[d] <= first && slope[d] > 0.0) || (at[d] >= last && slope[d] < 0.0)
            };
            let step = newton(slope, full, plain, [is_held(0), is_held(1)]);
            let Some((next, nearer)) = lower(off, |share| {
                let next = inside([0, 1].map(|d| at[d] + share * step[d]));
                (next, self.squared(place, next))
            }) else {
                break;
            };
            let by = [0, 1].map(|d| (next[d] - at[d]).abs());
            let by = by[0] * plain[0].sqrt() + by[1] * plain[2].sqrt();
            (at, off) = (next, nearer);
            if by <= STILL * (1.0 + off.sqrt()) {
                break;
            }
        }
        Closest {
            at,
            distance: off.sqrt(),
        }
    }

    fn squared(&self, place: [f64; D], at: [f64; 2]) -> f64 {
        let r = minus(self.evaluate(at[0], at[1]), place);
        dot(r, r)
    }
}

/// The first of the steps, each half the one before, that lowers what it leads to.
fn lower<T>(than: f64, step: impl Fn(f64) -> (T, f64)) -> Option<(T, f64)> {
    let mut share = 1.0;
    for _ in 0..HALVINGS {
        let (next, off) = step(share);
        if off < than {
            return Some((next, off));
        }
        share /= 2.0;
    }
    None
}

/// Newton's step, or that of Gauss and Newton where the squared distance does not bend upwards;
/// matrices by their elements uu, uv and vv.
fn newton(slope: [f64; 2], full: [f64; 3], plain: [f64; 3], held: [bool; 2]) -> [f64; 2] {
    let solve = |[a, b, c]: [f64; 3]| {
        let b = if held[0] || held[1] { 0.0 } else { b };
        let determinant = a * c - b * b;
        let is_up = a > 0.0 && c > 0.0 && determinant > 1e-9 * a * c;
        let step = [b * slope[1] - c * slope[0], b * slope[0] - a * slope[1]];
        is_up.then(|| step.map(|s| s / determinant))
    };
    let along = [plain[0], plain[2]];
    let steepest = || {
        [0, 1].map(|d| {
            if along[d] > 0.0 {
                -slope[d] / along[d]
            } else {
                0.0
            }
        })
    };
    let step = solve(full)
        .or_else(|| solve(plain))
        .unwrap_or_else(steepest);
    [0, 1].map(|d| if held[d] { 0.0 } else { step[d] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::KnotVector;

    #[test]
    fn the_nearest_point_of_a_line_and_of_a_parabola() {
        let line = KnotVector::uniform(1, 2, 0.0, 2.0).unwrap();
        let line = BSplineCurve::new(line, vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]).unwrap();
        let found = line.closest([1.3, -2.0]);
        assert!((found.at - 1.3).abs() < 1e-9 && (found.distance - 2.0).abs() < 1e-12);
        assert_eq!(
            line.closest([5.0, 4.0]),
            Closest {
                at: 2.0,
                distance: 5.0
            }
        );
        // (t, t^2) on -2..2: from (0, 4) the nearest points are at t^2 = 3.5.
        let knots = KnotVector::uniform(2, 1, -2.0, 2.0).unwrap();
        let parabola =
            BSplineCurve::new(knots, vec![[-2.0, 4.0], [0.0, -4.0], [2.0, 4.0]]).unwrap();
        let found = parabola.closest([0.1, 4.0]);
        let off = |t: f64| libm::hypot(t - 0.1, t * t - 4.0);
        assert!(found.at > 0.0 && (found.at * found.at - 3.5).abs() < 0.1);
        let beside = [-1e-4, 1e-4].map(|by| off(found.at + by));
        assert!(beside.iter().all(|beside| *beside > found.distance));
        assert!((off(found.at) - found.distance).abs() < 1e-12);
    }

    /// The graph of x y over -1..1 squared.
    fn saddle() -> BSplineSurface {
        let knots = KnotVector::uniform(2, 3, -1.0, 1.0).unwrap();
        let count = knots.control_count();
        let points = (0..count * count).map(|k| {
            let (x, y) = (knots.greville(k / count), knots.greville(k % count));
            [x, y, x * y]
        });
        BSplineSurface::new(knots.clone(), knots.clone(), points.collect()).unwrap()
    }

    #[test]
    fn places_off_a_surface_along_its_normal_are_led_back() {
        let surface = saddle();
        for (u, v, by) in [(0.3, -0.6, 0.2), (-0.9, 0.9, -0.1), (0.0, 0.0, 0.4)] {
            let normal = [-v, -u, 1.0];
            let length = dot(normal, normal).sqrt();
            let on = surface.evaluate(u, v);
            let place = core::array::from_fn(|d| on[d] + by * normal[d] / length);
            let found = surface.closest(place);
            assert!((found.distance - f64::abs(by)).abs() < 1e-10, "{found:?}");
            assert!((found.at[0] - u).abs() < 1e-6 && (found.at[1] - v).abs() < 1e-6);
        }
    }

    /// A wavy surface whose sides are neither straight nor at right angles.
    fn slanted() -> BSplineSurface {
        let knots = KnotVector::uniform(3, 3, 0.0, 1.0).unwrap();
        let count = knots.control_count();
        let points = (0..count * count).map(|k| {
            let (i, j) = ((k / count) as f64, (k % count) as f64);
            [i + 0.8 * j, j, libm::sin(1.3 * i) * libm::cos(0.9 * j)]
        });
        BSplineSurface::new(knots.clone(), knots.clone(), points.collect()).unwrap()
    }

    #[test]
    fn all_around_a_surface_nothing_is_nearer_than_what_is_found() {
        let surface = slanted();
        let share = |k: usize| k as f64 / 60.0;
        let dense: Vec<[f64; 3]> = (0..61 * 61)
            .map(|k| surface.evaluate(share(k / 61), share(k % 61)))
            .collect();
        let mut state: u64 = 7;
        let mut draw = |low: f64, high: f64| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            low + (high - low) * (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for _ in 0..300 {
            let place = [draw(-3.0, 13.0), draw(-3.0, 9.0), draw(-3.0, 3.0)];
            let off = dense
                .iter()
                .map(|on| dot(minus(*on, place), minus(*on, place)));
            let nearest = off.fold(f64::INFINITY, f64::min).sqrt();
            let found = surface.closest(place);
            assert!(
                found.distance <= nearest + 1e-9,
                "{place:?}: {found:?} {nearest}"
            );
            // Along what is free the distance has no slope.
            let r = minus(surface.evaluate(found.at[0], found.at[1]), place);
            for (d, (a, b)) in [(1, 0), (0, 1)].into_iter().enumerate() {
                let along = surface.partial(found.at[0], found.at[1], a, b);
                let slope = dot(r, along) / dot(along, along).sqrt();
                let leads_out =
                    (found.at[d] <= 0.0 && slope > 0.0) || (found.at[d] >= 1.0 && slope < 0.0);
                assert!(
                    leads_out || slope.abs() < 1e-5,
                    "{place:?}: {found:?} {slope}"
                );
            }
        }
    }

    #[test]
    fn beyond_the_border_the_nearest_point_is_on_it() {
        let found = saddle().closest([1.5, 0.0, 0.0]);
        assert_eq!(found.at[0], 1.0);
        // Of the border line (1, v, v) the nearest to (1.5, 0, 0) is at v = 0.
        assert!(found.at[1].abs() < 1e-7 && (found.distance - 0.5).abs() < 1e-12);
    }
}
