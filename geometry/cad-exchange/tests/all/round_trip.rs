//! What is written is read back.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::sample;

use cad_exchange::iges::{
    self, DEFAULT_PALETTE, Entities, SplineCurve, TrimmedCurve, TrimmedModel, TrimmedSurface,
    WriteOptions,
};
use reconstruct::{EdgeId, EdgeKind, Loop, Model, Surface};

const ALL: [Entities; 3] = [
    Entities::Parametric114,
    Entities::Rational128,
    Entities::Analytic,
];

fn near(a: &[f64], b: &[f64]) {
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

fn round_trip(entities: Entities) -> TrimmedModel {
    round_trip_of(&sample::model(), entities)
}

fn round_trip_of(model: &Model, entities: Entities) -> TrimmedModel {
    let options = WriteOptions {
        entities,
        author: "A. Author".to_owned(),
        organization: "Workshop, Ltd.; Seoul".to_owned(),
        ..WriteOptions::new("sample", "20261121.093000")
    };
    let mut file = Vec::new();
    iges::write(model, &options, &mut file).unwrap();
    iges::read_model(&file[..]).unwrap()
}

#[test]
fn names_colours_and_the_rest() {
    for entities in ALL {
        let read = round_trip(entities);
        assert_eq!(read.product, "sample");
        assert_eq!(read.author, "A. Author");
        assert_eq!(read.organization, "Workshop, Ltd.; Seoul");
        assert_eq!(read.timestamp, "20261121.093000");
        assert_eq!(read.resolution_mm, 1e-4);
        let faces: Vec<_> = read
            .faces
            .iter()
            .map(|face| (face.name.as_deref(), face.level, face.colour))
            .collect();
        assert_eq!(
            faces,
            [
                (Some("Barrel"), 1, Some(DEFAULT_PALETTE[1])),
                (Some("Ramp"), 2, Some(DEFAULT_PALETTE[2]))
            ]
        );
    }
}

/// Every colour survives its way through percentages.
#[test]
fn every_shade() {
    let mut model = sample::model();
    for shade in 0..=255 {
        let options = WriteOptions {
            palette: vec![[shade, 255 - shade, 7], [shade, shade / 2, 255]],
            ..WriteOptions::new("sample", "20261121.093000")
        };
        model.faces.truncate(1);
        let mut file = Vec::new();
        iges::write(&model, &options, &mut file).unwrap();
        let colour = iges::read_model(&file[..]).unwrap().faces[0].colour;
        assert_eq!(colour, Some([shade, shade / 2, 255]));
    }
}

#[test]
fn parametric_splines_are_the_same_shapes() {
    let read = round_trip(Entities::Parametric114);
    let model = sample::model();
    assert_eq!(read.faces.len(), model.faces.len());
    let of = |curve: &TrimmedCurve| match &curve.parameter_curve {
        Some(SplineCurve::Cubic(curve)) => curve.clone(),
        other => panic!("{other:?}"),
    };
    let same = |curves: &[TrimmedCurve], border: &Loop| {
        assert_eq!(curves.len(), border.coedges.len());
        for (curve, coedge) in curves.iter().zip(&border.coedges) {
            // However often the surface has its curve broken.
            assert!(of(curve).pieces.len() <= coedge.parameter_curve.pieces.len());
            // Where faces share it, half way between the two that there are of it.
            let (first, last) = coedge.space_curve.domain();
            for k in 0..=50 {
                let t = first + (last - first) * f64::from(k) / 50.0;
                near(&of(curve).evaluate(t), &coedge.parameter_curve.evaluate(t));
                near(
                    &curve.space_curve.evaluate(t),
                    &coedge.space_curve.evaluate(t),
                );
            }
        }
    };
    for (face, original) in read.faces.iter().zip(&model.faces) {
        let Surface::Patches(patches) = &original.surface;
        assert_eq!(face.surface, TrimmedSurface::Patches(patches.clone()));
        same(&face.outer, &original.outer);
        assert_eq!(face.inner.len(), original.inner.len());
        for (curves, border) in face.inner.iter().zip(&original.inner) {
            same(curves, border);
        }
    }
}

/// Two faces are written on one curve, half way between those that they make of their edge.
#[test]
fn neighbours_share_their_curve_in_every_form() {
    let mut model = sample::model();
    let edge = model.edges.iter().position(|e| e.kind == EdgeKind::Crease);
    let edge = EdgeId(edge.unwrap());
    let mut coedge = model.faces[0].outer.coedges.iter_mut();
    let coedge = coedge.find(|c| c.edge == edge).unwrap();
    for piece in &mut coedge.space_curve.pieces {
        piece[2][0] += 4e-4;
    }
    let raised = coedge.space_curve.clone();
    for entities in ALL {
        let read = round_trip_of(&model, entities);
        let of = |face: usize| {
            let uses = model.faces[face].outer.coedges.iter();
            let at = uses.clone().position(|c| c.edge == edge).unwrap();
            read.faces[face].outer[at].space_curve.clone()
        };
        let (first, second) = (of(0), of(1).reversed());
        let (from, to) = raised.domain();
        for k in 0..=50 {
            let t = from + (to - from) * f64::from(k) / 50.0;
            near(&first.evaluate(t), &second.evaluate(t));
        }
        let middle = (from + to) / 2.0;
        // A plane that is written as one has its edges in it.
        let back_mm = match entities {
            Entities::Analytic => 4e-4,
            _ => 2e-4,
        };
        let [x, y, z] = raised.evaluate(middle);
        near(&first.evaluate(middle), &[x, y, z - back_mm]);
    }
}

#[test]
fn bsplines_are_the_same_shapes() {
    let read = round_trip(Entities::Rational128);
    for (face, original) in read.faces.iter().zip(&sample::model().faces) {
        let Surface::Patches(patches) = &original.surface;
        let TrimmedSurface::BSpline(surface) = &face.surface else {
            panic!("{:?}", face.surface);
        };
        let ((u0, u1), (v0, v1)) = (patches.u_domain(), patches.v_domain());
        for i in 0..=17 {
            for j in 0..=17 {
                let u = u0 + (u1 - u0) * f64::from(i) / 17.0;
                let v = v0 + (v1 - v0) * f64::from(j) / 17.0;
                near(&surface.evaluate(u, v), &patches.evaluate(u, v));
            }
        }
        let borders = std::iter::once(&original.outer).chain(&original.inner);
        let curves = std::iter::once(&face.outer).chain(&face.inner);
        let pairs = curves
            .flatten()
            .zip(borders.flat_map(|border| &border.coedges));
        for (curve, coedge) in pairs {
            let (first, last) = coedge.parameter_curve.domain();
            for k in 0..=50 {
                let t = first + (last - first) * f64::from(k) / 50.0;
                near(
                    &curve.parameter_curve.as_ref().unwrap().evaluate(t),
                    &coedge.parameter_curve.evaluate(t),
                );
                near(
                    &curve.space_curve.evaluate(t),
                    &coedge.space_curve.evaluate(t),
                );
            }
        }
    }
}

#[test]
fn the_same_bytes_every_time() {
    let options = WriteOptions::new("sample", "20261121.093000");
    let write = || {
        let mut file = Vec::new();
        iges::write(&sample::model(), &options, &mut file).unwrap();
        file
    };
    assert_eq!(write(), write());
}
