//! Whether a node has samples enough around it.

use crate::neighbours::Neighbour;
use crate::settings::SupportSettings;
use crate::window::Spacing;

/// Samples near a node, in units of the local spacing.
#[derive(Debug, Default)]
pub(crate) struct Surroundings {
    /// Those last looked at, with their places in the window.
    near: Vec<(usize, (f64, f64))>,
    points: Vec<(f64, f64)>,
    others: Vec<(f64, f64)>,
}

/// More than rounding adds to a square.
const UP: f64 = 1.0 + 1e-9;

impl Surroundings {
    /// Where the node lies among the samples near it, whatever they agree on. The window's samples
    /// come in ascending distance.
    pub(crate) fn place_of_all(
        &mut self,
        window: &[Neighbour],
        spacing: Spacing,
        settings: &SupportSettings,
    ) -> Place {
        self.place(window, spacing, settings, |_| true, |_| false)
    }

    /// Looks at the samples near the node.
    fn look(&mut self, window: &[Neighbour], spacing: Spacing, settings: &SupportSettings) {
        let radius2 = settings.radius * settings.radius;
        let greatest_mm = (spacing.stretch * spacing.x_mm).max(spacing.y_mm);
        let within2 = UP * radius2 * greatest_mm * greatest_mm;
        // Without branches, for which samples are within is hard to foresee.
        self.near.resize(window.len(), (0, (0.0, 0.0)));
        let mut number = 0;
        for (place, neighbour) in window.iter().enumerate() {
            if neighbour.distance2 > within2 {
                break;
            }
            let (u, v) = (neighbour.dx / spacing.x_mm, neighbour.dy / spacing.y_mm);
            self.near[number] = (place, (u, v));
            number += usize::from(u * u + v * v <= radius2);
        }
        self.near.truncate(number);
    }

    /// Whether the samples last looked at support a value at the node. `agrees` tells inliers.
    pub(crate) fn supported(
        &mut self,
        window: &[Neighbour],
        settings: &SupportSettings,
        agrees: impl Fn(&Neighbour) -> bool,
    ) -> bool {
        match self.among(window, settings, agrees, |_| true) {
            Place::Among => true,
            Place::Beside { distance } => distance <= settings.margin,
            Place::Alone => false,
        }
    }

    /// Where the node lies among the samples near it. `agrees` tells inliers, `closes` those
    /// of the other samples that may belong to another surface.
    pub(crate) fn place(
        &mut self,
        window: &[Neighbour],
        spacing: Spacing,
        settings: &SupportSettings,
        agrees: impl Fn(&Neighbour) -> bool,
        closes: impl Fn(&Neighbour) -> bool,
    ) -> Place {
        self.look(window, spacing, settings);
        self.among(window, settings, agrees, closes)
    }

    /// The same among the samples last looked at.
    fn among(
        &mut self,
        window: &[Neighbour],
        settings: &SupportSettings,
        agrees: impl Fn(&Neighbour) -> bool,
        closes: impl Fn(&Neighbour) -> bool,
    ) -> Place {
        self.points.clear();
        self.others.clear();
        for (place, point) in &self.near {
            let neighbour = &window[*place];
            if agrees(neighbour) {
                self.points.push(*point);
            } else if closes(neighbour) {
                self.others.push(*point);
            }
        }
        if self.points.len() < settings.least_samples {
            return Place::Alone;
        }
        if hull_holds_origin(&self.points) {
            return Place::Among;
        }
        let distance = hull_distance2(&self.points).sqrt();
        // At a step edge without a gap the node belongs to one surface or the other.
        let closed = distance <= settings.step_margin && {
            self.points.append(&mut self.others);
            hull_holds_origin(&self.points)
        };
        if closed {
            Place::Among
        } else {
            Place::Beside { distance }
        }
    }
}

