//! Models that break a promise give an error that says which, and no file.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::sample;

use cad_exchange::iges::{self, FaceDefect, WriteError, WriteOptions};
use reconstruct::{EdgeId, Model, Surface, VertexId};

fn attempt(change: impl FnOnce(&mut Model)) -> (Result<iges::Summary, WriteError>, usize) {
    let mut model = sample::model();
    change(&mut model);
    let mut out = Vec::new();
    let options = WriteOptions::new("part", "20261121.093000");
    (iges::write(&model, &options, &mut out), out.len())
}

fn refusal(change: impl FnOnce(&mut Model)) -> WriteError {
    let (result, bytes) = attempt(change);
    assert_eq!(bytes, 0, "something was written");
    result.expect_err("the model is defective")
}

fn defect(change: impl FnOnce(&mut Model)) -> FaceDefect {
    match refusal(change) {
        WriteError::Face { face, defect } => {
            assert!(["Barrel", ""].contains(&face.as_str()));
            defect
        }
        other => panic!("{other}"),
    }
}

fn patches(model: &mut Model) -> &mut nurbs::PatchSurface {
    let Surface::Patches(patches) = &mut model.faces[0].surface;
    patches
}

#[test]
fn models_as_a_whole() {
    assert!(matches!(
        refusal(|model| model.faces.clear()),
        WriteError::NoFaces
    ));
    let error = refusal(|model| model.faces[1].name = "Barrel".to_owned());
    assert!(matches!(error, WriteError::DuplicateName { name } if name == "Barrel"));
}

#[test]
fn names_and_links() {
    assert_eq!(
        defect(|model| model.faces[0].name.clear()),
        FaceDefect::NoName
    );
    let empty = defect(|model| model.faces[0].inner[0].coedges.clear());
    assert_eq!(
        empty,
        FaceDefect::EmptyLoop {
            place: "inner loop 1".to_owned()
        }
    );
    let dangling = |change: fn(&mut Model)| match defect(change) {
        FaceDefect::Dangling { place } => place,
        other => panic!("{other}"),
    };
    let place = dangling(|model| model.faces[0].outer.coedges[2].edge = EdgeId(99));
    assert_eq!(
        place, "edge 2 of the outer loop",
        "where the next edge is looked for"
    );
    dangling(|model| model.edges[0].start = VertexId(99));
}

#[test]
fn loops_that_do_not_close() {
    let open = |change: fn(&mut Model)| match defect(change) {
        FaceDefect::OpenLoop { place, gap_mm } => (place, gap_mm),
        other => panic!("{other}"),
    };
    let (place, gap) = open(|model| {
        model.faces[0].outer.coedges.pop();
    });
    assert_eq!(
        (place.as_str(), gap),
        ("edge 3 of the outer loop", f64::INFINITY)
    );
    // The barrel does not change along y, so a side moved that way stays on it.
    let (place, gap) = open(|model| {
        let coedge = &mut model.faces[0].outer.coedges[2];
        coedge.parameter_curve.pieces[0][1][0] -= 0.05;
        for piece in &mut coedge.space_curve.pieces {
            piece[1][0] -= 0.05;
        }
    });
    assert_eq!(place, "the parameter curve of edge 2 of the outer loop");
    assert!((gap - 0.05).abs() < 1e-9);
}

#[test]
fn numbers_that_are_not_finite() {
    let changes: [fn(&mut Model); 4] = [
        |model| patches(model).patches[4][2][1] = f64::NAN,
        |model| patches(model).u_breaks[2] = f64::INFINITY,
        |model| model.faces[0].outer.coedges[0].space_curve.pieces[3][2][0] = f64::NAN,
        |model| model.faces[0].inner[0].coedges[0].parameter_curve.breaks[0] = f64::NEG_INFINITY,
    ];
    for change in changes {
        assert!(matches!(defect(change), FaceDefect::Malformed { .. }));
    }
    let overflow = defect(|model| patches(model).patches[0][3][3] = 1e308);
    assert!(
        matches!(overflow, FaceDefect::Overflow { .. }),
        "{overflow}"
    );
}

#[test]
fn shapes_that_do_not_fit() {
    let missing = defect(|model| {
        patches(model).patches.pop();
    });
    assert!(matches!(missing, FaceDefect::Malformed { .. }));
    match defect(|model| patches(model).patches[1][0][0] += 0.25) {
        FaceDefect::Torn {
            piece: 0,
            neighbour: 1,
            gap_mm,
            ..
        } => {
            assert!((gap_mm - 0.25).abs() < 1e-12);
        }
        other => panic!("{other}"),
    }
    match defect(|model| model.faces[0].outer.coedges[0].space_curve.pieces[5][2][0] += 0.01) {
        FaceDefect::Torn {
            piece: 4,
            neighbour: 5,
            ..
        } => {}
        other => panic!("{other}"),
    }
    let off = defect(|model| {
        for piece in &mut model.faces[0].inner[0].coedges[0].space_curve.pieces {
            piece[2][0] += 0.01;
        }
    });
    assert!(
        matches!(&off, FaceDefect::OffSurface { gap_mm, .. } if (gap_mm - 0.01).abs() < 1e-4),
        "{off}"
    );
    let outside = defect(|model| {
        let patches = patches(model);
        let last = patches.v_breaks.len() - 1;
        patches.v_breaks[last] = 29.0;
    });
    assert!(
        matches!(&outside, FaceDefect::OutsideRectangle { gap_mm, .. } if *gap_mm == 1.0),
        "{outside}"
    );
}

#[test]
fn loops_that_run_the_wrong_way() {
    let error = refusal(|model| {
        let face = &mut model.faces[0];
        let hole = face.inner.pop().unwrap();
        face.inner.push(std::mem::replace(&mut face.outer, hole));
    });
    assert_eq!(
        error.to_string(),
        "face \"Barrel\" cannot be written: the outer loop must run counter-clockwise in the \
         parameter plane, but does not"
    );
    let error = refusal(|model| {
        let outer = model.faces[0].outer.clone();
        model.faces[0].inner.push(outer);
    });
    assert!(
        error
            .to_string()
            .contains("inner loop 2 must run clockwise"),
        "{error}"
    );
}

#[test]
fn small_gaps_are_written_and_stated() {
    let (result, bytes) = attempt(|model| {
        let curve = &mut model.faces[0].outer.coedges[0].space_curve;
        for piece in &mut curve.pieces {
            piece[2][0] += 4e-4;
        }
    });
    let summary = result.unwrap();
    assert!(bytes > 0);
    // Off its surface, and led to the vertex that it leaves by as much.
    assert!((summary.resolution_mm - 8e-4).abs() < 1e-9, "{summary:?}");
    assert_eq!(attempt(|_| ()).0.unwrap().resolution_mm, 1e-4);
}

#[test]
fn a_full_disk_is_reported() {
    let model = sample::model();
    let options = WriteOptions::new("part", "20261121.093000");
    let mut small = [0_u8; 1000];
    let error = iges::write(&model, &options, &mut &mut small[..]).unwrap_err();
    assert!(matches!(error, WriteError::Io(_)), "{error}");
}
