//! Chamfers, rounds, fillets and countersinks: the slanting strips along the edges of features.

use crate::candidate::tip::line;
use crate::candidate::{Candidate, Lie};
use crate::field::median;
use crate::levels::Strip;
use crate::outline::Shape;
use crate::outline::witnesses::Sight;

/// What a strip is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A slanting edge that falls away from a face.
    Chamfer,
    /// A rounded one.
    Round,
    /// A rounded foot, that rises from a floor to a wall.
    Fillet,
    /// The cone around a hole.
    Countersink,
}

impl Kind {
    /// Its name in files.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Chamfer => "chamfer",
            Self::Round => "round",
            Self::Fillet => "fillet",
            Self::Countersink => "countersink",
        }
    }
}

/// A treated edge of a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Treatment {
    /// What it is.
    pub kind: Kind,
    /// Index of the candidate whose edge it is.
    pub of: usize,
    /// Width in the plan, of what slants, or radius, of what is round, millimetres.
    pub size_mm: f64,
    /// Its standard uncertainty.
    pub sigma_mm: f64,
    /// How far it reaches down from the face or up from the floor, millimetres.
    pub rise_mm: f64,
    /// Height of the face or floor that it runs out in, above the plan, millimetres.
    pub level_mm: f64,
    /// Share of its nodes that it explains.
    pub score: f64,
}

/// A strip that is flatter at one end than at the other by more than this is round, as a share of
/// its rise: how far its middle lies off the chord.
const ROUND: f64 = 0.1;
/// Fewest nodes that make a treatment.
const FEWEST: usize = 24;

/// The treatments that the strips make, for each candidate and kind one.
#[must_use]
pub fn treatments(sight: &Sight<'_>, found: &[Candidate]) -> Vec<Treatment> {
    let mut groups: Vec<((usize, bool), Vec<Strip>)> = Vec::new();
    for strip in &sight.levels.strips {
        let Some(of) = owner(sight, found, strip) else {
            continue;
        };
        let key = (of, strip.falls);
        match groups.iter_mut().find(|(own, _)| *own == key) {
            Some((_, strips)) => strips.push(*strip),
            None => groups.push((key, vec![*strip])),
        }
    }
    groups.sort_by_key(|(key, _)| *key);
    groups
        .iter()
        .filter_map(|((of, falls), strips)| treatment(sight, found, *of, *falls, strips))
        .collect()
}

/// The candidate whose edge a strip runs along: a hollow in the face that it falls from, or that
/// face's own.
fn owner(sight: &Sight<'_>, found: &[Candidate], strip: &Strip) -> Option<usize> {
    let regions = sight.regions;
    let mut beside = vec![0_usize; sight.levels.levels.len()];
    for node in 0..regions.labels.len() {
        if regions.labels[node] != strip.region {
            continue;
        }
        for other in regions.neighbours(node) {
            let level = sight.levels.labels[other];
            if level != strip.level {
                beside[usize::from(level)] += 1;
            }
        }
    }
    let holder = |level: u16| found.iter().position(|c| c.levels.contains(&level));
    let own = holder(strip.level)?;
    let most = (0..beside.len())
        .filter(|k| beside[*k] > 0)
        .max_by_key(|k| beside[*k]);
    let other = most.and_then(|k| holder(u16::try_from(k).ok()?));
    let Some(other) = other.filter(|other| *other != own) else {
        return Some(own);
    };
    let goes_into = found[other].host != 0 && found[own].levels.contains(&found[other].host);
    let is_others = match (strip.falls, found[other].lie) {
        // Falls into a hollow of its face, or rises to what stands on its floor.
        (true, Lie::Hollow) | (false, Lie::Raised) => goes_into,
        _ => false,
    };
    Some(if is_others { other } else { own })
}

