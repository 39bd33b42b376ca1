//! How far trim loops lie from true outlines, on the whole and along silhouettes.
//!
//! All in the image plane. Points are taken on the true outline, [`along`] its sides; the
//! greatest distance also looks from the loop.

use sim_scanner::Vec3;
use sim_scanner::truth::VisibleFace;

use crate::outline::{Polygon, along};

/// A silhouette counts as oblique from this angle to both axes of the grid, degrees.
pub const OBLIQUE_DEG: f64 = 1.0;

/// Outlines nearer than this are one border of two faces, millimetres. Chords of the same
/// arc differ by less, faces that merely pass each other by more.
const SHARED_MM: f64 = 0.01;

/// Distances, summed: positive where the loop lies outside of the true outline.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sums {
    sum_mm: f64,
    sum_mm2: f64,
    count: usize,
}

impl Sums {
    fn add(&mut self, distance_mm: f64) {
        self.sum_mm += distance_mm;
        self.sum_mm2 += distance_mm * distance_mm;
        self.count += 1;
    }

    /// Mean, millimetres; NaN without any.
    #[must_use]
    pub fn mean_mm(&self) -> f64 {
        self.sum_mm / self.count as f64
    }

    /// Root mean square, millimetres; NaN without any.
    #[must_use]
    pub fn rms_mm(&self) -> f64 {
        (self.sum_mm2 / self.count as f64).sqrt()
    }
}

/// Distances of trim loops from true outlines.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Trimming {
    /// The greatest, either way, millimetres.
    pub most_mm: f64,
    /// From the points of the true outlines.
    pub all: Sums,
    /// The same for silhouettes [`OBLIQUE_DEG`] and more off both axes.
    pub oblique_silhouettes: Sums,
}

impl Trimming {
    /// Takes in the loop drawn around one face, counter-clockwise. `faces` are all that are
    /// seen.
    pub fn add(&mut self, drawn: &[[f64; 2]], face: &VisibleFace, faces: &[VisibleFace]) {
        let looped = Polygon::new(drawn);
        for (from, to) in sides(&face.outline_mm) {
            let oblique = is_oblique(from, to) && is_silhouette((from + to) / 2.0, face, faces);
            for point in along([from.x, from.y], [to.x, to.y]) {
                let off = looped.signed_distance(point);
                self.most_mm = self.most_mm.max(off.abs());
                self.all.add(off);
                if oblique {
                    self.oblique_silhouettes.add(off);
                }
            }
        }
        let outline: Vec<[f64; 2]> = face.outline_mm.iter().map(|p| [p.x, p.y]).collect();
        let outline = Polygon::new(&outline);
        for (k, &from) in drawn.iter().enumerate() {
            for point in along(from, drawn[(k + 1) % drawn.len()]) {
                self.most_mm = self.most_mm.max(outline.distance(point));
            }
        }
    }
}

pub(crate) fn sides(outline: &[Vec3]) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
    let next = outline.iter().cycle().skip(1);
    outline.iter().copied().zip(next.copied())
}

fn is_oblique(from: Vec3, to: Vec3) -> bool {
    let angle_deg = libm::atan2(to.y - from.y, to.x - from.x).to_degrees();
    (angle_deg - 90.0 * libm::round(angle_deg / 90.0)).abs() >= OBLIQUE_DEG
}

/// Whether no other face has this point on its outline.
pub(crate) fn is_silhouette(point: Vec3, face: &VisibleFace, faces: &[VisibleFace]) -> bool {
    let mut others = faces.iter().filter(|other| other.id != face.id);
    others.all(|other| other.outline_distance_mm(point) > SHARED_MM)
}

/// Places where true outlines have corners, each counted once.
#[must_use]
pub fn distinct_corners(faces: &[VisibleFace]) -> usize {
    let mut found: Vec<Vec3> = Vec::new();
    for corner in faces.iter().flat_map(|face| &face.corners_mm) {
        if found.iter().all(|f| f.distance(*corner) > SHARED_MM) {
            found.push(*corner);
        }
    }
    found.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim_scanner::config::SimConfig;
    use sim_scanner::source::Source;
    use sim_scanner::truth;

    fn faces(object: &str) -> Vec<VisibleFace> {
        let config = SimConfig {
            object: object.parse().unwrap(),
            ..SimConfig::default()
        };
        let Source::Simulated { scanner, .. } = config.source().unwrap() else {
            unreachable!("it is simulated");
        };
        truth::faces(&scanner).unwrap()
    }

    #[test]
    fn a_loop_moved_sideways_is_off_by_as_much() {
        let faces = faces("house");
        for face in &faces {
            let exact: Vec<[f64; 2]> = face.outline_mm.iter().map(|p| [p.x, p.y]).collect();
            let mut trimming = Trimming::default();
            trimming.add(&exact, face, &faces);
            assert!(trimming.most_mm < 1e-9 && trimming.all.rms_mm() < 1e-9);

            let moved: Vec<[f64; 2]> = exact.iter().map(|p| [p[0] + 0.3, p[1]]).collect();
            let mut trimming = Trimming::default();
            trimming.add(&moved, face, &faces);
            assert!(trimming.most_mm <= 0.3 + 1e-9 && trimming.most_mm > 0.15);
            assert!(trimming.all.rms_mm() < trimming.most_mm);
        }
    }

    #[test]
    fn a_loop_that_is_too_wide_lies_outside() {
        let faces = faces("cylinder");
        let top = &faces[1];
        let middle = top.outline_mm.iter().sum::<Vec3>() / top.outline_mm.len() as f64;
        let mut wide: Vec<[f64; 2]> = top
            .outline_mm
            .iter()
            .map(|p| middle + (p - middle) * 1.01)
            .map(|p| [p.x, p.y])
            .collect();
        if area(&wide) < 0.0 {
            wide.reverse();
        }
        let mut trimming = Trimming::default();
        trimming.add(&wide, top, &faces);
        let mean = trimming.all.mean_mm();
        assert!(
            mean > 0.2 && mean <= trimming.all.rms_mm() + 1e-12,
            "{mean}"
        );
    }

    fn area(polygon: &[[f64; 2]]) -> f64 {
        let next = polygon.iter().cycle().skip(1);
        let pairs = polygon.iter().zip(next);
        pairs.map(|(a, b)| (a[0] * b[1] - a[1] * b[0]) / 2.0).sum()
    }

    #[test]
    fn silhouettes_are_borders_of_one_face() {
        // Of the top's rim the cylinder's side takes a half; the house has creases inside.
        for object in ["cylinder", "house"] {
            let faces = faces(object);
            let mut trimming = Trimming::default();
            for face in &faces {
                let exact: Vec<[f64; 2]> = face.outline_mm.iter().map(|p| [p.x, p.y]).collect();
                trimming.add(&exact, face, &faces);
            }
            let share = trimming.oblique_silhouettes.count as f64 / trimming.all.count as f64;
            assert!((0.3..0.8).contains(&share), "{object} {share}");
        }
    }

    #[test]
    fn corners_that_faces_share_count_once() {
        assert_eq!(distinct_corners(&faces("cylinder")), 4);
        // A gable of five, a wall and two slopes of the roof, joined along their edges.
        assert_eq!(distinct_corners(&faces("house")), 9);
    }
}
