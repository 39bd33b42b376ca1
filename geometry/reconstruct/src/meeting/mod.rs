//! Faces that meet: creases on the curves in which their surfaces intersect, smooth joins on those
//! in which they touch, corners where all faces around them have one height.
//!
//! Borders are drawn between nodes, and smoothed; along a crease that leaves the two surfaces
//! apart by what the drawing is off times the difference of their slopes. Here the vertices of a
//! crease are put where the surfaces meet, the crease is traced between them, and the other borders
//! follow their vertices. What gets in another border's way stays as it was drawn.

mod back;
mod corner;
mod gap;
mod line;
mod loosen;
mod part;
#[cfg(test)]
pub(crate) mod testing;
mod touch;
mod trace;

use std::collections::{BTreeMap, BTreeSet};

use nurbs::{PatchSurface, PiecewiseCubic};
use range_image::{Cancelled, Monitor};

use crate::assemble::Placement;
use crate::border::beam::Beam;
use crate::border::crossing::{Conflict, Strand, conflicts};
use crate::border::deflect::bent;
use crate::border::map::{MapEdge, PlanarMap};
use crate::polygon::{cross, minus, norm, signed_area};
use back::{turns_back, turns_round};
use corner::corner;
pub(crate) use gap::{Gap, Line, Reach};
use line::{REACH, is_closed_up, line, places, reach, sides};
pub(crate) use loosen::loosen;
pub(crate) use part::{part, runs, without_short};
pub(crate) use touch::touch;
use trace::trace;

/// How far, pitches, the end of a crease may be moved that runs out between outlines: there the last
/// nodes are lost first, and a border is drawn by those that are left.
const LONE_END: f64 = 2.0;

/// Places of each piece of a path at which the area of a loop is taken.
const PER_PIECE: usize = 8;

/// How far the surfaces of a crease may be apart at its ends, millimetres. Where more than three
/// faces meet they do not quite do so in one point; the crease is led to it.
const CORNER_MM: f64 = 0.02;

/// Ends at which the surfaces are this near lie on the crease, millimetres.
const EXACT_MM: f64 = 1e-6;

/// An outline that its vertex leads farther than this to its side, pitches, does not run where the
/// samples tell any more: where they are few, at its ends, the nodes know it to half a pitch.
const ASTRAY: f64 = 0.5;

/// Borders no longer than this, pitches, may become straight when their ends are moved.
const SHORT: f64 = 3.0;

/// How much the area of a loop may shrink or grow.
const LEAST_AREA: f64 = 0.5;
const MOST_AREA: f64 = 2.0;

/// Which borders and vertices stay as they were drawn.
#[derive(Debug, Clone, Default, PartialEq)]
struct Left {
    edges: BTreeSet<usize>,
    vertices: BTreeSet<usize>,
    /// Edges that are left for one of their vertices, with it.
    loose: BTreeSet<(usize, usize)>,
}

/// What has come of the creases of a map.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Meeting {
    /// Which edges have come to lie where their surfaces meet.
    pub(crate) is_met: Vec<bool>,
    /// Edges that would, but for this vertex of theirs.
    loose: BTreeSet<(usize, usize)>,
}

