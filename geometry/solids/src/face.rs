//! A face filled with triangles.

use std::collections::{BTreeMap, BTreeSet};

use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation, mitigate_underflow};

use crate::chart::Chart;
use crate::inverse::STILL;
use crate::{BodyError, Face, Point};

type Plane = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// Places along each parameter at which it is asked how much the surface bends, the share of its
/// extent over which, and the chords that it is worth if it does not.
const PROBES: usize = 4;
const DIFFERENCE: f64 = 1e-4;
const LEAST_CHORDS: f64 = 4.0;
/// How near, millimetres, a point is to be the pole of its face.
const POLE_MM: f64 = 1e-4;

/// What lies on which side of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Known {
    Not,
    Inside,
    Outside,
}

/// A point in the plane.
#[derive(Debug, Clone, Copy)]
struct Spot {
    place: [f64; 2],
    /// Index of the point in space, once it has one.
    point: Option<usize>,
}

/// A face while it is filled.
struct Filling<'a> {
    face: &'a Face,
    chart: &'a Chart,
    plane: Plane,
    spots: Vec<Spot>,
    /// Pairs of spots by how often loops run from the lesser to the greater, less how often back.
    sides: BTreeMap<[usize; 2], i32>,
    /// What the unit of each parameter is worth against the other's.
    worth: [f64; 2],
}

/// Triangles of a face as indices of points, to which it adds; counter-clockwise seen from outside.
pub(crate) fn fill(
    face: &Face,
    chart: &Chart,
    points_mm: &mut Vec<Point>,
    tolerance_mm: f64,
    most: usize,
) -> Result<Vec<[usize; 3]>, BodyError> {
    let mut filling = Filling::new(face, chart, tolerance_mm)?;
    let mut unseen = filling.inside()?;
    loop {
        let wanted = filling.bends(&unseen, tolerance_mm);
        if wanted.is_empty() {
            break;
        }
        let known = filling.spots.len();
        for place in wanted {
            filling.insert(place, None)?;
        }
        if filling.spots.len() > most {
            return Err(BodyError::TooMany { most });
        }
        if filling.spots.len() == known {
            // So near to each other are points that no number lies between them.
            return Err(BodyError::Bends {
                face: face.name.clone(),
                tolerance_mm,
            });
        }
        // A point inside a face has made just the triangles around it.
        unseen = filling.around(known);
    }
    let triangles = filling.inside()?;
    Ok(filling.in_space(&triangles, points_mm))
}

impl<'a> Filling<'a> {
    fn new(face: &'a Face, chart: &'a Chart, tolerance_mm: f64) -> Result<Self, BodyError> {
        let mut filling = Self {
            face,
            chart,
            plane: Plane::new(),
            spots: Vec::new(),
            sides: BTreeMap::new(),
            worth: worth(face, chart, tolerance_mm),
        };
        let (low, high) = (chart.low, chart.high);
        for corner in [low, [high[0], low[1]], high, [low[0], high[1]]] {
            filling.insert(corner, None)?;
        }
        for side in &chart.sides {
            let a = filling.insert(side.places[0], Some(side.points[0]))?;
            let b = filling.insert(side.places[1], Some(side.points[1]))?;
            if a == b {
                continue;
            }
            let way = if a < b { 1 } else { -1 };
            *filling.sides.entry([a.min(b), a.max(b)]).or_insert(0) += way;
        }
        // The sides of the plane's cuts have the same points, so that triangles meet there.
        for axis in 0..2 {
            let Some(cut) = chart.cuts[axis] else {
                continue;
            };
            let borders = [cut.at, cut.at + cut.period];
            for spot in filling.spots.clone() {
                if let Some(k) = borders
                    .iter()
                    .position(|border| *border == spot.place[axis])
                {
                    let mut opposite = spot.place;
                    opposite[axis] = borders[1 - k];
                    filling.insert(opposite, spot.point)?;
                }
            }
        }
        let sides: Vec<[usize; 2]> = filling.sides.keys().copied().collect();
        for [a, b] in sides {
            let ends = [a, b].map(FixedVertexHandle::from_index);
            let plane = &mut filling.plane;
            if !plane.can_add_constraint(ends[0], ends[1]) {
                return Err(filling.trouble("its edges cross"));
            }
            plane.add_constraint(ends[0], ends[1]);
            if plane.get_edge_from_neighbors(ends[0], ends[1]).is_none() {
                return Err(filling.trouble("an edge touches another one"));
            }
        }
        Ok(filling)
    }

    fn trouble(&self, reason: &'static str) -> BodyError {
        BodyError::Loops {
            face: self.face.name.clone(),
            reason,
        }
    }

