//! The model's edges as lines.

use std::collections::BTreeMap;

use mesh_files::{Drawn, ScenePrimitive};
use nurbs::PiecewiseCubic;
use reconstruct::{EdgeKind, EdgeOrigin, Model};
use serde_json::json;

use super::{EDGES_BYTES, bytes};

/// Most lines for a piece of a curve.
const MOST_LINES: f64 = 64.0;
/// Times that lines are made coarser to keep their budget, four times as coarse each time.
const COARSER: usize = 8;
/// Curves of an edge that lie as near to each other as this are shown once, millimetres: as for the
/// seams of triangles.
const SHARED_MM: f64 = 0.05;
/// Places at which two curves of an edge are held against each other.
const LOOKS: u32 = 8;
const DARK: [u8; 3] = [38, 42, 48];

/// One primitive for each way of knowing where an edge runs and each kind of edge. A crease is there
/// once; a step is there on either side, for these are apart.
pub(super) fn edges(model: &Model, tolerance_mm: f64) -> Vec<ScenePrimitive> {
    let curves = curves(model);
    let mut tolerance_mm = tolerance_mm;
    for _ in 0..=COARSER {
        let lines = lines(model, &curves, tolerance_mm);
        if lines.iter().map(bytes).sum::<usize>() <= EDGES_BYTES {
            return lines;
        }
        tolerance_mm *= 4.0;
    }
    Vec::new()
}

type Curve<'a> = (usize, &'a PiecewiseCubic<3>);

/// Curves in space with the indices of their edges, in the order of these.
fn curves(model: &Model) -> Vec<Curve<'_>> {
    let mut of: BTreeMap<usize, Vec<(&PiecewiseCubic<3>, bool)>> = BTreeMap::new();
    let faces = model.faces.iter();
    let loops = faces.flat_map(|face| std::iter::once(&face.outer).chain(&face.inner));
    for coedge in loops.flat_map(|border| &border.coedges) {
        let curve = (&coedge.space_curve, coedge.reversed);
        if curve.0.validate().is_err() {
            continue;
        }
        let known = of.entry(coedge.edge.0).or_default();
        if !known.iter().any(|other| are_one(*other, curve)) {
            known.push(curve);
        }
    }
    let curves = of.into_iter();
    curves
        .flat_map(|(edge, curves)| curves.into_iter().map(move |(curve, _)| (edge, curve)))
        .collect()
}

/// Whether two curves of an edge are one as far as the eye can tell.
fn are_one(a: (&PiecewiseCubic<3>, bool), b: (&PiecewiseCubic<3>, bool)) -> bool {
    let at = |(curve, reversed): (&PiecewiseCubic<3>, bool), share: f64| {
        let (first, last) = curve.domain();
        let share = if reversed { 1.0 - share } else { share };
        curve.evaluate(first + share * (last - first))
    };
    (0..=LOOKS).all(|look| {
        let share = f64::from(look) / f64::from(LOOKS);
        let (p, q) = (at(a, share), at(b, share));
        let square: f64 = p.iter().zip(q).map(|(p, q)| (p - q) * (p - q)).sum();
        square <= SHARED_MM * SHARED_MM
    })
}

fn lines(model: &Model, curves: &[Curve<'_>], tolerance_mm: f64) -> Vec<ScenePrimitive> {
    let mut sorts: BTreeMap<(&str, &str), ScenePrimitive> = BTreeMap::new();
    for (edge, curve) in curves {
        let Some(edge) = model.edges.get(*edge) else {
            continue;
        };
        let sort = (origin(edge.origin), kind(edge.kind));
        let lines = sorts.entry(sort).or_insert_with(|| ScenePrimitive {
            drawn: Drawn::Lines,
            places_mm: Vec::new(),
            normals: Vec::new(),
            numbers: Vec::new(),
            indices: Vec::new(),
            colour: DARK,
            extras: json!({ "kind": sort.0, "border": sort.1 }),
        });
        let first = lines.places_mm.len() as u32;
        let places = polyline(curve, tolerance_mm);
        lines
            .places_mm
            .extend(places.iter().map(|p| p.map(|c| c as f32)));
        let last = lines.places_mm.len() as u32;
        lines
            .indices
            .extend((first + 1..last).flat_map(|k| [k - 1, k]));
    }
    sorts.into_values().collect()
}

/// Places on a curve whose straight lines lie within a tolerance of it: the second derivative of a
/// cubic is the greatest at one of its ends.
fn polyline(curve: &PiecewiseCubic<3>, tolerance_mm: f64) -> Vec<[f64; 3]> {
    let mut places = vec![curve.start()];
    for (piece, bounds) in curve.breaks.windows(2).enumerate() {
        let &[from, to] = bounds else {
            continue;
        };
        let width = to - from;
        let bend = [0.0, width]
            .map(|s| curve.piece_value(piece, s, 2))
            .map(|second| second.iter().map(|c| c * c).sum::<f64>().sqrt());
        let lines = width * (bend[0].max(bend[1]) / (8.0 * tolerance_mm)).sqrt();
        let lines = lines.ceil().clamp(1.0, MOST_LINES);
        for k in 1..=lines as u32 {
            places.push(curve.piece_value(piece, width * f64::from(k) / lines, 0));
        }
    }
    places
}

fn origin(origin: EdgeOrigin) -> &'static str {
    match origin {
        EdgeOrigin::Measured => "measured",
        EdgeOrigin::Intersected => "intersected",
        EdgeOrigin::Assumed => "assumed",
    }
}

fn kind(kind: EdgeKind) -> &'static str {
    match kind {
        EdgeKind::Silhouette => "silhouette",
        EdgeKind::Step => "step",
        EdgeKind::Crease => "crease",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parabola over `x` from 0 to 8, and a line behind it.
    fn bent() -> PiecewiseCubic<3> {
        let piece = |x: [f64; 4], y: [f64; 4]| [x, y, [5.0, 0.0, 0.0, 0.0]];
        let pieces = vec![
            piece([0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.25, 0.0]),
            piece([8.0, 1.0, 0.0, 0.0], [16.0, 4.0, 0.0, 0.0]),
        ];
        PiecewiseCubic::new(vec![0.0, 8.0, 12.0], pieces).unwrap()
    }

    #[test]
    fn lines_keep_to_the_tolerance_and_are_no_more_than_that_takes() {
        let tolerance_mm = 0.01;
        let places = polyline(&bent(), tolerance_mm);
        // Chords of a parabola lie off by a quarter of the half step squared: 8 mm in n steps.
        assert_eq!(places.len(), 1 + 20 + 1);
        let off = |a: [f64; 3], b: [f64; 3]| {
            let x = f64::midpoint(a[0], b[0]);
            (f64::midpoint(a[1], b[1]) - 0.25 * x * x).abs()
        };
        for pair in places[..21].windows(2) {
            let (off, most) = (off(pair[0], pair[1]), tolerance_mm);
            assert!(off <= most * 1.000_001 && off > 0.9 * most, "{off}");
        }
        assert_eq!(places.last(), Some(&[12.0, 32.0, 5.0]));
    }

    #[test]
    fn a_curve_and_its_reverse_are_one_and_a_step_is_two() {
        let (curve, reverse) = (bent(), bent().reversed());
        assert!(are_one((&curve, false), (&reverse, true)));
        assert!(!are_one((&curve, false), (&reverse, false)));
        let mut below = bent();
        for piece in &mut below.pieces {
            piece[2][0] -= 0.06;
        }
        assert!(!are_one((&curve, false), (&below, false)));
    }
}
