//! Wavefront OBJ.

use std::io::BufRead;

use tobj::{LoadError, LoadOptions, load_obj_buf};

use super::{MOST_TRIANGLES, ReadMeshError, Triangles};
use crate::format::TriangleFormat;

/// Whether a text begins as such files do, behind comments.
pub(super) fn is_obj(head: &[u8]) -> bool {
    if head.contains(&0) {
        return false;
    }
    let text = String::from_utf8_lossy(head);
    let words = text
        .lines()
        .filter_map(|line| line.split_whitespace().next());
    let first = words.into_iter().find(|word| !word.starts_with('#'));
    first.is_some_and(|word| {
        let known = ["v", "vn", "vt", "f", "o", "g", "s", "mtllib", "usemtl"];
        known.contains(&word)
    })
}

pub(super) fn read(source: &mut impl BufRead) -> Result<Triangles, ReadMeshError> {
    let options = LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..LoadOptions::default()
    };
    // Materials are of no concern, and their files need not be there.
    let (models, _) = load_obj_buf(source, &options, |_| Err(LoadError::GenericFailure))
        .map_err(|error| ReadMeshError::damaged("OBJ", &error))?;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for model in models {
        let first = vertices.len() as u32;
        let (places, _) = model.mesh.positions.as_chunks::<3>();
        vertices.extend_from_slice(places);
        let (corners, _) = model.mesh.indices.as_chunks::<3>();
        triangles.extend(corners.iter().map(|own| own.map(|v| v + first)));
        if triangles.len() > MOST_TRIANGLES {
            return Err(ReadMeshError(format!(
                "has more than {MOST_TRIANGLES} triangles, the most that are read: decimate the \
                 mesh first"
            )));
        }
    }
    Ok(Triangles {
        vertices,
        triangles,
        format: TriangleFormat::Obj,
        is_single: false,
    })
}
