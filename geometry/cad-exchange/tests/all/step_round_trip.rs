//! What is written as STEP is read back.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::sample;

use cad_exchange::step::{
    self, DEFAULT_PALETTE, LengthUnit, Schema, StepModel, StepSurface, Summary, WriteOptions,
};
use reconstruct::{Model, Surface};

fn options(schema: Schema, unit: LengthUnit) -> WriteOptions {
    WriteOptions {
        schema,
        unit,
        author: "A. 'Author' \\ \u{e4}\u{1f600}".to_owned(),
        organization: "Workshop, Ltd.; Seoul".to_owned(),
        ..WriteOptions::new("sample", "2026-11-21T09:30:00Z")
    }
}

fn round_trip(model: &Model, options: &WriteOptions) -> (StepModel, Summary) {
    let mut file = Vec::new();
    let summary = step::write(model, options, &mut file).unwrap();
    (step::read_model(&file[..]).unwrap(), summary)
}

fn near(a: &[f64], b: &[f64], tolerance: f64) {
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() < tolerance, "{a} {b}");
    }
}

/// Largest height of a point over a carrier that is a graph over the x-y plane.
fn height(surface: &StepSurface, [x, y, z]: [f64; 3]) -> f64 {
    match surface {
        StepSurface::Plane {
            origin_mm, normal, ..
        } => {
            let off = normal[0] * (x - origin_mm[0]) + normal[1] * (y - origin_mm[1]);
            z - origin_mm[2] + off / normal[2]
        }
        StepSurface::BSpline(spline) => z - spline.evaluate(x, y)[2],
        other => panic!("{other:?}"),
    }
}

#[test]
fn header_names_and_colours() {
    for schema in [Schema::Ap242, Schema::Ap214] {
        let options = options(schema, LengthUnit::Millimetre);
        let (read, summary) = round_trip(&sample::model(), &options);
        let name = match schema {
            Schema::Ap242 => {
                "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 1 1 4 }"
            }
            Schema::Ap214 => "AUTOMOTIVE_DESIGN { 1 0 10303 214 3 1 1 }",
        };
        assert_eq!(read.schema, name);
        assert_eq!(read.product, "sample");
        assert_eq!(read.author, options.author);
        assert_eq!(read.organization, options.organization);
        assert_eq!(read.timestamp, "2026-11-21T09:30:00Z");
        assert_eq!((read.unit_mm, read.uncertainty_mm), (1.0, 1e-4));
        assert_eq!(read.uncertainty_mm, summary.uncertainty_mm);
        assert!(read.unknown.is_empty(), "{:?}", read.unknown);
        let faces: Vec<_> = read
            .faces
            .iter()
            .map(|face| (face.name.as_str(), face.colour))
            .collect();
        assert_eq!(
            faces,
            [
                ("Barrel", Some(DEFAULT_PALETTE[1])),
                ("Ramp", Some(DEFAULT_PALETTE[2]))
            ]
        );
    }
}

#[test]
fn every_shade() {
    let model = sample::model();
    for shade in 0..=255 {
        let palette = vec![[shade, 255 - shade, 7], [shade, shade / 2, 255]];
        let options = WriteOptions {
            palette,
            ..options(Schema::Ap242, LengthUnit::Millimetre)
        };
        let (read, _) = round_trip(&model, &options);
        assert_eq!(read.faces[0].colour, Some([shade, shade / 2, 255]));
        assert_eq!(read.faces[1].colour, Some([shade, 255 - shade, 7]));
    }
}

/// The crease is one edge of both faces, run once each way; all else is edges of one face.
#[test]
fn faces_share_their_crease() {
    let (read, summary) = round_trip(
        &sample::model(),
        &options(Schema::Ap242, LengthUnit::Millimetre),
    );
    assert_eq!(read.shells, [[0, 1]]);
    assert_eq!((read.vertices_mm.len(), read.edges.len()), (7, 8));
    let counts = (summary.shells, summary.edges, summary.shared_edges);
    assert_eq!(counts, (1, 8, 1));
    assert_eq!((summary.partly_shared, summary.parted_creases), (0, 0));
    let mut used = vec![[0, 0]; read.edges.len()];
    for face in &read.faces {
        let loops = std::iter::once(&face.outer).chain(&face.inner);
        for of in loops.flatten() {
            used[of.edge][usize::from(of.reversed)] += 1;
        }
    }
    let shared = used.iter().filter(|&&uses| uses == [1, 1]).count();
    let own = used.iter().filter(|&&uses| uses == [1, 0]).count();
    assert_eq!((shared, own), (1, 7), "{used:?}");
}

