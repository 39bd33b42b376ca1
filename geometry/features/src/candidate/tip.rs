//! The cone that a drill leaves at the bottom of a hole.

use crate::outline::Shape;
use crate::outline::witnesses::Sight;

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
/// Nodes stray from the cone by at most this share of its height.
const STRAYS: f64 = 0.12;
/// Fewest nodes.
const FEWEST: usize = 12;

/// The cone that the nodes of a level make about the middle of a circle, if they do.
pub(super) fn tip(sight: &Sight<'_>, level: u16, shape: &Shape) -> Option<Tip> {
    let Shape::Circle(circle) = shape else {
        return None;
    };
    let own = sight.levels.levels.get(usize::from(level))?;
    if own.is_plane || !own.is_seen() {
        return None;
    }
    let image = &sight.field.image;
    let rows = sight.levels.rows;
    let mut places = Vec::new();
    for (node, _) in sight
        .levels
        .labels
        .iter()
        .enumerate()
        .filter(|(_, l)| **l == level)
    {
        let (column, row) = (node / rows, node % rows);
        if let Some(z_mm) = image.z_mm(column, row) {
            let point = nalgebra::Vector3::new(image.x_mm(column), image.y_mm(row), z_mm);
            let [u, v, w] = sight.frame.local(point);
            let [du, dv] = [u - circle.centre_mm[0], v - circle.centre_mm[1]];
            places.push(((du * du + dv * dv).sqrt(), w));
        }
    }
    let (line, rms, count) = line(&places, sight.field.noise_mm)?;
    let [at_middle, slope] = line;
    let height = slope * circle.radius_mm;
    let is_cone = SLOPES.contains(&slope) && count >= FEWEST && rms <= STRAYS * height;
    is_cone.then(|| Tip {
        shoulder_mm: at_middle + height,
        sigma_mm: 2.0 * rms / (count as f64).sqrt(),
        slope,
    })
}

/// Line through places without those that stray, its root mean square, and how many it is of.
pub(crate) fn line(places: &[(f64, f64)], noise_mm: f64) -> Option<([f64; 2], f64, usize)> {
    let mut kept: Vec<(f64, f64)> = places.to_vec();
    let mut found = None;
    for _ in 0..5 {
        let count = kept.len() as f64;
        if kept.len() < 4 {
            return None;
        }
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| kept.iter().map(f).sum::<f64>() / count;
        let (mx, my) = (mean(&|p| p.0), mean(&|p| p.1));
        let xx = mean(&|p| (p.0 - mx) * (p.0 - mx));
        let xy = mean(&|p| (p.0 - mx) * (p.1 - my));
        if xx <= 0.0 {
            return None;
        }
        let slope = xy / xx;
        let line = [my - slope * mx, slope];
        let off = |p: &(f64, f64)| p.1 - line[0] - line[1] * p.0;
        let rms = mean(&|p| off(p) * off(p)).sqrt();
        found = Some((line, rms, kept.len()));
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
