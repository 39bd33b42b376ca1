//! Spheres of known diameter found in a scan: the sphere through three samples that most others
//! agree with, again and again.

use nalgebra::Vector3;

use crate::random::Draws;
use crate::scan::{Placed, within};
use crate::sphere::{self, Sighted, SphereFit, cap};

/// Threes of samples that are tried for a sphere.
const TRIALS: usize = 2000;
/// Samples that the search looks at, about.
const SOME: usize = 10_000;
/// A sample lies on a sphere if it is off by less than this share of the radius: a scanner that is
/// not yet calibrated sees an ellipsoid.
const NEAR: f64 = 0.03;
/// ... or by less than this, millimetres, which is noise.
const NEAR_MM: f64 = 0.15;
/// Share of the samples before a sphere's cap that must lie on it.
const AGREE: f64 = 0.6;
/// Fewest samples on a sphere's cap.
pub const FEWEST_SAMPLES: usize = 60;
/// Parts of the cap, of which none may be empty.
const SECTORS: usize = 8;
/// Samples in the poorest part of the cap, as a share of what is its due.
const POOREST: f64 = 0.4;
/// Most spheres of a scan.
const MOST: usize = 32;
/// Seed of the draws, the same for each scan.
const SEED: u64 = 0x5e1f;

/// A sphere in a scan.
#[derive(Debug, Clone)]
pub struct Found {
    /// The sphere, with its diameter as given.
    pub fit: SphereFit,
    /// The samples whose rays meet its cap, whether they lie on it or not.
    pub cap: Vec<Sighted>,
    /// Whether the cap is seen on all sides; otherwise the scan ends on it, or something hides it.
    pub is_whole: bool,
}

/// The spheres of this diameter in a scan, in ascending x, then y.
#[must_use]
pub fn spheres(placed: &Placed, diameter_mm: f64) -> Vec<Found> {
    let radius_mm = diameter_mm / 2.0;
    let mut left = thinned(placed);
    let mut found = Vec::new();
    while found.len() < MOST {
        let Some(near_mm) = likeliest(&left, radius_mm, found.len() as u64) else {
            break;
        };
        let Some(sphere) = refined(placed, near_mm, diameter_mm) else {
            break;
        };
        let centre_mm = Vector3::from(sphere.fit.centre_mm);
        for column in &mut left.columns {
            column.retain(|(_, point)| {
                let off = point - centre_mm;
                libm::hypot(off.x, off.y) > 1.1 * radius_mm
            });
        }
        left.columns.retain(|column| !column.is_empty());
        found.push(sphere);
    }
    found.sort_by(|a, b| {
        let ([ax, ay, _], [bx, by, _]) = (a.fit.centre_mm, b.fit.centre_mm);
        ax.total_cmp(&bx).then(ay.total_cmp(&by))
    });
    found
}

fn near(radius_mm: f64) -> f64 {
    (NEAR * radius_mm).max(NEAR_MM)
}

/// Every so many columns and samples, so that about [`SOME`] are left.
fn thinned(placed: &Placed) -> Placed {
    let samples: usize = placed.columns.iter().map(Vec::len).sum();
    let stride = libm::sqrt((samples / SOME) as f64).max(1.0) as usize;
    let columns = placed.columns.iter().step_by(stride);
    Placed {
        calibration: placed.calibration,
        columns: columns
            .map(|column| column.iter().step_by(stride).copied().collect())
            .collect(),
    }
}

/// Centre of the sphere of this radius through three samples that explains the most of them.
fn likeliest(left: &Placed, radius_mm: f64, round: u64) -> Option<Vector3<f64>> {
    let mut draws = Draws::new(SEED ^ round);
    let mut best: Option<(usize, Vector3<f64>)> = None;
    if left.columns.is_empty() {
        return None;
    }
    for _ in 0..TRIALS {
        let Some(centre_mm) =
            three(left, radius_mm, &mut draws).and_then(|three| behind(three, radius_mm))
        else {
            continue;
        };
        let (agree, seen) = votes(left, centre_mm, radius_mm);
        let is_sphere = agree as f64 >= AGREE * seen as f64 && seen > SECTORS;
        if is_sphere && best.is_none_or(|(most, _)| agree > most) {
            best = Some((agree, centre_mm));
        }
    }
    best.map(|(_, centre_mm)| centre_mm)
}

/// Three samples near each other.
fn three(left: &Placed, radius_mm: f64, draws: &mut Draws) -> Option<[Vector3<f64>; 3]> {
    let first = {
        let column = left.columns.get(draws.below(left.columns.len()))?;
        column.get(draws.below(column.len()))?.1
    };
    let mut beside = || {
        let columns = left.columns_within(first.x - radius_mm, first.x + radius_mm);
        let column = columns.get(draws.below(columns.len()))?;
        let samples = within(column, first.y - radius_mm, first.y + radius_mm);
        Some(samples.get(draws.below(samples.len()))?.1)
    };
    Some([first, beside()?, beside()?])
}