#[test]
fn shapes_are_the_same_in_either_unit() {
    let model = sample::model();
    for unit in [LengthUnit::Millimetre, LengthUnit::Inch] {
        let (read, _) = round_trip(&model, &options(Schema::Ap242, unit));
        assert_eq!(read.unit_mm, unit.mm());
        near(&[read.uncertainty_mm], &[1e-4], 1e-16);
        for (face, original) in read.faces.iter().zip(&model.faces) {
            let Surface::Patches(patches) = &original.surface;
            let ((u0, u1), (v0, v1)) = (patches.u_domain(), patches.v_domain());
            for i in 0..=17 {
                for j in 0..=17 {
                    let u = u0 + (u1 - u0) * f64::from(i) / 17.0;
                    let v = v0 + (v1 - v0) * f64::from(j) / 17.0;
                    let off = height(&face.surface, patches.evaluate(u, v));
                    assert!(off.abs() < 1e-9, "{off}");
                }
            }
            let borders = std::iter::once(&original.outer).chain(&original.inner);
            let loops = std::iter::once(&face.outer).chain(&face.inner);
            for (border, uses) in borders.zip(loops) {
                assert_eq!(border.coedges.len(), uses.len());
                for (coedge, of) in border.coedges.iter().zip(uses) {
                    let edge = &read.edges[of.edge];
                    let own = &coedge.space_curve;
                    let (first, last) = own.domain();
                    for k in 0..=50 {
                        let part = f64::from(k) / 50.0;
                        let t = first + (last - first) * part;
                        let there = if of.reversed { first + last - t } else { t };
                        near(&edge.curve.evaluate(there), &own.evaluate(t), 1e-9);
                    }
                    let [start, end] = edge.vertices.map(|v| read.vertices_mm[v]);
                    let points = edge.curve.points();
                    near(&points[0], &start, 1e-12);
                    near(points.last().unwrap(), &end, 1e-12);
                }
            }
        }
    }
}

/// The barrel is a spline, the ramp a plane.
#[test]
fn a_flat_face_is_a_plane() {
    let (read, _) = round_trip(
        &sample::model(),
        &options(Schema::Ap242, LengthUnit::Millimetre),
    );
    assert!(matches!(read.faces[0].surface, StepSurface::BSpline(_)));
    let StepSurface::Plane { normal, .. } = &read.faces[1].surface else {
        panic!("{:?}", read.faces[1].surface);
    };
    let length = 1.25_f64.sqrt();
    near(normal, &[0.5 / length, 0.0, 1.0 / length], 1e-12);
}

/// Closed forms: the barrel's by Green's theorem in the sample, the centroid of the ramp
/// by that of its plan.
#[test]
fn area_and_centroid_are_those_of_the_part() {
    let model = sample::model();
    let whole: f64 = sample::areas_mm2().iter().sum();
    for unit in [LengthUnit::Millimetre, LengthUnit::Inch] {
        let (read, summary) = round_trip(&model, &options(Schema::Ap242, unit));
        let area = read.area_mm2.unwrap();
        assert!((area / whole - 1.0).abs() < 1e-7, "{area} {whole}");
        near(&[summary.area_mm2], &[area], 1e-9);
        near(&summary.centroid_mm, &read.centroid_mm.unwrap(), 1e-9);
    }
    let mut ramp = model;
    ramp.faces.remove(0);
    let (read, _) = round_trip(&ramp, &options(Schema::Ap242, LengthUnit::Millimetre));
    // Width 25 - 5 s(t) at y = 30 t, with s = 3 t^2 - 2 t^3, whose integrals over 0 to 1
    // are 1/2 (s), 13/35 (s^2) and 7/20 (s t).
    let plan = 30.0 * (25.0 - 5.0 * 0.5);
    let x = 20.0 + 30.0 * 0.5 * (625.0 - 250.0 * 0.5 + 25.0 * 13.0 / 35.0) / plan;
    let y = 900.0 * (25.0 * 0.5 - 5.0 * 0.35) / plan;
    let z = 10.0 - (x - 20.0) / 2.0;
    near(&read.centroid_mm.unwrap(), &[x, y, z], 1e-9);
}

