//! What is really there, in the form that the judges read.

use anyhow::Result;
use serde::Serialize;
use sim_scanner::source::Source;
use sim_scanner::truth::{self, TruthError};

/// The visible faces of an object.
#[derive(Debug, Serialize)]
pub(crate) struct Truth {
    /// Pitch of the grid that the result was made on: the judges measure in it.
    pitch_mm: f64,
    faces: Vec<Face>,
}

#[derive(Debug, Serialize)]
struct Face {
    name: String,
    /// Area of the visible part.
    area_mm2: f64,
    /// Points where two edges of the outline meet at an angle.
    corners: usize,
    /// The border of the visible part, a closed polyline without its first point again.
    outline_mm: Vec<[f64; 3]>,
}

/// The faces, if they are known: not those of a recording, a mesh or a figure.
pub(crate) fn of(source: &Source, pitch_mm: f64) -> Result<Option<Truth>> {
    let Source::Simulated { scanner, .. } = source else {
        return Ok(None);
    };
    let faces = match truth::faces(scanner) {
        Ok(faces) => faces,
        Err(TruthError::NotConvex) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let faces = faces
        .into_iter()
        .map(|face| Face {
            name: format!("face {}", face.id.face + 1),
            area_mm2: face.area_mm2,
            corners: face.corners_mm.len(),
            outline_mm: face
                .outline_mm
                .iter()
                .map(|point| point.to_array())
                .collect(),
        })
        .collect();
    Ok(Some(Truth { pitch_mm, faces }))
}
