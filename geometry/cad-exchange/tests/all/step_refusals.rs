//! Models and options that cannot stand in a STEP file give an error that says why, and
//! no file.

#![allow(clippy::unwrap_used, clippy::panic)]

use crate::sample;

use cad_exchange::step::{self, FaceDefect, Summary, WriteError, WriteOptions};
use reconstruct::{EdgeId, Model, Surface};

fn options() -> WriteOptions {
    WriteOptions::new("part", "2026-11-21T09:30:00")
}

fn attempt(change: impl FnOnce(&mut Model)) -> Result<Summary, WriteError> {
    let mut model = sample::model();
    change(&mut model);
    let mut out = Vec::new();
    let result = step::write(&model, &options(), &mut out);
    assert_eq!(result.is_ok(), !out.is_empty());
    result
}

fn defect(change: impl FnOnce(&mut Model)) -> FaceDefect {
    match attempt(change) {
        Err(WriteError::Face { defect, .. }) => defect,
        other => panic!("{other:?}"),
    }
}

#[test]
fn models_that_break_a_promise() {
    assert!(matches!(
        attempt(|model| model.faces.clear()),
        Err(WriteError::NoFaces)
    ));
    let error = attempt(|model| model.faces[1].name = "Barrel".to_owned()).unwrap_err();
    assert!(matches!(error, WriteError::DuplicateName { name } if name == "Barrel"));
    let nameless = defect(|model| model.faces[0].name.clear());
    assert_eq!(nameless, FaceDefect::NoName);
    let dangling = defect(|model| model.faces[0].outer.coedges[2].edge = EdgeId(99));
    assert!(
        matches!(dangling, FaceDefect::Dangling { .. }),
        "{dangling}"
    );
    let open = defect(|model| {
        model.faces[0].outer.coedges.pop();
    });
    assert!(matches!(open, FaceDefect::OpenLoop { .. }), "{open}");
    let nan = defect(|model| {
        let Surface::Patches(patches) = &mut model.faces[0].surface;
        patches.patches[4][2][1] = f64::NAN;
    });
    assert!(matches!(nan, FaceDefect::Malformed { .. }), "{nan}");
}

#[test]
fn small_gaps_are_written_and_stated() {
    let summary = attempt(|model| {
        let curve = &mut model.faces[0].outer.coedges[0].space_curve;
        for piece in &mut curve.pieces {
            piece[2][0] += 4e-4;
        }
    })
    .unwrap();
    assert!(
        summary.uncertainty_mm > 4e-4 && summary.uncertainty_mm < 1e-3,
        "{summary:?}"
    );
    assert_eq!(attempt(|_| ()).unwrap().uncertainty_mm, 1e-4);
}

#[test]
fn options_and_destinations() {
    let model = sample::model();
    let wrong = WriteOptions {
        timestamp: "20261121.093000".to_owned(),
        ..options()
    };
    let error = step::write(&model, &wrong, &mut Vec::new())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("timestamp") && error.contains("2026-11-21T09:30:00"),
        "{error}"
    );
    let mut small = [0_u8; 1000];
    let error = step::write(&model, &options(), &mut &mut small[..]).unwrap_err();
    assert!(matches!(error, WriteError::Io(_)), "{error}");
}
