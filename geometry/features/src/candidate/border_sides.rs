//! Which side of a rectangle each pair of a border is of, and whether sides are walls.

use crate::border::Pair;
use crate::levels::Sense;
use crate::outline::Rectangle;

/// A side of which at least this share rises is a wall; what falls there is another feature that
/// runs through it.
const WALL: f64 = 0.35;

/// And that rises along at least this share of its length.
const COVERED: f64 = 0.25;

/// The side nearest to a place, by the index in [`Rectangle::walls`].
pub(super) fn side_of(rectangle: &Rectangle, place: [f64; 2]) -> usize {
    let [a, b] = rectangle.along(place);
    let off = [
        (a - rectangle.first_mm[0]).abs(),
        (a - rectangle.first_mm[1]).abs(),
        (b - rectangle.second_mm[0]).abs(),
        (b - rectangle.second_mm[1]).abs(),
    ];
    (0..4)
        .min_by(|x, y| off[*x].total_cmp(&off[*y]))
        .unwrap_or(0)
}

/// Which sides are walls, by the pairs nearest to each.
pub(super) fn walls(rectangle: &Rectangle, pairs: &[(Pair, [f64; 2])], pitch_mm: f64) -> [bool; 4] {
    let mut counts = [[0_usize; 2]; 4];
    for (pair, place) in pairs {
        let side = side_of(rectangle, *place);
        match pair.sense {
            Sense::Rises => counts[side][0] += 1,
            Sense::Falls => counts[side][1] += 1,
            Sense::Level => {}
        }
    }
    let [first, second] = rectangle.sizes_mm();
    core::array::from_fn(|side| {
        let [rises, falls] = counts[side].map(|count| count as f64);
        let length_mm = if side < 2 { second } else { first };
        rises >= WALL * (rises + falls) && rises * pitch_mm >= COVERED * length_mm
    })
}
