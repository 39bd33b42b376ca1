//! Binary STL.

use std::io::Write;

use stl_io::{Normal, Triangle, Vertex};
use tessellate::{Mesh, MeshFace};

use crate::error::MeshFileError;

pub(crate) fn write(mesh: &Mesh, mut sink: &mut dyn Write) -> Result<(), MeshFileError> {
    let faces = mesh.faces.iter().flat_map(MeshFace::triangles);
    let triangles: Vec<Triangle> = faces
        .map(|triangle| {
            let corners = mesh.corners_mm(triangle);
            Triangle {
                normal: Normal::new(normal(corners).map(|c| c as f32)),
                vertices: corners.map(|corner| Vertex::new(corner.map(|c| c as f32))),
            }
        })
        .collect();
    stl_io::write_stl(&mut sink, triangles.iter())?;
    Ok(())
}

/// The unit normal of a triangle; zeros, which readers take for none, where it has no area.
pub(crate) fn normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let [u, v]: [[f64; 3]; 2] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    let normal = [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ];
    let length = normal.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length > 0.0 {
        normal.map(|c| c / length)
    } else {
        [0.0; 3]
    }
}
