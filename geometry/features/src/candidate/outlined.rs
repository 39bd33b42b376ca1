//! The outline of a candidate: the likelier of a circle and a rectangle.

use super::Lie;
use super::border_sides::{side_of, walls};
use crate::border::{Border, Pair};
use crate::levels::Sense;
use crate::outline::witnesses::witnesses;
use crate::outline::{Outline, Rectangle, Shape, circle, log_likelihood, outline, rectangle};
use crate::sight::Sight;

/// Fewest pairs that make an outline.
const FEWEST: usize = 12;
/// A hollow of which more than this share of the outermost pairs falls is open, and no circle.
const OPEN: f64 = 0.25;

/// The outline that a border tells of; `None` where that is too short.
pub(super) fn outlined(sight: &Sight<'_>, border: &Border, lie: Lie, seed: u64) -> Option<Outline> {
    let pitch_mm = sight.field.pitch_mm();
    let pairs: Vec<(Pair, [f64; 2])> = border
        .pairs
        .iter()
        .filter(|pair| pair.outermost && pair.sense != Sense::Level)
        .filter_map(|pair| Some((*pair, place(sight, pair)?)))
        .collect();
    if pairs.len() < FEWEST {
        return None;
    }
    let of = |sense: Sense| -> Vec<(Pair, [f64; 2])> {
        let own = pairs.iter().copied();
        own.filter(|(pair, _)| pair.sense == sense).collect()
    };
    let own_sense = match lie {
        Lie::Hollow => Sense::Rises,
        Lie::Raised | Lie::Body => Sense::Falls,
    };
    let main = of(own_sense);
    let falls = pairs.len() - main.len();
    let as_circle = || {
        if lie == Lie::Body || falls as f64 > OPEN * pairs.len() as f64 {
            return None;
        }
        let places: Vec<[f64; 2]> = main.iter().map(|(_, place)| *place).collect();
        let start = circle(&places)?;
        let own: Vec<Pair> = main.iter().map(|(pair, _)| *pair).collect();
        let told = witnesses(sight, &own);
        Some((outline(Shape::Circle(start), &told, pitch_mm, seed), told))
    };
    let as_rectangle = || {
        let all: Vec<[f64; 2]> = match lie {
            Lie::Hollow => pairs.iter().map(|(_, place)| *place).collect(),
            Lie::Raised | Lie::Body => main.iter().map(|(_, place)| *place).collect(),
        };
        let start = rectangle(&all)?;
        let (start, own) = match lie {
            Lie::Hollow => sided(start, &pairs, sight.field.image.pitch_mm()),
            Lie::Raised | Lie::Body => (start, main.iter().map(|(pair, _)| *pair).collect()),
        };
        let told = witnesses(sight, &own);
        Some(outline(Shape::Rectangle(start), &told, pitch_mm, seed))
    };
    let (round, straight) = rayon::join(as_circle, as_rectangle);
    let (round, common) = round.map_or((None, Vec::new()), |(own, told)| (Some(own), told));
    // Both are asked of the same witnesses, and numbers cost what Schwarz 1978 says.
    let score = |one: &Outline| {
        let cost = one.shape.freedom() as f64 * libm::log(common.len().max(2) as f64);
        log_likelihood(&one.shape, &common, pitch_mm) - 0.5 * cost
    };
    [round, straight]
        .into_iter()
        .flatten()
        .max_by(|a, b| score(a).total_cmp(&score(b)))
}

/// Of walls the pairs that rise count, at open sides those that fall.
fn sided(
    mut start: Rectangle,
    pairs: &[(Pair, [f64; 2])],
    pitch_mm: f64,
) -> (Rectangle, Vec<Pair>) {
    start.walls = walls(&start, pairs, pitch_mm);
    let own = pairs.iter().filter(|(pair, place)| {
        let is_wall = start.walls[side_of(&start, *place)];
        is_wall == (pair.sense == Sense::Rises)
    });
    (start, own.map(|(pair, _)| *pair).collect())
}

/// Where a pair's border is in the plan: midway, at the height of its upper node.
fn place(sight: &Sight<'_>, pair: &Pair) -> Option<[f64; 2]> {
    let image = &sight.field.image;
    let rows = sight.regions.rows;
    let at = |node: usize| [image.x_mm(node / rows), image.y_mm(node % rows)];
    let (inner, outer) = (at(pair.inner), at(pair.outer));
    let upper = match pair.sense {
        Sense::Falls => pair.inner,
        Sense::Rises | Sense::Level => pair.outer,
    };
    let z_mm = sight.regions.height_mm(image, upper)?;
    let point = nalgebra::Vector3::new(
        0.5 * (inner[0] + outer[0]),
        0.5 * (inner[1] + outer[1]),
        z_mm,
    );
    let [u, v, _] = sight.frame.local(point);
    Some([u, v])
}