    /// Number of the spot at a place, new or not.
    fn insert(&mut self, place: [f64; 2], point: Option<usize>) -> Result<usize, BodyError> {
        let flat = Point2::new(place[0] * self.worth[0], place[1] * self.worth[1]);
        let added = self.plane.insert(mitigate_underflow(flat));
        let handle = added.map_err(|_| self.trouble("a point of it is no number"))?;
        let index = handle.index();
        if index == self.spots.len() {
            self.spots.push(Spot { place, point });
        } else if self.spots[index].point.is_none() {
            self.spots[index].point = point;
        }
        Ok(index)
    }

    /// The triangles of the plane that are of the face.
    fn inside(&self) -> Result<Vec<[usize; 3]>, BodyError> {
        let mut known = vec![Known::Not; self.plane.num_all_faces()];
        let mut waiting = Vec::new();
        for (&[a, b], &net) in self.sides.iter().filter(|(_, net)| **net != 0) {
            let ends = [a, b].map(FixedVertexHandle::from_index);
            let Some(edge) = self.plane.get_edge_from_neighbors(ends[0], ends[1]) else {
                return Err(self.trouble("an edge touches another one"));
            };
            let is_left = (net > 0) == self.face.same_sense;
            let sides = [(edge.face(), is_left), (edge.rev().face(), !is_left)];
            for (face, is_inside) in sides {
                if let Some(triangle) = face.as_inner() {
                    let side = if is_inside {
                        Known::Inside
                    } else {
                        Known::Outside
                    };
                    waiting.push((triangle.fix(), side));
                }
            }
        }
        // A surface without a border is a face as a whole.
        if waiting.is_empty() {
            let triangles = self.plane.inner_faces();
            waiting.extend(triangles.map(|triangle| (triangle.fix(), Known::Inside)));
        }
        while let Some((fixed, side)) = waiting.pop() {
            let seen = &mut known[fixed.index()];
            if *seen == side {
                continue;
            }
            if *seen != Known::Not {
                return Err(self.trouble("its loops do not go around it"));
            }
            *seen = side;
            for edge in self.plane.face(fixed).adjacent_edges() {
                let ends = [edge.from(), edge.to()].map(|v| v.fix().index());
                let key = [ends[0].min(ends[1]), ends[0].max(ends[1])];
                if self.sides.get(&key).is_some_and(|net| *net != 0) {
                    continue;
                }
                // Whatever lies at the other border of a cut has sides of its own that tell.
                if let Some(beyond) = edge.rev().face().as_inner()
                    && known[beyond.fix().index()] != side
                {
                    waiting.push((beyond.fix(), side));
                }
            }
        }
        let inside = self
            .plane
            .inner_faces()
            .filter(|face| known[face.fix().index()] == Known::Inside);
        Ok(inside
            .map(|face| face.vertices().map(|v| v.fix().index()))
            .collect())
    }

    /// The triangles around the spots from this one on.
    fn around(&self, first: usize) -> Vec<[usize; 3]> {
        let mut around = BTreeSet::new();
        for spot in first..self.spots.len() {
            let handle = FixedVertexHandle::from_index(spot);
            for edge in self.plane.vertex(handle).out_edges() {
                if let Some(triangle) = edge.face().as_inner() {
                    around.insert((
                        triangle.fix().index(),
                        triangle.vertices().map(|v| v.fix().index()),
                    ));
                }
            }
        }
        around.into_iter().map(|(_, corners)| corners).collect()
    }

