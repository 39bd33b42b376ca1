//! `view.glb`: model and range image to be looked at in three dimensions, small whatever the scan's
//! size.
//!
//! Faces are as coarse as their budget asks for, and of the nodes every `step`-th of every `step`-th
//! column is there.

mod edges;
mod faces;
mod nodes;

use std::io::Write;

use mesh_files::{Scene, SceneGroup, ScenePrimitive};
use range_image::{Cancelled, Monitor, RangeImage};
use serde_json::json;

use crate::deviations::Deviations;
use crate::export::{WriteError, file_stem};
use crate::meshes::GENERATOR;
use crate::write::Inputs;

/// Name of the view in a directory of deliverables.
pub const VIEW_NAME: &str = "view.glb";

/// Bytes that the view is not to exceed, but for what describes its parts.
const MOST_BYTES: usize = 3_900_000;
/// Of these, what faces may take.
const FACES_BYTES: usize = 2_000_000;
/// Of these, what edges may take.
const EDGES_BYTES: usize = 500_000;
/// Parts of the diagonal of all nodes that a triangle may lie off its face.
const DIAGONAL_PARTS: f64 = 2000.0;

/// Makes the view and writes it. The bytes follow from the inputs.
///
/// # Errors
/// [`ViewError`].
pub fn write_view(
    inputs: &Inputs<'_>,
    monitor: &dyn Monitor,
    sink: &mut dyn Write,
) -> Result<(), ViewError> {
    Ok(scene(inputs, monitor)?
        .write(sink)
        .map_err(WriteError::from)?)
}

/// A view could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The caller asked for an end.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The format or the sink refused.
    #[error(transparent)]
    Write(#[from] WriteError),
}

fn scene(inputs: &Inputs<'_>, monitor: &dyn Monitor) -> Result<Scene, Cancelled> {
    let model = &inputs.outcome.reconstruction.model;
    let deviations = Deviations::of(inputs.image, inputs.outcome);
    let least_mm = inputs.cad.meshes.tolerance_mm;
    let tolerance_mm = least_mm.max(diagonal_mm(deviations.image()) / DIAGONAL_PARTS);
    let faces = faces::faces(model, tolerance_mm, monitor)?;
    let edges = edges::edges(model, tolerance_mm);
    let spent: usize = faces.primitives.iter().chain(&edges).map(bytes).sum();
    let labels = inputs.outcome.regions.raw_labels();
    let nodes = nodes::nodes(&deviations, labels, MOST_BYTES.saturating_sub(spent));
    let mut extras = json!({
        "units": "mm",
        "frame": "part: x along the slide table, y up, z towards the camera",
        "scale": "places are in mm; the root node scales them to metres",
        "faces": faces.primitives.len(),
    });
    if let Some(object) = extras.as_object_mut() {
        match (faces.tolerance_mm, faces.refused) {
            (Some(mm), _) => object.insert("tolerance_mm".into(), mm.into()),
            (None, Some(why)) => object.insert("faces_left_out".into(), why.into()),
            (None, None) => None,
        };
    }
    let group = |name, primitives| SceneGroup { name, primitives };
    Ok(Scene {
        name: file_stem(inputs.name),
        generator: GENERATOR.to_owned(),
        extras,
        groups: vec![
            group("faces", faces.primitives),
            group("edges", edges),
            group("nodes", nodes),
        ],
    })
}

/// What a primitive takes of the file, but for its description.
fn bytes(primitive: &ScenePrimitive) -> usize {
    let numbers: usize = primitive
        .numbers
        .iter()
        .map(|(_, values)| values.len())
        .sum();
    let vectors = primitive.places_mm.len() + primitive.normals.len();
    4 * (3 * vectors + numbers + primitive.indices.len())
}

/// Of the box around all nodes; 0 where there are none.
fn diagonal_mm(image: &RangeImage) -> f64 {
    let Some((low, high)) = image.z_extent_mm() else {
        return 0.0;
    };
    let across = |nodes: usize| nodes.saturating_sub(1) as f64 * image.pitch_mm();
    let sides = [across(image.columns()), across(image.rows()), high - low];
    sides.iter().map(|side| side * side).sum::<f64>().sqrt()
}