fn treatment(
    sight: &Sight<'_>,
    found: &[Candidate],
    of: usize,
    falls: bool,
    strips: &[Strip],
) -> Option<Treatment> {
    let candidate = &found[of];
    let image = &sight.field.image;
    let rows = sight.regions.rows;
    let level = sight
        .levels
        .levels
        .get(usize::from(strips.first()?.level))?;
    let plane = level.plane?;
    // Distance beyond the outline, and height off the face or floor that it runs out in.
    let mut places = Vec::new();
    for (node, region) in sight.regions.labels.iter().enumerate() {
        if !strips.iter().any(|strip| strip.region == *region) {
            continue;
        }
        let (column, row) = (node / rows, node % rows);
        if let Some(z_mm) = image.z_mm(column, row) {
            let (x, y) = (image.x_mm(column), image.y_mm(row));
            let [u, v, _] = sight.frame.local(nalgebra::Vector3::new(x, y, z_mm));
            let off = (z_mm - plane.z_mm(x, y)) * sight.frame.axes[2].z;
            places.push((candidate.outline.shape.distance_mm([u, v]).abs(), off.abs()));
        }
    }
    if places.len() < FEWEST {
        return None;
    }
    let ([at_outline, slope], rms, count) = line(&places, sight.field.noise_mm)?;
    if slope >= -0.1 {
        return None;
    }
    let width = -at_outline / slope;
    let bow = bow(&places, at_outline, slope);
    let is_round = bow > ROUND;
    let kind = match (falls, is_round) {
        (false, _) => Kind::Fillet,
        (true, true) => Kind::Round,
        (true, false) => match candidate.outline.shape {
            Shape::Circle(_) if candidate.lie == Lie::Hollow => Kind::Countersink,
            _ => Kind::Chamfer,
        },
    };
    let middle = match candidate.outline.shape {
        Shape::Circle(circle) => circle.centre_mm,
        Shape::Rectangle(rectangle) => rectangle.middle_mm(),
    };
    let at = sight.frame.world([middle[0], middle[1], 0.0]);
    let level_mm = (plane.z_mm(at.x, at.y) - at.z) * sight.frame.axes[2].z;
    let score = count as f64 / places.len() as f64;
    let spread = rms / (count as f64).sqrt();
    match kind {
        Kind::Fillet | Kind::Round => {
            let (radius, sigma_mm) = radius(&places)?;
            Some(Treatment {
                kind,
                of,
                size_mm: radius,
                sigma_mm,
                rise_mm: radius,
                level_mm,
                score,
            })
        }
        Kind::Chamfer | Kind::Countersink => Some(Treatment {
            kind,
            of,
            size_mm: width,
            // Of the line at its middle, carried on to where it ends.
            sigma_mm: 4.0 * spread / slope.abs(),
            rise_mm: at_outline,
            level_mm,
            score,
        }),
    }
}

/// How far the middle third of the places lies off the line through all, as a share of the rise:
/// positive where the strip is steeper at the outline.
fn bow(places: &[(f64, f64)], at_outline: f64, slope: f64) -> f64 {
    let width = -at_outline / slope;
    let mut off = [Vec::new(), Vec::new()];
    for (distance, height) in places {
        let share = distance / width;
        let residual = height - at_outline - slope * distance;
        if (0.33..0.67).contains(&share) {
            off[0].push(residual);
        } else if (0.0..1.2).contains(&share) {
            off[1].push(residual);
        }
    }
    let [Some(middle), Some(ends)] = off.map(|mut own| median(&mut own)) else {
        return 0.0;
    };
    (ends - middle) / at_outline.abs().max(1e-9)
}

/// Radius of the quarter circle that places lie on, and its uncertainty: at the outline it is
/// steep, and it runs out in the face a radius away.
fn radius(places: &[(f64, f64)]) -> Option<(f64, f64)> {
    let cost = |radius: f64| {
        let mut sizes: Vec<f64> = places
            .iter()
            .map(|(distance, height)| {
                let along = (radius - distance).clamp(0.0, radius);
                let expected = radius - (radius * radius - along * along).max(0.0).sqrt();
                // Off along the normal of the arc, nearly.
                let steep = along / (radius * radius - along * along).max(1e-6).sqrt();
                (height - expected).abs() / (1.0 + steep * steep).sqrt()
            })
            .collect();
        median(&mut sizes).unwrap_or(f64::INFINITY)
    };
    let widest = places.iter().map(|p| p.0).fold(0.0, f64::max);
    let steps = 200;
    let at = |k: usize| widest * (0.3 + 1.7 * k as f64 / steps as f64);
    let best = (0..=steps).min_by(|a, b| cost(at(*a)).total_cmp(&cost(at(*b))))?;
    let radius = at(best);
    let sigma = cost(radius) * 4.0 / (places.len() as f64).sqrt() + widest * 1.7 / steps as f64;
    (radius > 0.0).then_some((radius, sigma))
}
