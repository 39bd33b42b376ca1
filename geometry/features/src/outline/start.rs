//! First guesses of outlines, from the border of a level on the grid.

use super::shape::{Circle, Rectangle};
use crate::field::median;

/// Circle through places, by least squares of their distances from it: Landau 1987's iteration
/// from the algebraic circle. `None` of fewer than three, or of places on a line.
#[must_use]
pub fn circle(places: &[[f64; 2]]) -> Option<Circle> {
    if places.len() < 3 {
        return None;
    }
    let count = places.len() as f64;
    let middle = [0, 1].map(|axis| places.iter().map(|p| p[axis]).sum::<f64>() / count);
    // Algebraic (Kasa 1976): u^2 + v^2 = 2 a u + 2 b v + c about the middle.
    let mut normal = nalgebra::Matrix3::zeros();
    let mut right = nalgebra::Vector3::zeros();
    for [u, v] in places {
        let (u, v) = (u - middle[0], v - middle[1]);
        let row = nalgebra::Vector3::new(2.0 * u, 2.0 * v, 1.0);
        normal += row * row.transpose();
        right += row * (u * u + v * v);
    }
    let solved = normal.try_inverse()? * right;
    let mut centre = [solved.x, solved.y];
    let mut radius = (solved.z + solved.x * solved.x + solved.y * solved.y)
        .max(0.0)
        .sqrt();
    for _ in 0..50 {
        let (mut sum, mut along) = (0.0, [0.0; 2]);
        for [u, v] in places {
            let off = [u - middle[0] - centre[0], v - middle[1] - centre[1]];
            let far = (off[0] * off[0] + off[1] * off[1]).sqrt().max(1e-12);
            sum += far;
            along = [along[0] + off[0] / far, along[1] + off[1] / far];
        }
        radius = sum / count;
        centre = along.map(|a| -radius * a / count);
    }
    (radius > 0.0 && radius.is_finite()).then_some(Circle {
        centre_mm: [middle[0] + centre[0], middle[1] + centre[1]],
        radius_mm: radius,
    })
}

/// Steps of the angle within a quarter turn.
const ANGLES: usize = 90;
/// Places looked at.
const MOST: usize = 400;

/// The rectangle whose sides places lie nearest to; all of its sides are walls. `None` of fewer
/// than four places.
#[must_use]
pub fn rectangle(places: &[[f64; 2]]) -> Option<Rectangle> {
    if places.len() < 4 {
        return None;
    }
    let stride = places.len().div_ceil(MOST);
    let few: Vec<[f64; 2]> = places.iter().copied().step_by(stride).collect();
    let of_angle = |angle_rad: f64| {
        let mut box_of = Rectangle {
            angle_rad,
            first_mm: [0.0; 2],
            second_mm: [0.0; 2],
            corner_mm: 0.0,
            walls: [true; 4],
        };
        let along: Vec<[f64; 2]> = few.iter().map(|p| box_of.along(*p)).collect();
        let [first, second] = [0, 1].map(|axis| sides(&along, axis));
        (box_of.first_mm, box_of.second_mm) = (first, second);
        let cost: f64 = along
            .iter()
            .map(|[a, b]| {
                let to_side = (a - first[0])
                    .abs()
                    .min((a - first[1]).abs())
                    .min((b - second[0]).abs())
                    .min((b - second[1]).abs());
                to_side.min(0.05 * (first[1] - first[0] + second[1] - second[0]))
            })
            .sum();
        (cost, box_of)
    };
    let quarter = core::f64::consts::FRAC_PI_2;
    let coarse = (0..ANGLES)
        .map(|k| of_angle(quarter * k as f64 / ANGLES as f64))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let fine = (-10..=10_i32)
        .map(|k| of_angle(coarse.1.angle_rad + quarter * f64::from(k) / (10.0 * ANGLES as f64)))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let [a, b] = fine.1.sizes_mm();
    (a > 0.0 && b > 0.0).then_some(fine.1)
}

/// Where the sides across an axis lie: where places are densest among the outermost fifth at each
/// end, since a side has many at one distance, and walls along the axis are spread evenly.
fn sides(along: &[[f64; 2]], axis: usize) -> [f64; 2] {
    let mut values: Vec<f64> = along.iter().map(|p| p[axis]).collect();
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
    let (low, high) = (at(0.005), at(0.995));
    let window = (0.02 * (high - low)).max(1e-9);
    let densest = |outward: &dyn Fn(f64) -> f64, own: &[f64]| {
        let near = own.iter().filter(|v| outward(**v) <= 0.2 * (high - low));
        let best = near.max_by_key(|v| {
            let inside = own.iter().filter(|o| (*o - *v).abs() <= window).count();
            // Of equally dense places the outermost.
            (
                inside,
                std::cmp::Reverse((outward(**v) / window * 16.0) as i64),
            )
        });
        let Some(best) = best else { return own[0] };
        let mut around: Vec<f64> = own
            .iter()
            .copied()
            .filter(|o| (o - best).abs() <= window)
            .collect();
        median(&mut around).unwrap_or(*best)
    };
    [
        densest(&|v| (v - low).max(0.0), &values),
        densest(&|v| (high - v).max(0.0), &values),
    ]
}
