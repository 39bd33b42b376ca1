//! Which trimmed face of a model lies at a place, and how high.

use reconstruct::model::{Face, Loop, Model, Surface};

/// Chords to a piece of a curve that is not straight.
const CHORDS: usize = 24;
/// Strips that a face's loops are sorted into.
const STRIPS: usize = 256;

/// The trimmed faces of a model over the x-y plane.
pub(crate) struct Trims<'a> {
    faces: Vec<Trim<'a>>,
}

struct Trim<'a> {
    face: &'a Face,
    low: [f64; 2],
    high: [f64; 2],
    /// Chords of the loops, by the strips of x that they cross.
    strips: Vec<Vec<[[f64; 2]; 2]>>,
}

/// A place of a trimmed face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    /// The region that the face was made of.
    pub(crate) region: u16,
    pub(crate) z_mm: f64,
}

impl<'a> Trims<'a> {
    pub(crate) fn new(model: &'a Model) -> Self {
        Self {
            faces: model.faces.iter().map(Trim::new).collect(),
        }
    }

    /// The first face that has this place within its loops.
    pub(crate) fn at(&self, x_mm: f64, y_mm: f64) -> Option<Place> {
        let trim = self.faces.iter().find(|trim| trim.holds([x_mm, y_mm]))?;
        let Surface::Patches(surface) = &trim.face.surface;
        Some(Place {
            region: trim.face.region,
            z_mm: surface.z(x_mm, y_mm),
        })
    }
}

impl<'a> Trim<'a> {
    fn new(face: &'a Face) -> Self {
        let loops = core::iter::once(&face.outer).chain(&face.inner);
        let chords: Vec<[[f64; 2]; 2]> = loops.flat_map(chords).collect();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in chords.iter().flatten() {
            for k in 0..2 {
                low[k] = low[k].min(point[k]);
                high[k] = high[k].max(point[k]);
            }
        }
        let mut trim = Self {
            face,
            low,
            high,
            strips: vec![Vec::new(); STRIPS],
        };
        for [a, b] in chords {
            let (first, last) = (trim.strip(a[0].min(b[0])), trim.strip(a[0].max(b[0])));
            for strip in &mut trim.strips[first..=last] {
                strip.push([a, b]);
            }
        }
        trim
    }

    fn strip(&self, x: f64) -> usize {
        let share = (x - self.low[0]) / (self.high[0] - self.low[0]);
        ((share * STRIPS as f64) as usize).min(STRIPS - 1)
    }

    /// By the chords above the place.
    fn holds(&self, [x, y]: [f64; 2]) -> bool {
        let is_near =
            self.low[0] <= x && x <= self.high[0] && self.low[1] <= y && y <= self.high[1];
        if !is_near {
            return false;
        }
        let above = self.strips[self.strip(x)].iter().filter(|[a, b]| {
            // Half-open, so that a corner counts once.
            (a[0] <= x) != (b[0] <= x) && {
                let t = (x - a[0]) / (b[0] - a[0]);
                a[1] + t * (b[1] - a[1]) > y
            }
        });
        above.count() % 2 == 1
    }
}

/// A loop's chords, each of which begins where the one before it ends.
fn chords(of: &Loop) -> Vec<[[f64; 2]; 2]> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    for coedge in &of.coedges {
        let curve = &coedge.parameter_curve;
        for (k, piece) in curve.pieces.iter().enumerate() {
            let is_straight = piece.iter().all(|c| c[2] == 0.0 && c[3] == 0.0);
            let chords = if is_straight { 1 } else { CHORDS };
            let width = curve.breaks[k + 1] - curve.breaks[k];
            let at = |part: usize| width * part as f64 / chords as f64;
            points.extend((1..=chords).map(|part| curve.piece_value(k, at(part), 0)));
        }
    }
    let before = points.last().into_iter().chain(&points);
    before.zip(&points).map(|(a, b)| [*a, *b]).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use nurbs::{PatchSurface, PiecewiseCubic};
    use reconstruct::model::{Coedge, EdgeId};

    /// A level square face, its sides `half` from a middle, with a square hole if one is given.
    pub(crate) fn square(
        region: u16,
        middle: [f64; 2],
        half: f64,
        hole: Option<f64>,
        z: f64,
    ) -> Face {
        let looped = |half: f64, turns: [[f64; 2]; 4]| {
            let corner = |k: usize| [0, 1].map(|d| middle[d] + half * turns[k % 4][d]);
            let line = |k: usize| PiecewiseCubic::line(corner(k), corner(k + 1), 1.0).unwrap();
            let space = |k: usize| {
                let at = |k: usize| [corner(k)[0], corner(k)[1], z];
                PiecewiseCubic::line(at(k), at(k + 1), 1.0).unwrap()
            };
            let coedge = |k| Coedge {
                edge: EdgeId(k),
                reversed: false,
                parameter_curve: line(k),
                space_curve: space(k),
            };
            Loop {
                coedges: (0..4).map(coedge).collect(),
            }
        };
        let turns = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let (u, v) = ([-100.0, 100.0], [-100.0, 100.0]);
        let mut level = [[0.0; 4]; 4];
        level[0][0] = z;
        Face {
            name: "a square".into(),
            region,
            surface: Surface::Patches(
                PatchSurface::new(u.to_vec(), v.to_vec(), vec![level]).unwrap(),
            ),
            form: None,
            outer: looped(half, turns),
            inner: hole.map(|half| looped(half, turns)).into_iter().collect(),
        }
    }

    #[test]
    fn a_place_belongs_to_the_face_around_it_and_a_hole_to_none() {
        let model = Model {
            faces: vec![
                square(4, [0.0, 0.0], 5.0, Some(2.0), 1.5),
                square(7, [10.0, 0.0], 5.0, None, -2.0),
            ],
            ..Model::default()
        };
        let trims = Trims::new(&model);
        let region = |x, y| trims.at(x, y).map(|place| (place.region, place.z_mm));
        assert_eq!(region(3.0, 0.5), Some((4, 1.5)));
        assert_eq!(region(-4.9, -4.9), Some((4, 1.5)));
        assert_eq!(region(0.0, 1.9), None);
        assert_eq!(region(5.1, 0.0), Some((7, -2.0)));
        assert_eq!(region(15.1, 0.0), None);
        assert_eq!(region(0.0, 5.1), None);
    }
}