/// Puts creases where the surfaces of their sides intersect, and smooth joins where they touch;
/// gives which edges have come to lie where their surfaces meet. `is_crease` says of an edge
/// whether its surfaces go on across it; `surfaces[k]` belongs to piece `k + 1`, with the root mean
/// square of its residuals in millimetres. Outlines that follow their vertices far are not settled
/// any more.
pub(crate) fn meet(
    map: &mut PlanarMap,
    surfaces: &[(&PatchSurface, f64)],
    is_crease: &[bool],
    placement: Placement,
    monitor: &dyn Monitor,
) -> Result<Meeting, Cancelled> {
    let gap = |(edge, is_crease): (&MapEdge, &bool)| {
        let sides = sides(edge, surfaces).filter(|_| *is_crease)?;
        line(sides, placement, places(edge))
    };
    let mut around = vec![Vec::new(); map.vertices.len()];
    for (e, edge) in map.edges.iter().enumerate() {
        around[edge.start].push(e);
        if edge.end != edge.start {
            around[edge.end].push(e);
        }
    }
    let drawn = Drawn {
        gaps: map.edges.iter().zip(is_crease).map(gap).collect(),
        conflicts: crossings(map, &map.vertices, &map.edges),
        areas: areas(map, &map.edges),
        around,
        map,
        surfaces,
        placement,
    };
    let mut left = Left::default();
    let mut traced = Traced::new();
    // Each round leaves more of them alone, or is the last.
    let (vertices, edges) = loop {
        monitor.check()?;
        if let Some(found) = drawn.moved(&mut left, &mut traced) {
            break found;
        }
    };
    let is_met = |(e, edge): (usize, &MapEdge)| {
        let gap = drawn.met(e, &left);
        gap.is_some_and(|gap| gap.line != Line::Touch || is_closed_up(&gap, edge))
    };
    let is_met = edges.iter().enumerate().map(is_met).collect();
    (map.vertices, map.edges) = (vertices, edges);
    Ok(Meeting {
        is_met,
        loose: left.loose,
    })
}

/// Paths of creases by edge and ends, so that a round costs what has changed.
type Traced = BTreeMap<(usize, [u64; 4]), Option<PiecewiseCubic<2>>>;

/// The map as it was drawn.
struct Drawn<'a> {
    map: &'a PlanarMap,
    /// Of each edge whose surfaces intersect or touch along it.
    gaps: Vec<Option<Gap<'a>>>,
    /// Edges at each vertex.
    around: Vec<Vec<usize>>,
    conflicts: BTreeSet<Conflict>,
    /// Of each loop.
    areas: Vec<f64>,
    surfaces: &'a [(&'a PatchSurface, f64)],
    placement: Placement,
}

