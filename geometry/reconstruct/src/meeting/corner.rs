//! Corners: the place where all the faces around a vertex have one height.

use super::gap::Gap;
use crate::polygon::{dot, minus, norm};

/// Newton steps.
const STEPS: usize = 12;

/// A step shorter than this, pitches, is the last.
const CLOSE: f64 = 1e-9;

/// Price of a step along an outline against one across it, per square pitch.
const ALONG: f64 = 0.01;

/// The place near a vertex at which the gaps of its creases vanish, in pitches; where they leave
/// it free (a single crease that runs into outlines), the one that leaves the outlines where they
/// are, as well as it can. `outlines` are unit vectors along them. `None` where it is not found
/// within `farthest`.
///
/// Of more conditions than a place can meet, the squares are least.
pub(crate) fn corner(
    gaps: &[Gap<'_>],
    outlines: &[[f64; 2]],
    start: [f64; 2],
    farthest: f64,
    least_bend: f64,
) -> Option<[f64; 2]> {
    let mut price = [[ALONG, 0.0], [0.0, ALONG]];
    for along in outlines {
        let across = [-along[1], along[0]];
        for i in 0..2 {
            for j in 0..2 {
                price[i][j] += across[i] * across[j];
            }
        }
    }
    let mut place = start;
    for _ in 0..STEPS {
        let step = step(gaps, &price, place, least_bend)?;
        place = [place[0] + step[0], place[1] + step[1]];
        let moved = norm(minus(place, start));
        if moved.is_nan() || moved > farthest {
            return None;
        }
        if norm(step) < CLOSE {
            return Some(place);
        }
    }
    None
}

/// One step of Gauss and Newton. Directions in which the gaps hardly change are left alone.
fn step(
    gaps: &[Gap<'_>],
    price: &[[f64; 2]; 2],
    place: [f64; 2],
    least_bend: f64,
) -> Option<[f64; 2]> {
    let (mut normal, mut right) = ([[0.0; 2]; 2], [0.0; 2]);
    for gap in gaps {
        let (gap_mm, slope) = gap.at(place);
        let off = gap_mm / gap.placement.pitch_mm;
        for i in 0..2 {
            for j in 0..2 {
                normal[i][j] += slope[i] * slope[j];
            }
            right[i] -= slope[i] * off;
        }
    }
    let [[a, b], [_, c]] = normal;
    let (middle, half) = ((a + c) / 2.0, (a - c) / 2.0);
    let radius = (half * half + b * b).sqrt();
    let least = least_bend * least_bend;
    let (strong, weak) = (middle + radius, middle - radius);
    if strong.is_nan() || strong < least {
        return None;
    }
    if weak >= least {
        return solved(&normal, right);
    }
    // One direction alone is determined: that of the slopes.
    let slope = if half >= 0.0 {
        [half + radius, b]
    } else {
        [b, radius - half]
    };
    let length = norm(slope);
    let slope = if length > 0.0 {
        [slope[0] / length, slope[1] / length]
    } else {
        [1.0, 0.0]
    };
    let by = dot(right, slope) / strong;
    // Of all steps that go as far in that direction, the cheapest.
    let cheap = solved(price, slope)?;
    let scale = by / dot(cheap, slope);
    Some([cheap[0] * scale, cheap[1] * scale])
}

fn solved(m: &[[f64; 2]; 2], right: [f64; 2]) -> Option<[f64; 2]> {
    let det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    let x = [
        (m[1][1] * right[0] - m[0][1] * right[1]) / det,
        (m[0][0] * right[1] - m[1][0] * right[0]) / det,
    ];
    x.iter().all(|v| v.is_finite()).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::super::gap::Line;
    use super::super::testing::{PLACEMENT, plane};
    use super::*;

    #[test]
    fn three_planes_meet_in_a_point() {
        // In x, y they meet where x = 1 and y = 2: z = x, z = 1, z = 1 + (y - 2).
        let (a, b, c) = (
            plane(0.0, 1.0, 0.0),
            plane(1.0, 0.0, 0.0),
            plane(-1.0, 0.0, 1.0),
        );
        let gap = |sides| Gap {
            sides,
            placement: PLACEMENT,
            line: Line::Intersection,
        };
        let gaps = [gap([&a, &b]), gap([&b, &c]), gap([&c, &a])];
        let place = corner(&gaps, &[], [22.3, 23.8], 1.0, 0.05).unwrap();
        let [x, y] = PLACEMENT.to_mm(place);
        assert!((x - 1.0).abs() < 1e-9 && (y - 2.0).abs() < 1e-9, "{x} {y}");
        assert_eq!(corner(&gaps, &[], [25.0, 23.8], 1.0, 0.05), None);
        // Planes that hardly part tell no place.
        let same = [gap([&a, &a])];
        assert_eq!(corner(&same, &[], [22.3, 23.8], 1.0, 0.05), None);
    }

    #[test]
    fn a_crease_that_runs_into_an_outline_moves_its_end_along_it() {
        let (a, b) = (plane(0.0, 1.0, 0.0), plane(1.0, 0.0, 0.0));
        let gaps = [Gap {
            sides: [&a, &b],
            placement: PLACEMENT,
            line: Line::Intersection,
        }];
        // The crease is x = 1, that is column 22; the outline rises by 45 degrees.
        let along = [0.5_f64.sqrt(); 2];
        let place = corner(&gaps, &[along, along], [22.4, 30.0], 1.0, 0.05).unwrap();
        assert!((place[0] - 22.0).abs() < 1e-9);
        assert!((place[1] - 29.6).abs() < 0.01, "{place:?}");
        // Without an outline it is the nearest place.
        let place = corner(&gaps, &[], [22.4, 30.0], 1.0, 0.05).unwrap();
        assert!((place[0] - 22.0).abs() < 1e-9 && (place[1] - 30.0).abs() < 1e-9);
    }
}