    /// Places at which triangles are farther from the surface than allowed.
    fn bends(&self, triangles: &[[usize; 3]], tolerance_mm: f64) -> Vec<[f64; 2]> {
        let mut edges: BTreeMap<[usize; 2], ([f64; 2], f64)> = BTreeMap::new();
        let mut wanted = Vec::new();
        let off_mm = |spots: &[usize]| {
            let share = 1.0 / spots.len() as f64;
            let mut place = [0.0; 2];
            let mut middle = Point::zeros();
            for &spot in spots {
                let at = self.spots[spot].place;
                place = [place[0] + share * at[0], place[1] + share * at[1]];
                // Points of edges may lie off the surface: no division mends that.
                middle += self.face.surface.at(at).0 * share;
            }
            let (at, [along_u, along_v]) = self.face.surface.at(place);
            let off = at - middle;
            let normal = along_u.cross(&along_v).try_normalize(0.0);
            (
                place,
                normal.map_or(off.norm(), |normal| normal.dot(&off).abs()),
            )
        };
        for triangle in triangles {
            // The worst of its sides only: with it divided the others may do.
            let mut worst = (tolerance_mm, None);
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                let key = [a.min(b), a.max(b)];
                if self.sides.contains_key(&key) {
                    continue;
                }
                let (place, off_mm) = *edges.entry(key).or_insert_with(|| off_mm(&key));
                if off_mm > worst.0 {
                    worst = (off_mm, Some((key, place)));
                }
            }
            match worst.1 {
                Some((key, place)) => {
                    wanted.push(place);
                    wanted.extend(self.opposite(key, place));
                }
                None => {
                    let (place, off_mm) = off_mm(triangle);
                    if off_mm > tolerance_mm {
                        wanted.push(place);
                    }
                }
            }
        }
        wanted
    }

    /// The same place at the other border of a cut that a pair of spots lies on.
    fn opposite(&self, pair: [usize; 2], place: [f64; 2]) -> Option<[f64; 2]> {
        (0..2).find_map(|axis| {
            let cut = self.chart.cuts[axis]?;
            let borders = [cut.at, cut.at + cut.period];
            let k = borders.iter().position(|border| {
                pair.iter()
                    .all(|spot| self.spots[*spot].place[axis] == *border)
            })?;
            let mut opposite = place;
            opposite[axis] = borders[1 - k];
            Some(opposite)
        })
    }

    /// Triangles between points in space.
    fn in_space(&self, triangles: &[[usize; 3]], points_mm: &mut Vec<Point>) -> Vec<[usize; 3]> {
        let mut of_spots: Vec<Option<usize>> = self.spots.iter().map(|spot| spot.point).collect();
        // Points that several spots have, as at a pole: those of edges may be such.
        let of_edges = self.chart.sides.iter().flat_map(|side| side.points);
        let mut poles: Vec<usize> = of_edges.collect();
        let mut on_border: BTreeMap<[u64; 2], usize> = BTreeMap::new();
        let mut found = Vec::with_capacity(triangles.len());
        for triangle in triangles {
            let corners = triangle.map(|spot| {
                if let Some(point) = of_spots[spot] {
                    return point;
                }
                let point = self.new_point(spot, points_mm, &mut poles, &mut on_border);
                of_spots[spot] = Some(point);
                point
            });
            let [a, b, c] = corners;
            if a != b && b != c && c != a {
                found.push(if self.face.same_sense {
                    [a, b, c]
                } else {
                    [a, c, b]
                });
            }
        }
        found
    }

    fn new_point(
        &self,
        spot: usize,
        points_mm: &mut Vec<Point>,
        poles: &mut Vec<usize>,
        on_border: &mut BTreeMap<[u64; 2], usize>,
    ) -> usize {
        let place = self.spots[spot].place;
        let (at_mm, along) = self.face.surface.at(place);
        let speed = along.map(|d| d.norm());
        if speed[0].min(speed[1]) <= STILL * speed[0].max(speed[1]) {
            let near = |point: &&usize| (points_mm[**point] - at_mm).norm() <= POLE_MM;
            if let Some(point) = poles.iter().find(near) {
                return *point;
            }
            points_mm.push(at_mm);
            poles.push(points_mm.len() - 1);
            return points_mm.len() - 1;
        }
        let mut folded = place;
        let mut is_on_border = false;
        for axis in 0..2 {
            if let Some(cut) = self.chart.cuts[axis] {
                is_on_border |= place[axis] == cut.at || place[axis] == cut.at + cut.period;
                if place[axis] == cut.at + cut.period {
                    folded[axis] = cut.at;
                }
            }
        }
        let mut add = || {
            points_mm.push(at_mm);
            points_mm.len() - 1
        };
        if is_on_border {
            *on_border
                .entry(folded.map(f64::to_bits))
                .or_insert_with(add)
        } else {
            add()
        }
    }
}

/// What each parameter is worth: how many chords as long as the tolerance allows its unit takes, and
/// some in any case. So triangles are narrow across what bends, and long along what does not.
fn worth(face: &Face, chart: &Chart, tolerance_mm: f64) -> [f64; 2] {
    let extents = [0, 1].map(|axis| chart.high[axis] - chart.low[axis]);
    let mut most = [0.0_f64; 2];
    for i in 0..PROBES {
        for j in 0..PROBES {
            let share = |k: usize| (k as f64 + 0.5) / PROBES as f64;
            let place = [
                chart.low[0] + share(i) * extents[0],
                chart.low[1] + share(j) * extents[1],
            ];
            let (_, along) = face.surface.at(place);
            let Some(normal) = along[0].cross(&along[1]).try_normalize(0.0) else {
                continue;
            };
            for axis in 0..2 {
                let step = DIFFERENCE * extents[axis];
                let mut beside = place;
                beside[axis] += step;
                let change = face.surface.at(beside).1[axis] - along[axis];
                most[axis] = most[axis].max((change.dot(&normal) / step).abs());
            }
        }
    }
    [0, 1].map(|axis| (most[axis] / (8.0 * tolerance_mm)).sqrt() + LEAST_CHORDS / extents[axis])
}