impl Drawn<'_> {
    /// Vertices and edges with the creases on their intersections. `None` where some could not be
    /// put there: they are left alone from then on.
    fn moved(&self, left: &mut Left, traced: &mut Traced) -> Option<(Vec<[f64; 2]>, Vec<MapEdge>)> {
        let known = left.clone();
        let mut vertices = self.map.vertices.clone();
        for (v, vertex) in vertices.iter_mut().enumerate() {
            self.place(v, vertex, left);
        }
        if *left != known {
            return None;
        }
        let mut edges = self.map.edges.clone();
        for (e, edge) in edges.iter_mut().enumerate() {
            let ends = [edge.start, edge.end].map(|v| vertices[v]);
            if let Some(gap) = self.met(e, left) {
                let key = [ends[0][0], ends[0][1], ends[1][0], ends[1][1]].map(f64::to_bits);
                let path = traced
                    .entry((e, key))
                    .or_insert_with(|| crease(&gap, edge, ends));
                match path {
                    Some(path) => edge.path = path.clone(),
                    None => {
                        left.edges.insert(e);
                    }
                }
                continue;
            }
            let by = [edge.start, edge.end].map(|v| minus(vertices[v], self.map.vertices[v]));
            if by.iter().all(|by| norm(*by) == 0.0) {
                continue;
            }
            let aside = [(edge.start, by[0]), (edge.end, by[1])];
            let aside = aside.map(|(v, by)| cross(leaving(edge, v), by).abs());
            edge.is_settled &= aside.iter().all(|aside| *aside <= ASTRAY);
            match led(edge, ends, by) {
                Some(path) => edge.path = path,
                None => left.vertices.extend([edge.start, edge.end]),
            }
        }
        if *left != known {
            return None;
        }
        let leave = |e: usize, left: &mut Left| {
            left.edges.insert(e);
            let edge = &self.map.edges[e];
            left.vertices.extend([edge.start, edge.end]);
        };
        for (e, (edge, drawn)) in edges.iter().zip(&self.map.edges).enumerate() {
            if edge.path != drawn.path && (turns_round(edge, drawn) || !self.is_covered(edge)) {
                leave(e, left);
            }
        }
        let found = crossings(self.map, &vertices, &edges);
        for (a, b) in found.difference(&self.conflicts) {
            leave(*a, left);
            leave(*b, left);
        }
        let loops = self.map.loops.iter().flatten();
        let now = areas(self.map, &edges);
        for (uses, (before, now)) in loops.zip(self.areas.iter().zip(now)) {
            let share = now / before;
            if !(LEAST_AREA..=MOST_AREA).contains(&share) {
                uses.iter().for_each(|(e, _)| leave(*e, left));
            }
        }
        (*left == known).then_some((vertices, edges))
    }

    /// Whether the surfaces of an edge's sides reach as far as it does.
    fn is_covered(&self, edge: &MapEdge) -> bool {
        let places = edge.path.sampled(PER_PIECE);
        let sides = edge.sides.iter();
        let surfaces = sides.filter_map(|side| self.surfaces.get((*side as usize).checked_sub(1)?));
        surfaces.into_iter().all(|(surface, _)| {
            let (u, v) = (surface.u_domain(), surface.v_domain());
            places.iter().all(|place| {
                let [x, y] = self.placement.to_mm(*place);
                (u.0..=u.1).contains(&x) && (v.0..=v.1).contains(&y)
            })
        })
    }

    /// The surfaces of an edge that is to lie where they intersect.
    fn met(&self, e: usize, left: &Left) -> Option<Gap<'_>> {
        self.gaps[e].filter(|_| !left.edges.contains(&e))
    }

    /// Of creases without a common place the one without which the others have one, of several the
    /// shortest; a smooth join rather than a crease, since there the surfaces are hardly apart. Where
    /// more than one is too many, the one that is the farthest off.
    fn odd(
        &self,
        v: usize,
        place: [f64; 2],
        meeting: &[(usize, Gap<'_>)],
        outlines: &[[f64; 2]],
    ) -> Option<usize> {
        let length = |e: usize| {
            let (first, last) = self.map.edges[e].path.domain();
            last - first
        };
        let is_odd = |own: &&(usize, Gap<'_>)| {
            let others = meeting.iter().filter(|other| other.0 != own.0);
            let others: Vec<Gap<'_>> = others.map(|(_, gap)| *gap).collect();
            let mut outlines = outlines.to_vec();
            outlines.push(leaving(&self.map.edges[own.0], v));
            common(&others, &outlines, place).is_some()
        };
        let least = |a: &&(usize, Gap<'_>), b: &&(usize, Gap<'_>)| {
            let is_crease = |own: &(usize, Gap<'_>)| own.1.line != Line::Touch;
            let lengths = length(a.0).total_cmp(&length(b.0));
            is_crease(a).cmp(&is_crease(b)).then(lengths)
        };
        if meeting.len() < 2 {
            return None;
        }
        let odd = meeting.iter().filter(is_odd).min_by(least);
        let odd = odd.map(|(e, _)| *e);
        odd.or_else(|| worst(meeting, place).map(|(e, _)| e))
    }

    /// Puts a vertex where its creases meet, or leaves it, or one of them, alone.
    fn place(&self, v: usize, vertex: &mut [f64; 2], left: &mut Left) {
        let of_vertex = self.around[v].iter();
        let meeting: Vec<(usize, Gap<'_>)> = of_vertex
            .filter_map(|&e| Some((e, self.met(e, left)?)))
            .collect();
        if !meeting.is_empty() && !left.vertices.contains(&v) {
            let of_vertex = self.around[v].iter();
            let outlines: Vec<[f64; 2]> = of_vertex
                .filter(|e| self.met(**e, left).is_none())
                .map(|&e| leaving(&self.map.edges[e], v))
                .collect();
            let all: Vec<Gap<'_>> = meeting.iter().map(|(_, gap)| *gap).collect();
            if let Some(place) = common(&all, &outlines, *vertex) {
                *vertex = place;
            } else if let Some(e) = self.odd(v, *vertex, &meeting, &outlines) {
                // Without it the others have a corner, or may have.
                left.edges.insert(e);
                left.loose.insert((e, v));
                return;
            } else {
                left.vertices.insert(v);
            }
        }
        // What is too far apart there cannot end there.
        if let Some((e, off_mm)) = worst(&meeting, *vertex)
            && (off_mm.is_nan() || off_mm > CORNER_MM)
        {
            left.edges.insert(e);
            left.loose.insert((e, v));
        }
    }
}

/// The crease whose surfaces are the farthest apart at a place, and how far.
fn worst(meeting: &[(usize, Gap<'_>)], place: [f64; 2]) -> Option<(usize, f64)> {
    let off = |(e, gap): &(usize, Gap<'_>)| {
        let (gap_mm, slope) = gap.at(place);
        // On a steep wall a little aside is a lot up or down.
        (*e, gap_mm.abs() / norm(slope).max(1.0))
    };
    meeting.iter().map(off).max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Where creases meet near a place, between outlines that leave it.
fn common(creases: &[Gap<'_>], outlines: &[[f64; 2]], place: [f64; 2]) -> Option<[f64; 2]> {
    let is_lone_end = creases.len() == 1 && !outlines.is_empty();
    let least = if is_lone_end { LONE_END } else { 0.0 };
    let farthest = creases.iter().map(|gap| reach(gap).farthest);
    let farthest = farthest.fold(least, f64::max);
    let least_bend = creases.iter().map(|gap| reach(gap).least_bend);
    let least_bend = least_bend.fold(REACH.least_bend, f64::min);
    let found = corner(creases, outlines, place, farthest, least_bend);
    // Outlines that run beside the crease lead along it rather than to it.
    found.or_else(|| {
        let own = creases.first().filter(|_| is_lone_end)?;
        own.nearest(place, reach(own))
    })
}

/// Signed areas of all loops, square pitches.
fn areas(map: &PlanarMap, edges: &[MapEdge]) -> Vec<f64> {
    let area = |uses: &Vec<(usize, bool)>| {
        let mut polygon = Vec::new();
        for &(e, reversed) in uses {
            let mut places = edges[e].path.sampled(PER_PIECE);
            if reversed {
                places.reverse();
            }
            polygon.extend(places);
        }
        polygon.extend(polygon.first().copied());
        signed_area(&polygon)
    };
    map.loops.iter().flatten().map(area).collect()
}

/// The path of a crease between its vertices.
fn crease(gap: &Gap<'_>, edge: &MapEdge, ends: [[f64; 2]; 2]) -> Option<PiecewiseCubic<2>> {
    let mut on = ends;
    for (k, end) in ends.into_iter().enumerate() {
        let off_mm = gap.at(end).0.abs();
        let is_on = off_mm <= EXACT_MM || gap.is_blunt(end, reach(gap));
        if !is_on {
            on[k] = gap.nearest(end, reach(gap))?;
        }
    }
    let path = trace(gap, &edge.path, on, reach(gap))?;
    if on == ends {
        return Some(path);
    }
    bent::<Beam>(&path, None, [0, 1].map(|k| minus(ends[k], on[k])))
}

/// Unit vector along an edge where it leaves a vertex.
fn leaving(edge: &MapEdge, vertex: usize) -> [f64; 2] {
    let (first, last) = edge.path.domain();
    let at = if edge.start == vertex { first } else { last };
    let along = edge.path.derivative(at, 1);
    let speed = norm(along);
    if speed > 0.0 {
        along.map(|c| c / speed)
    } else {
        [0.0; 2]
    }
}

/// The path of an edge that follows its vertices: a straight one stays straight, and one whose ends
/// come so near to each other that it would be a hairpin becomes straight.
fn led(
    edge: &MapEdge,
    [start, end]: [[f64; 2]; 2],
    moves: [[f64; 2]; 2],
) -> Option<PiecewiseCubic<2>> {
    let is_straight = match edge.path.pieces.as_slice() {
        [piece] => piece.iter().all(|c| c[2] == 0.0 && c[3] == 0.0),
        _ => false,
    };
    if !is_straight {
        let path = bent::<Beam>(&edge.path, None, moves)?;
        if !turns_back(&path, &edge.path) {
            return Some(path);
        }
        if edge.path.arc_length() > SHORT {
            return None;
        }
    }
    PiecewiseCubic::line(start, end, norm(minus(end, start))).ok()
}

/// Pairs of edges that cross, touch or fold back.
fn crossings(map: &PlanarMap, vertices: &[[f64; 2]], edges: &[MapEdge]) -> BTreeSet<Conflict> {
    debug_assert_eq!(map.edges.len(), edges.len());
    let strands: Vec<Strand> = edges
        .iter()
        .enumerate()
        .map(|(e, edge)| Strand::new(e, &edge.path, vertices[edge.start], vertices[edge.end]))
        .collect();
    conflicts(&strands)
}

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;

    use super::testing::{PLACEMENT, plane};
    use super::*;
    use crate::border::path::polyline;

    /// Two planes that meet where the row is a quarter of the column, and 17. Of the crease between
    /// them the last vertex is drawn so many rows aside, between outlines along the last column.
    fn drawn(aside: f64) -> PlanarMap {
        let vertices = vec![[0.0, 17.0], [40.0, 27.0 + aside], [40.0, 0.0], [40.0, 40.0]];
        let edge = |start: usize, end: usize, sides: [u32; 2]| {
            let mut places = vec![vertices[start], vertices[end]];
            if sides == [1, 2] {
                places.insert(1, [38.0, 26.5]);
            }
            MapEdge {
                start,
                end,
                sides,
                path: polyline(&places).unwrap(),
                is_settled: true,
                is_kept: false,
            }
        };
        PlanarMap {
            edges: vec![edge(0, 1, [1, 2]), edge(2, 1, [0, 2]), edge(1, 3, [0, 1])],
            vertices,
            ..PlanarMap::default()
        }
    }

    /// Whether the crease is met, and where its last vertex comes to lie.
    fn met(aside: f64, surfaces: [&PatchSurface; 2]) -> (bool, [f64; 2]) {
        let mut map = drawn(aside);
        let is_crease = [true, false, false];
        let sides = surfaces.map(|surface| (surface, 0.01));
        let found = meet(&mut map, &sides, &is_crease, PLACEMENT, &Unmonitored).unwrap();
        (found.is_met[0], map.vertices[1])
    }

    #[test]
    fn a_crease_is_led_to_its_end_between_outlines() {
        let (a, b) = (plane(1.0, 0.25, 0.0), plane(0.0, 0.0, 1.0));
        for aside in [0.3, 1.2, -1.8] {
            let (is_met, [column, row]) = met(aside, [&a, &b]);
            assert!(is_met, "{aside}");
            assert!((column - 40.0).abs() < 0.1, "{column}");
            assert!((row - 17.0 - column / 4.0).abs() < 1e-6, "{row}");
        }
        assert_eq!(met(4.0, [&a, &b]), (false, [40.0, 31.0]));
    }

    /// Two creases from one vertex on, the first longer, whose lines cross three columns off.
    #[test]
    fn of_creases_without_a_common_place_the_shorter_one_is_left() {
        let vertices = vec![[10.0, 20.0], [40.0, 20.0], [25.0, 23.0]];
        let edge = |end: usize, sides: [u32; 2]| MapEdge {
            start: 0,
            end,
            sides,
            path: polyline(&[vertices[0], vertices[end]]).unwrap(),
            is_settled: true,
            is_kept: false,
        };
        let edges = vec![edge(1, [1, 2]), edge(2, [1, 3])];
        let mut map = PlanarMap {
            edges,
            vertices: vertices.clone(),
            ..PlanarMap::default()
        };
        // The first crease is in row 20.35, the second a quarter of a row off where it is drawn.
        let flat = plane(0.0, 0.0, 0.0);
        let of = |place: [f64; 2], slope: f64| {
            let [x, y] = PLACEMENT.to_mm(place);
            plane(-(y - slope * x), -slope, 1.0)
        };
        let (first, second) = (of([10.0, 20.35], 0.0), of([10.0, 19.75], 0.2));
        let sides = [&flat, &first, &second].map(|surface| (surface, 0.01));
        let found = meet(&mut map, &sides, &[true; 2], PLACEMENT, &Unmonitored).unwrap();
        assert_eq!(found.is_met, [true, false]);
        assert_eq!(found.loose, BTreeSet::from([(1, 0)]));
        assert!(
            (map.vertices[0][1] - 20.35).abs() < 1e-6,
            "{:?}",
            map.vertices
        );
    }

    #[test]
    fn beside_an_outline_that_runs_along_it_a_crease_ends_where_it_is_nearest() {
        // The crease is in row 20, an outline leaves the vertex nearly along it.
        let (flat, tilted) = (plane(0.0, 0.0, 0.0), plane(0.0, 0.0, 0.5));
        let crease = Gap {
            sides: [&tilted, &flat],
            placement: PLACEMENT,
            line: Line::Intersection,
        };
        let along = [0.995, 0.1];
        let [column, row] = common(&[crease], &[along], [10.0, 21.2]).unwrap();
        assert!((column - 10.0).abs() < 1e-9 && (row - 20.0).abs() < 1e-9);
        assert_eq!(common(&[crease], &[along], [10.0, 22.2]), None);
    }

    #[test]
    fn a_crease_is_loose_from_the_vertex_that_is_not_on_it() {
        let (a, b) = (plane(1.0, 0.25, 0.0), plane(0.0, 0.0, 1.0));
        let mut map = drawn(4.0);
        let sides = [&a, &b].map(|surface| (surface, 0.01));
        let is_crease = [true, false, false];
        let found = meet(&mut map, &sides, &is_crease, PLACEMENT, &Unmonitored).unwrap();
        assert_eq!(found.loose, BTreeSet::from([(0, 1)]));
    }

    #[test]
    fn a_short_border_that_would_become_a_hairpin_becomes_straight() {
        let edge = |end: [f64; 2], via: [f64; 2]| MapEdge {
            start: 0,
            end: 1,
            sides: [1, 2],
            path: polyline(&[[10.0, 20.0], via, end]).unwrap(),
            is_settled: true,
            is_kept: false,
        };
        let led = |edge: &MapEdge, end: [f64; 2]| {
            let from = edge.path.end();
            led(edge, [[10.0, 20.0], end], [[0.0; 2], minus(end, from)])
        };
        let short = edge([11.0, 20.0], [10.5, 20.1]);
        assert!(led(&short, [11.2, 20.1]).unwrap().pieces.len() > 1);
        let straight = led(&short, [10.05, 20.0]).unwrap();
        assert_eq!((straight.pieces.len(), straight.end()), (1, [10.05, 20.0]));
        let long = edge([14.0, 20.0], [12.0, 20.1]);
        assert_eq!(led(&long, [10.05, 20.0]), None);
    }

    #[test]
    fn faint_creases_have_ends_and_corners_as_well() {
        let (flat, gentle) = (plane(0.0, 0.0, 0.0), plane(0.0, 0.0, 0.03));
        let faint = Gap {
            sides: [&gentle, &flat],
            placement: PLACEMENT,
            line: Line::Faint,
        };
        let [column, row] = common(&[faint], &[], [10.0, 22.0]).unwrap();
        assert!((column - 10.0).abs() < 1e-9 && (row - 20.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_apart_on_a_steep_wall_is_near_aside() {
        let (flat, steep, gentle) = (
            plane(0.0, 0.0, 0.0),
            plane(0.06, 4.0, 0.0),
            plane(0.03, 0.5, 0.0),
        );
        let gap = |side| Gap {
            sides: [side, &flat],
            placement: PLACEMENT,
            line: Line::Intersection,
        };
        let (e, off_mm) = worst(&[(5, gap(&steep)), (7, gap(&gentle))], [20.0, 20.0]).unwrap();
        assert_eq!(e, 7);
        assert!((off_mm - 0.03).abs() < 1e-12, "{off_mm}");
    }

    #[test]
    fn no_crease_is_led_to_where_a_surface_does_not_reach() {
        // 9.9 mm are less than column 40.
        let breaks = [vec![-30.0, 9.9], vec![-30.0, 30.0]];
        let [u, v] = breaks;
        let z = |i: usize, _: usize| 1.0 + 0.25 * (-30.0 + 13.3 * i as f64);
        let short = PatchSurface::through_thirds(u, v, z).unwrap();
        let flat = plane(0.0, 0.0, 1.0);
        assert_eq!(met(1.2, [&short, &flat]), (false, [40.0, 28.2]));
    }
}
