//! The cone that a drill leaves at the bottom of a hole.

use crate::outline::Shape;
use crate::plane::Plane;
use crate::sight::Sight;

/// A cone that is deepest in the middle, as heights over the distance from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tip {
    /// Height where it meets the wall, above the plan, millimetres: the shoulder.
    pub shoulder_mm: f64,
    /// Standard uncertainty of that, millimetres.
    pub sigma_mm: f64,
    /// Rise over run of its side.
    pub slope: f64,
}

/// Drills end in 90 to 150 degrees.
const SLOPES: core::ops::Range<f64> = 0.2..1.2;
/// Samples stray from the cone by at most this share of its height, and their noise.
const STRAYS: f64 = 0.12;
/// Squares of distances count up to this, in variances of the noise.
const MOST: f64 = 16.0;
/// A difference of their sums that is hardly ever by chance.
const CLEARLY: f64 = 16.0;
/// Fewest samples.
const FEWEST: usize = 12;

/// The cone that the nodes of a level make about the middle of a circle, if they do.
pub(super) fn tip(sight: &Sight<'_>, level: u16, shape: &Shape) -> Option<Tip> {
    let Shape::Circle(circle) = shape else {
        return None;
    };
    let own = sight.levels.levels.get(usize::from(level))?;
    // Of a narrow cone whose walls hide most of it a leaning plane is seen.
    let is_floor = |plane: Plane| own.is_plane && plane.slope() < SLOPES.start;
    if own.plane.is_none_or(is_floor) {
        return None;
    }
    let region = *own.regions.first()?;
    let places: Vec<(f64, f64)> = sight
        .samples(&|other| other == region)
        .iter()
        .map(|[u, v, w]| {
            let [du, dv] = [u - circle.centre_mm[0], v - circle.centre_mm[1]];
            ((du * du + dv * dv).sqrt(), *w)
        })
        .collect();
    let side = line(&places, sight.field.noise_mm)?;
    let height = side.slope * circle.radius_mm;
    let is_cone = SLOPES.contains(&side.slope)
        && side.count >= FEWEST
        && side.rms_mm <= STRAYS * height + 1.5 * sight.field.noise_mm
        && !is_round(&places, &side, sight.sigma_mm());
    is_cone.then(|| Tip {
        shoulder_mm: side.at_zero + height,
        sigma_mm: side.sigma_mm(circle.radius_mm),
        slope: side.slope,
    })
}

/// Whether the places speak for a ball, whose heights grow by the square of the distance, and clearly
/// against the line.
fn is_round(places: &[(f64, f64)], side: &Line, noise_mm: f64) -> bool {
    let squared: Vec<(f64, f64)> = places.iter().map(|(far, z)| (far * far, *z)).collect();
    let Some(ball) = line(&squared, noise_mm) else {
        return false;
    };
    let left_over = |line: &Line, places: &[(f64, f64)]| -> f64 {
        let off = |(far, z): &(f64, f64)| (z - line.at_zero - line.slope * far) / noise_mm;
        places
            .iter()
            .map(|place| off(place).powi(2).min(MOST))
            .sum()
    };
    left_over(side, places) > left_over(&ball, &squared) + CLEARLY
}

/// A line of heights over a distance.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    /// Height at distance zero, millimetres.
    at_zero: f64,
    /// Rise over run.
    slope: f64,
    /// Root mean square of the places about it, millimetres.
    rms_mm: f64,
    /// How many places it is of.
    count: usize,
    middle: f64,
    spread: f64,
}

impl Line {
    /// Standard uncertainty of the height at a distance, millimetres.
    fn sigma_mm(&self, distance_mm: f64) -> f64 {
        let off = distance_mm - self.middle;
        self.rms_mm * ((1.0 + off * off / self.spread) / self.count as f64).sqrt()
    }
}

/// Line through places without those that stray.
fn line(places: &[(f64, f64)], noise_mm: f64) -> Option<Line> {
    let mut kept: Vec<(f64, f64)> = places.to_vec();
    let mut found = None;
    for _ in 0..5 {
        let count = kept.len() as f64;
        if kept.len() < 4 {
            return None;
        }
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| kept.iter().map(f).sum::<f64>() / count;
        let (middle, level) = (mean(&|p| p.0), mean(&|p| p.1));
        let spread = mean(&|p| (p.0 - middle) * (p.0 - middle));
        let both = mean(&|p| (p.0 - middle) * (p.1 - level));
        if spread <= 0.0 {
            return None;
        }
        let slope = both / spread;
        let at_zero = level - slope * middle;
        let off = |p: &(f64, f64)| p.1 - at_zero - slope * p.0;
        found = Some(Line {
            at_zero,
            slope,
            rms_mm: mean(&|p| off(p) * off(p)).sqrt(),
            count: kept.len(),
            middle,
            spread,
        });
        let mut sizes: Vec<f64> = places.iter().map(|p| off(p).abs()).collect();
        let within = 3.5 * (crate::field::median(&mut sizes)? / 0.6745).max(0.3 * noise_mm);
        kept = places
            .iter()
            .copied()
            .filter(|p| off(p).abs() <= within)
            .collect();
    }
    found
}