/// Where a node lies among the samples near it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Place {
    /// Inliers surround it, or they and samples of another surface close to them do.
    Among,
    /// Outside of the convex hull of the inliers.
    Beside {
        /// How far, in local spacings.
        distance: f64,
    },
    /// Inliers are too few.
    Alone,
}

fn cross(p: (f64, f64), q: (f64, f64)) -> f64 {
    p.0 * q.1 - p.1 * q.0
}

fn dot(p: (f64, f64), q: (f64, f64)) -> f64 {
    p.0 * q.0 + p.1 * q.1
}

/// Whether the origin lies in the convex hull of the points, its border included.
///
/// Grows the cone of directions in which points are seen; the origin is outside as long as
/// that cone is narrower than a half plane.
fn hull_holds_origin(points: &[(f64, f64)]) -> bool {
    let Some((&first, rest)) = points.split_first() else {
        return false;
    };
    // Counter-clockwise from `low` to `high`.
    let (mut low, mut high) = (first, first);
    for &point in rest {
        let (from_low, from_high) = (cross(low, point), cross(high, point));
        if from_low == 0.0 && dot(low, point) <= 0.0 || from_high == 0.0 && dot(high, point) <= 0.0
        {
            return true;
        }
        match (from_low < 0.0, from_high > 0.0) {
            (true, true) => return true,
            (true, false) => low = point,
            (false, true) => high = point,
            (false, false) => {}
        }
    }
    false
}

/// Squared distance from the origin, which must lie outside, to the convex hull.
///
/// The nearest point of the hull lies on one of its edges, and every segment between two
/// points lies within the hull, so the least distance to any segment is meant.
fn hull_distance2(points: &[(f64, f64)]) -> f64 {
    let mut least = f64::INFINITY;
    for (k, &p) in points.iter().enumerate() {
        least = least.min(dot(p, p));
        for &q in &points[..k] {
            let along = (q.0 - p.0, q.1 - p.1);
            let length2 = dot(along, along);
            let foot = -dot(p, along);
            if foot > 0.0 && foot < length2 {
                let area = cross(p, q);
                least = least.min(area * area / length2);
            }
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_origin_is_found_inside_and_outside() {
        let triangle = [(1.0, 0.0), (-1.0, 1.0), (-1.0, -1.0)];
        assert!(hull_holds_origin(&triangle));
        let moved: Vec<_> = triangle.iter().map(|p| (p.0 + 1.5, p.1)).collect();
        assert!(!hull_holds_origin(&moved));
        assert!((hull_distance2(&moved) - 0.25).abs() < 1e-15);
        let corner = [(3.0, 4.0), (5.0, 4.0), (3.0, 7.0)];
        assert_eq!(hull_distance2(&corner), 25.0);
        assert!(!hull_holds_origin(&[]));
        assert!(!hull_holds_origin(&[(1.0, 1.0), (2.0, 2.0)]));
        assert!(hull_holds_origin(&[(1.0, 1.0), (-2.0, -2.0)]));
    }

    /// Against the definition: outside when some direction has every point before it.
    #[test]
    fn the_cone_agrees_with_trying_all_directions() {
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f64 / f64::from(1 << 24) - 0.5
        };
        let (mut inside, mut outside) = (0, 0);
        for trial in 0..2000 {
            let shift = (random(), random());
            let points: Vec<_> = (0..3 + trial % 5)
                .map(|_| (random() + 0.8 * shift.0, random() + 0.8 * shift.1))
                .collect();
            // If any direction separates, one just beside a normal of some point does.
            let separated = points.iter().any(|p| {
                [1.0, -1.0].iter().any(|side| {
                    let n = (-side * p.1 + 1e-9 * p.0, side * p.0 + 1e-9 * p.1);
                    points.iter().all(|q| dot(n, *q) > 0.0)
                })
            });
            assert_eq!(hull_holds_origin(&points), !separated, "{points:?}");
            if separated {
                outside += 1;
            } else {
                inside += 1;
            }
        }
        assert!(inside > 200 && outside > 200);
    }
}