/// A height that grows along the crease: shared as far as it is small, and the file's
/// uncertainty covers what is shared.
#[test]
fn faces_that_part_keep_edges_of_their_own_from_there() {
    let raised = |at: f64, slope: f64| {
        let mut model = sample::model();
        let ramp = model.faces.remove(1);
        model.faces.push(sample::raised(&ramp, &model, at, slope));
        model
    };
    let options = options(Schema::Ap242, LengthUnit::Millimetre);
    // Nowhere further than 0.03 mm apart in z, and still a plane: the crease runs where that meets
    // the barrel.
    let (read, summary) = round_trip(&raised(0.0, 0.001), &options);
    assert_eq!((summary.shared_edges, summary.partly_shared), (1, 0));
    assert!(summary.uncertainty_mm < 0.001, "{summary:?}");
    near(&[read.uncertainty_mm], &[summary.uncertainty_mm], 1e-15);
    assert_eq!((read.edges.len(), read.vertices_mm.len()), (8, 7));
    // By 0.169 mm in z at its end, where they still meet near by; outlines are led there.
    let (read, summary) = round_trip(&raised(18.75, 0.015), &options);
    assert_eq!((summary.shared_edges, summary.partly_shared), (1, 0));
    assert!(summary.uncertainty_mm < 0.015, "{summary:?}");
    assert_eq!((read.edges.len(), read.vertices_mm.len()), (8, 7));
    // By 0.225 mm they do not: the edge is half way between them.
    let (_, summary) = round_trip(&raised(18.75, 0.02), &options);
    assert_eq!((summary.shared_edges, summary.partly_shared), (1, 0));
    assert!(
        summary.uncertainty_mm > 0.015 && summary.uncertainty_mm < 0.1125,
        "{summary:?}"
    );
    // By 2.25 mm there. The ramp faces the camera more squarely than the barrel beside it: what
    // counts is how far the curves are off it, and they are shared to 0.3 mm.
    let squarer = 1.0 / 1.29_f64.sqrt();
    let parted_mm = 18.75 + 0.3 / squarer / 0.2;
    let (read, summary) = round_trip(&raised(18.75, 0.2), &options);
    assert_eq!((summary.shared_edges, summary.partly_shared), (1, 1));
    assert!(
        summary.uncertainty_mm > 0.055 && summary.uncertainty_mm < 0.155,
        "{summary:?}"
    );
    assert_eq!((read.edges.len(), read.vertices_mm.len()), (10, 9));
    assert_eq!(read.shells, [[0, 1]]);
    let shared: Vec<f64> = read
        .vertices_mm
        .iter()
        .map(|v| v[1])
        .filter(|y| (y - parted_mm).abs() < 0.1)
        .collect();
    assert_eq!(shared.len(), 1, "one vertex where they part");
    // By more than 0.3 mm along most of it.
    let (read, summary) = round_trip(&raised(0.0, 0.2), &options);
    assert_eq!((summary.shared_edges, summary.parted_creases), (0, 1));
    assert_eq!(summary.uncertainty_mm, 1e-4);
    assert_eq!(read.shells, [[0], [1]]);
    assert_eq!((read.edges.len(), read.vertices_mm.len()), (9, 9));
}

#[test]
fn a_step_is_never_shared() {
    let mut model = sample::model();
    model.edges[1].kind = reconstruct::EdgeKind::Step;
    let (read, summary) = round_trip(&model, &options(Schema::Ap242, LengthUnit::Millimetre));
    assert_eq!((summary.shared_edges, summary.parted_creases), (0, 0));
    assert_eq!(read.shells, [[0], [1]]);
}
