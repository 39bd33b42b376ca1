//! Files of triangles (STL, PLY, 3MF, glTF) and of points (PLY, E57), written through libraries;
//! files of bare triangles (STL, PLY, OBJ), read and written.
//!
//! Triangles come from [`tessellate`], with their faces: PLY, 3MF and glTF carry these by name and
//! colour. Lengths are millimetres, but metres where a standard asks for them (glTF, E57). The part
//! frame has y up and z towards the camera, as glTF has. A [`Scene`] is glTF to be shown: faces, lines
//! and points with what a viewer needs to know of them.
//!
//! The bytes follow from the arguments alone.

mod error;
mod format;
mod glb;
mod ply;
mod points;
mod read;
mod scan;
mod scene;
mod stl;
mod threemf;
mod triangles;

use std::io::Write;

use tessellate::Mesh;

pub use error::MeshFileError;
pub use format::{MeshFormat, PointFormat, TriangleFormat};
pub use points::{Point, Points};
pub use read::{MOST_TRIANGLES, ReadMeshError, Triangles, read_stl, read_triangles};
pub use scan::ScanDetails;
pub use scene::{Drawn, Scene, SceneGroup, ScenePrimitive};
pub use triangles::write_triangles;

/// What stands in a file beside its triangles.
#[derive(Debug, Clone, Copy)]
pub struct MeshDetails<'a> {
    /// Name of the part.
    pub name: &'a str,
    /// Name and version of the program that made it.
    pub generator: &'a str,
    /// Colours of the faces, red, green and blue: region `r` gets `palette[r % palette.len()]`.
    pub palette: &'a [[u8; 3]],
}

impl MeshDetails<'_> {
    fn colour(&self, region: u16) -> [u8; 3] {
        let index = usize::from(region) % self.palette.len().max(1);
        self.palette.get(index).copied().unwrap_or([186, 176, 172])
    }
}

/// Writes triangles in a format.
///
/// # Errors
/// [`MeshFileError`] where the mesh is too large for the format, or `sink` fails.
pub fn write_mesh(
    mesh: &Mesh,
    format: MeshFormat,
    details: &MeshDetails<'_>,
    sink: &mut dyn Write,
) -> Result<(), MeshFileError> {
    match format {
        MeshFormat::Stl => stl::write(mesh, sink),
        MeshFormat::Ply => ply::write_mesh(mesh, details, sink),
        MeshFormat::ThreeMf => threemf::write(mesh, details, sink),
        MeshFormat::Glb => glb::write(mesh, details, sink),
    }
}

/// Writes points in a format. PLY goes through them twice and keeps none; E57 goes through them
/// twice and keeps the file in memory, 25 bytes a point.
///
/// # Errors
/// [`MeshFileError`] where the points cannot be read, or `sink` fails.
pub fn write_points(
    points: &dyn Points,
    format: PointFormat,
    details: &ScanDetails<'_>,
    sink: &mut dyn Write,
) -> Result<(), MeshFileError> {
    let census = points::Census::of(points)?;
    match format {
        PointFormat::Ply => ply::write_points(points, census, details, sink),
        PointFormat::E57 => scan::write(points, census, details, sink),
    }
}
