//! Synthetic range images with known outlines, and helpers to judge models by them.
#![allow(dead_code, missing_docs, clippy::unwrap_used, clippy::panic)]

use range_image::image::{Lattice, RangeImage};
use range_image::{RegionMap, Unmonitored};
use reconstruct::{
    Face, Method, Model, ReconstructSettings, Reconstruction, Surface, check, reconstruct,
};

pub(crate) type Point = [f64; 2];

/// A region of a synthetic scene: its outline (counter-clockwise) and its height.
pub(crate) struct Part {
    pub(crate) outline: Vec<Point>,
    pub(crate) height: Box<dyn Fn(f64, f64) -> f64>,
}

impl Part {
    pub(crate) fn new(outline: &[Point], height: impl Fn(f64, f64) -> f64 + 'static) -> Self {
        Self {
            outline: outline.to_vec(),
            height: Box::new(height),
        }
    }
}

pub(crate) fn contains(polygon: &[Point], p: Point) -> bool {
    let mut inside = false;
    for (k, a) in polygon.iter().enumerate() {
        let b = &polygon[(k + 1) % polygon.len()];
        if (a[1] > p[1]) != (b[1] > p[1])
            && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        {
            inside = !inside;
        }
    }
    inside
}

/// Noise that depends on the node alone: about normal, standard deviation 1.
pub(crate) fn noise(column: usize, row: usize, seed: u64) -> f64 {
    let mut state = seed ^ ((column as u64) << 32) ^ row as u64;
    let mut sum = 0.0;
    for _ in 0..12 {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        sum += ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64;
    }
    sum - 6.0
}

/// Samples parts at the nodes; the first part that holds a node has it.
pub(crate) fn scene(
    parts: &[Part],
    pitch_mm: f64,
    size: (usize, usize),
    noise_mm: f64,
) -> (RangeImage, RegionMap) {
    ragged_scene(parts, pitch_mm, size, noise_mm, 0.0)
}

/// The same with nodes displaced at random before it is decided which part has them.
pub(crate) fn ragged_scene(
    parts: &[Part],
    pitch_mm: f64,
    (columns, rows): (usize, usize),
    noise_mm: f64,
    jitter_mm: f64,
) -> (RangeImage, RegionMap) {
    let origin = (-(columns as i64) / 2, -(rows as i64) / 2);
    let mut image = RangeImage::masked(Lattice { pitch_mm }, origin.0, origin.1, columns, rows);
    let mut labels = vec![0; columns * rows];
    for column in 0..columns {
        for row in 0..rows {
            let p = [image.x_mm(column), image.y_mm(row)];
            let shift = [21, 22].map(|s| jitter_mm * noise(column, row, s));
            let seen = [p[0] + shift[0], p[1] + shift[1]];
            if let Some(k) = parts.iter().position(|part| contains(&part.outline, seen)) {
                let z = (parts[k].height)(p[0], p[1]) + noise_mm * noise(column, row, 5);
                image.set_z_mm(column, row, Some(z));
                labels[column * rows + row] = k as u16 + 1;
            }
        }
    }
    let map = RegionMap::new(&image, labels);
    (image, map)
}

pub(crate) fn run(image: &RangeImage, map: &RegionMap, method: Method) -> Reconstruction {
    let settings = ReconstructSettings {
        method,
        ..Default::default()
    };
    let done = reconstruct(image, map, &settings, &Unmonitored).unwrap();
    if let Err(faults) = check::model(&done.model) {
        panic!("{} faults, first {}", faults.len(), faults[0]);
    }
    done
}

/// The outer loop of a face as a fine polygon.
pub(crate) fn outline(face: &Face) -> Vec<Point> {
    loop_points(&face.outer)
}

pub(crate) fn loop_points(of_loop: &reconstruct::Loop) -> Vec<Point> {
    let mut points = Vec::new();
    for coedge in &of_loop.coedges {
        let (first, last) = coedge.parameter_curve.domain();
        let count = ((last - first) / 0.05).ceil() as usize;
        for k in 0..count {
            let t = first + (last - first) * k as f64 / count as f64;
            points.push(coedge.parameter_curve.evaluate(t));
        }
    }
    points
}

fn to_polygon(p: Point, polygon: &[Point]) -> f64 {
    (0..polygon.len())
        .map(|k| {
            let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
            reconstruct::polygon::distance_to_segment(p, a, b)
        })
        .fold(f64::INFINITY, f64::min)
}

/// Farthest that a closed polygon lies from another.
pub(crate) fn one_way(from: &[Point], to: &[Point]) -> f64 {
    let dense = |polygon: &[Point]| -> Vec<Point> {
        let mut points = Vec::new();
        for (k, p) in polygon.iter().enumerate() {
            let q = polygon[(k + 1) % polygon.len()];
            let length = ((q[0] - p[0]).powi(2) + (q[1] - p[1]).powi(2)).sqrt();
            let count = (length / 0.1).ceil().max(1.0) as usize;
            for n in 0..count {
                let t = n as f64 / count as f64;
                points.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
            }
        }
        points
    };
    dense(from)
        .iter()
        .map(|&p| to_polygon(p, to))
        .fold(0.0, f64::max)
}

/// Hausdorff distance of two closed polygons.
pub(crate) fn hausdorff(a: &[Point], b: &[Point]) -> f64 {
    one_way(a, b).max(one_way(b, a))
}

pub(crate) fn surface_z(face: &Face, x: f64, y: f64) -> f64 {
    let Surface::Patches(surface) = &face.surface;
    surface.z(x, y)
}

/// Vertices that edges end in.
pub(crate) fn vertex_count(model: &Model) -> usize {
    model.vertices.len()
}

/// The part a face was sampled from: labels are numbered as the image is scanned.
pub(crate) fn part_of<'a>(
    face: &Face,
    parts: &'a [Part],
    image: &RangeImage,
    map: &RegionMap,
) -> &'a Part {
    let mut votes = vec![0; parts.len()];
    for (node, _) in map
        .raw_labels()
        .iter()
        .enumerate()
        .filter(|n| *n.1 == face.region)
    {
        let p = [image.x_mm(node / map.rows()), image.y_mm(node % map.rows())];
        if let Some(k) = parts.iter().position(|part| contains(&part.outline, p)) {
            votes[k] += 1;
        }
    }
    let most = (0..parts.len()).max_by_key(|&k| votes[k]).unwrap();
    &parts[most]
}
