//! Objects like those of the paper, by formula, so that what was in their holes is known.

use fill::TriangleMesh;
use glam::DVec3;

use crate::common::{cut, grid};
use crate::contour::contour;

/// An object with holes, and what it is a mesh of.
pub(crate) struct Object {
    pub(crate) mesh: TriangleMesh,
    /// How far a place lies off, about, and the normal there.
    pub(crate) off: fn(DVec3) -> (f64, DVec3),
}

/// How far a place lies off a height over x and y, about, and the normal there.
fn over(p: DVec3, height: fn(f64, f64) -> f64) -> (f64, DVec3) {
    const STEP: f64 = 1e-4;
    let slope =
        |dx: f64, dy: f64| (height(p.x + dx, p.y + dy) - height(p.x - dx, p.y - dy)) / (2.0 * STEP);
    let normal = DVec3::new(-slope(STEP, 0.0), -slope(0.0, STEP), 1.0);
    (
        (p.z - height(p.x, p.y)) / normal.length(),
        normal.normalize(),
    )
}

/// An open sheet with its middle at the origin.
fn sheet(size_mm: [f64; 2], cells: [u32; 2], height: fn(f64, f64) -> f64) -> TriangleMesh {
    grid(cells[0], cells[1], [false, false], |u, v| {
        let (x, y) = (size_mm[0] * (u - 0.5), size_mm[1] * (v - 0.5));
        DVec3::new(x, y, height(x, y))
    })
}

/// Figure 5: an open sheet with three holes, one of them round, one long, one bent.
pub(crate) fn hill() -> Object {
    let is_out = |p: DVec3| {
        let round = libm::hypot(p.x + 30.0, p.y - 16.0) < 12.0;
        let long = libm::hypot((p.x - 24.0) / 22.0, (p.y - 20.0 - 0.2 * p.x) / 8.0) < 1.0;
        let (x, y) = (p.x - 4.0, p.y + 36.0);
        let turn = libm::atan2(y, x);
        let bent = (libm::hypot(x, y) - 24.0).abs() < 7.5 && (0.3..2.7).contains(&turn);
        round || long || bent
    };
    Object {
        mesh: cut(&sheet([120.0, 92.0], [30, 23], hill_mm), is_out),
        off: |p| over(p, hill_mm),
    }
}

fn hill_mm(x: f64, y: f64) -> f64 {
    let hill = libm::exp(-((x - 8.0) * (x - 8.0) / 2400.0 + y * y / 1700.0));
    18.0 * hill + 3.0 * libm::sin(x / 22.0)
}

/// Figure 6: the outer panel of a car's door, crowned, with a line of character along it and the edge of
/// a hollow below, and a hole of many corners over both.
pub(crate) fn door() -> Object {
    let is_out = |p: DVec3| {
        let (x, y) = (p.x + 30.0, p.y + 20.0);
        let turn = libm::atan2(y, x);
        let outline = 165.0
            * (1.0 + 0.28 * libm::cos(3.0 * turn + 0.6) + 0.2 * libm::sin(5.0 * turn)
                - 0.12 * libm::cos(2.0 * turn));
        libm::hypot(x, y) < outline
    };
    Object {
        mesh: cut(&sheet([1000.0, 720.0], [50, 36], door_mm), is_out),
        off: |p| over(p, door_mm),
    }
}

fn door_mm(x: f64, y: f64) -> f64 {
    let crown = -x * x / 9000.0 - (y - 60.0) * (y - 60.0) / 3200.0;
    let line = 11.0 * libm::tanh((y - 70.0 - 0.06 * x) / 34.0);
    let hollow = 7.0 * libm::tanh((y + 170.0 - 0.03 * x) / 40.0);
    crown + line + hollow
}

/// A ball moved along a line and grown on the way: its ends and their radii, millimetres.
type Limb = ([f64; 3], f64, [f64; 3], f64);