/// Centre of the sphere through three points, on the side away from the camera; `None` where it is
/// badly told.
fn behind([a, b, c]: [Vector3<f64>; 3], radius_mm: f64) -> Option<Vector3<f64>> {
    let (u, v) = (b - a, c - a);
    let normal = u.cross(&v);
    let twice_area = normal.norm();
    // Twice the area of the triangle: a narrow one says nothing of where the centre is.
    if twice_area < 0.1 * radius_mm * radius_mm {
        return None;
    }
    let to_middle = (v.cross(&normal) * -u.norm_squared() + u.cross(&normal) * v.norm_squared())
        / (-2.0 * twice_area * twice_area);
    let height_squared = radius_mm * radius_mm - to_middle.norm_squared();
    if height_squared < 0.0 {
        return None;
    }
    let unit = normal / twice_area;
    let towards = if unit.z >= 0.0 { unit } else { -unit };
    Some(a + to_middle - towards * libm::sqrt(height_squared))
}

/// Samples on the cap, and before or behind it as well.
fn votes(left: &Placed, centre_mm: Vector3<f64>, radius_mm: f64) -> (usize, usize) {
    // A little less than the cap, since rays are taken for parallel here.
    let reach_mm = 0.8 * radius_mm;
    let near_mm = near(radius_mm);
    let square = |length: f64| length * length;
    let shell = square(radius_mm - near_mm)..square(radius_mm + near_mm);
    let (mut agree, mut seen) = (0, 0);
    for column in left.columns_within(centre_mm.x - reach_mm, centre_mm.x + reach_mm) {
        for (_, point) in within(column, centre_mm.y - reach_mm, centre_mm.y + reach_mm) {
            let off = point - centre_mm;
            if off.xy().norm_squared() > square(reach_mm) {
                continue;
            }
            seen += 1;
            if shell.contains(&off.norm_squared()) {
                agree += 1;
            }
        }
    }
    (agree, seen)
}

/// The sphere by all samples near it; `None` if these do not agree.
fn refined(placed: &Placed, near_mm: Vector3<f64>, diameter_mm: f64) -> Option<Found> {
    let mut centre_mm = near_mm;
    let mut last = None;
    for _ in 0..3 {
        let cap = cap(placed, centre_mm, diameter_mm);
        let fit = sphere::fit(&cap, centre_mm, diameter_mm, true)?;
        centre_mm = Vector3::from(fit.centre_mm);
        last = Some((fit, cap));
    }
    let (fit, cap) = last?;
    let on = |point: &Vector3<f64>| fit.distance_mm(*point).abs() < 2.0 * near(diameter_mm / 2.0);
    let agree = cap.iter().filter(|own| on(&own.point_mm)).count();
    if agree < FEWEST_SAMPLES || (agree as f64) < AGREE * cap.len() as f64 {
        return None;
    }
    let is_whole = is_whole(&fit, cap.iter().map(|own| &own.point_mm).filter(|p| on(p)));
    Some(Found { fit, cap, is_whole })
}

/// Whether there are samples on all sides of the outer half of the cap.
fn is_whole<'a>(fit: &SphereFit, points: impl Iterator<Item = &'a Vector3<f64>>) -> bool {
    let [x, y, _] = fit.centre_mm;
    let inner_mm = fit.diameter_mm / 2.0 * 0.6;
    let mut counts = [0_usize; SECTORS];
    for point in points {
        let (dx, dy) = (point.x - x, point.y - y);
        if libm::hypot(dx, dy) < inner_mm {
            continue;
        }
        let turn = libm::atan2(dy, dx) / (2.0 * core::f64::consts::PI) + 0.5;
        let sector = ((turn * SECTORS as f64) as usize).min(SECTORS - 1);
        counts[sector] += 1;
    }
    let all: usize = counts.iter().sum();
    let due = all as f64 / SECTORS as f64;
    counts.iter().all(|&count| count as f64 >= POOREST * due) && all >= SECTORS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sphere_through_three_points_lies_behind_them() {
        let centre = Vector3::new(3.0, -4.0, 10.0);
        let on = |x: f64, y: f64| centre + Vector3::new(x, y, libm::sqrt(100.0 - x * x - y * y));
        let three = [on(1.0, 2.0), on(-4.0, 3.0), on(2.0, -6.0)];
        let found = behind(three, 10.0).unwrap();
        assert!((found - centre).norm() < 1e-9, "{found}");
        let [a, b, c] = three;
        assert!((behind([a, c, b], 10.0).unwrap() - centre).norm() < 1e-9);
        assert_eq!(behind(three, 2.0), None, "too small to reach all three");
    }
}
