//! The trimmed faces as triangles.

use cad_exchange::step::DEFAULT_PALETTE;
use mesh_files::{Drawn, ScenePrimitive};
use range_image::{Cancelled, Monitor};
use reconstruct::Model;
use serde_json::json;
use tessellate::{Mesh, TessellateError, TessellateSettings, tessellate};

use super::{FACES_BYTES, bytes};

/// Most that a surface turns within a triangle: normals are those of the surface, so that shading
/// hides more.
const ANGLE_RAD: f64 = 0.35;
/// Times that triangles are made coarser to keep their budget, twice as coarse each time.
const COARSER: usize = 6;

/// Faces to be shown.
pub(super) struct Faces {
    pub(super) primitives: Vec<ScenePrimitive>,
    /// How far triangles may lie off; `None` where there are none.
    pub(super) tolerance_mm: Option<f64>,
    /// Why there are none, where there are faces.
    pub(super) refused: Option<String>,
}

/// One primitive for each face, in the order of the model. What no triangles can be made of is in
/// the CAD files all the same, so that this is no reason for there to be no view.
pub(super) fn faces(
    model: &Model,
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Faces, Cancelled> {
    let [least, most] = TessellateSettings::TOLERANCES_MM;
    let mut settings = TessellateSettings {
        tolerance_mm: tolerance_mm.clamp(least, most),
        angle_rad: ANGLE_RAD,
        ..TessellateSettings::default()
    };
    let mut refused = None;
    for _ in 0..=COARSER {
        match tessellate(model, &settings, &Quiet(monitor)) {
            Ok(mesh) => {
                let primitives: Vec<ScenePrimitive> = primitives(model, &mesh);
                if primitives.iter().map(bytes).sum::<usize>() <= FACES_BYTES {
                    return Ok(Faces {
                        primitives,
                        tolerance_mm: Some(settings.tolerance_mm),
                        refused: None,
                    });
                }
                refused = Some("their triangles are too many, however coarse".to_owned());
            }
            Err(TessellateError::Cancelled(cancelled)) => return Err(cancelled),
            Err(TessellateError::NoFaces) => {
                refused = None;
                break;
            }
            // A coarser division may come through where a finer one does not.
            Err(error) => refused = Some(error.to_string()),
        }
        settings.tolerance_mm = (2.0 * settings.tolerance_mm).min(most);
        settings.angle_rad = (1.3 * settings.angle_rad).min(1.5);
    }
    Ok(Faces {
        primitives: Vec::new(),
        tolerance_mm: None,
        refused,
    })
}

/// Passes cancellation on: progress is that of the files that are asked for.
struct Quiet<'a>(&'a dyn Monitor);

impl Monitor for Quiet<'_> {
    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }

    fn progress(&self, _: f64) {}
}

fn primitives(model: &Model, mesh: &Mesh) -> Vec<ScenePrimitive> {
    let single = |vector: [f64; 3]| vector.map(|c| c as f32);
    let faces = mesh.faces.iter().zip(&model.faces).enumerate();
    faces
        .map(|(index, (face, of))| {
            let corners = face.corners.iter();
            let place = |vertex: u32| mesh.vertices_mm.get(vertex as usize).copied();
            let colour = usize::from(face.region) % DEFAULT_PALETTE.len();
            ScenePrimitive {
                drawn: Drawn::Triangles,
                places_mm: corners
                    .clone()
                    .map(|corner| single(place(corner.vertex).unwrap_or_default()))
                    .collect(),
                normals: corners.map(|corner| single(corner.normal)).collect(),
                numbers: Vec::new(),
                indices: face.triangles.iter().flatten().copied().collect(),
                colour: DEFAULT_PALETTE.get(colour).copied().unwrap_or_default(),
                extras: json!({
                    "face": index,
                    "name": face.name,
                    "region": face.region,
                    "kind": crate::summary::kind(of),
                }),
            }
        })
        .collect()
}