/// One side of a figure that stands on z = 0, seen from -y, and its middle.
const SIDE: [Limb; 9] = [
    // Shoulder, upper arm, forearm, hand.
    ([3.0, 0.5, 72.0], 5.0, [12.5, 0.5, 71.0], 4.2),
    ([13.0, 0.5, 70.5], 4.0, [21.0, 1.0, 55.0], 3.0),
    ([21.0, 1.0, 55.0], 2.9, [26.5, -4.0, 41.0], 2.1),
    ([26.5, -4.0, 41.0], 2.4, [27.5, -5.5, 36.5], 1.8),
    // Hip, thigh, shank, heel to toe.
    ([3.0, 0.5, 46.0], 7.0, [7.0, 0.5, 43.0], 6.5),
    ([7.0, 0.5, 43.0], 6.4, [9.5, -0.5, 24.0], 4.2),
    ([9.5, -0.5, 24.0], 4.1, [10.5, 1.5, 5.0], 2.6),
    ([10.5, 1.5, 3.2], 2.8, [11.8, -7.5, 2.6], 2.2),
    ([3.5, -2.0, 63.0], 6.2, [2.5, -0.5, 52.0], 5.6),
];
const MIDDLE: [Limb; 3] = [
    ([0.0, 0.5, 76.0], 3.6, [0.0, 0.0, 82.0], 3.4),
    ([0.0, -0.5, 86.5], 6.2, [0.0, 0.0, 91.0], 7.2),
    ([0.0, 0.0, 64.0], 7.5, [0.0, 0.5, 48.0], 7.0),
];
/// How softly limbs run into each other, millimetres.
const SOFT_MM: f64 = 1.1;

/// About the distance to the figure and its gradient: limbs joined by a soft least of their distances.
fn figure_mm(p: DVec3) -> (f64, DVec3) {
    let (mut sum, mut slope) = (0.0, DVec3::ZERO);
    let mut add = |limb: &Limb, p: DVec3, mirror: f64| {
        let (from, to) = (DVec3::from_array(limb.0), DVec3::from_array(limb.2));
        let along = to - from;
        let share = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        let arm = p - (from + share * along);
        let near = arm.length() - (limb.1 + share * (limb.3 - limb.1));
        let weight = libm::exp(-near / SOFT_MM);
        let turned = (share > 0.0 && share < 1.0)
            .then(|| along * ((limb.3 - limb.1) / along.length_squared()));
        let own = arm.normalize_or_zero() - turned.unwrap_or(DVec3::ZERO);
        sum += weight;
        slope += weight * DVec3::new(mirror * own.x, own.y, own.z);
    };
    for limb in &MIDDLE {
        add(limb, p, 1.0);
    }
    for limb in &SIDE {
        add(limb, p, 1.0);
        add(limb, DVec3::new(-p.x, p.y, p.z), -1.0);
    }
    (-SOFT_MM * libm::log(sum), slope / sum)
}

/// Figure 7: a closed figure of a person with holes all over it.
pub(crate) fn figure() -> Object {
    const LOW: DVec3 = DVec3::new(-33.0, -15.0, -2.0);
    const HIGH: DVec3 = DVec3::new(33.0, 12.0, 101.0);
    const EDGE_MM: f64 = 1.15;
    /// Beside which place, and how far around.
    const HOLES: [([f64; 3], f64); 10] = [
        ([2.0, -7.0, 91.0], 3.6),
        ([-3.0, 8.0, 90.0], 3.0),
        ([-6.0, -8.0, 62.0], 4.2),
        ([12.0, -3.0, 73.0], 3.2),
        ([2.0, 8.0, 60.0], 4.6),
        ([22.0, -2.0, 54.0], 2.2),
        ([-24.0, 2.0, 46.0], 1.8),
        ([7.5, -7.0, 38.0], 3.8),
        ([-10.0, 4.0, 20.0], 2.8),
        ([-12.0, -8.0, 3.5], 1.8),
    ];
    let whole = contour(figure_mm, [LOW, HIGH], EDGE_MM);
    let off = |p: DVec3| {
        let (value, slope) = figure_mm(p);
        (value / slope.length(), slope.normalize())
    };
    // Holes begin at vertices, so that all of each is on the figure.
    let nearest = |to: DVec3| {
        let places = whole.vertices_mm.iter().copied().map(DVec3::from_array);
        places.min_by(|a, b| a.distance_squared(to).total_cmp(&b.distance_squared(to)))
    };
    let holes: Vec<(DVec3, f64)> = HOLES
        .iter()
        .filter_map(|(near, far)| Some((nearest(DVec3::from_array(*near))?, *far)))
        .collect();
    let is_out = |p: DVec3| holes.iter().any(|(at, far)| p.distance(*at) < *far);
    Object {
        mesh: cut(&whole, is_out),
        off,
    }
}
