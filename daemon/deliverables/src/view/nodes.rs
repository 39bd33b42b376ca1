//! The nodes of the range image as points.

use mesh_files::{Drawn, ScenePrimitive};
use serde_json::json;

use crate::deviations::Deviations;

/// Most nodes that are shown.
const MOST: usize = 200_000;
/// Place, deviation and region of a node.
const NODE_BYTES: usize = 20;
const GREY: [u8; 3] = [128, 134, 142];

/// Those with a deviation, then those without one: glTF knows no number that is none.
pub(super) fn nodes(
    deviations: &Deviations<'_>,
    labels: &[u16],
    most_bytes: usize,
) -> Vec<ScenePrimitive> {
    let image = deviations.image();
    let most = MOST.min(most_bytes / NODE_BYTES);
    let step = step(deviations, most);
    let empty = || ScenePrimitive {
        drawn: Drawn::Points,
        places_mm: Vec::new(),
        normals: Vec::new(),
        numbers: Vec::new(),
        indices: Vec::new(),
        colour: GREY,
        extras: json!({
            "pitch_mm": image.pitch_mm(),
            "step": step,
            "limit_mm": deviations.limit_mm(),
        }),
    };
    let (mut with, mut without) = (empty(), empty());
    let (mut off_mm, mut regions, mut regions_without) = (Vec::new(), Vec::new(), Vec::new());
    for column in (0..image.columns()).step_by(step) {
        for row in (0..image.rows()).step_by(step) {
            let Some(z_mm) = image.z_mm(column, row) else {
                continue;
            };
            let place = [image.x_mm(column), image.y_mm(row), z_mm].map(|c| c as f32);
            let label = labels.get(column * image.rows() + row).copied();
            let label = f32::from(label.unwrap_or(0));
            if let Some(off) = deviations.at(column, row) {
                with.places_mm.push(place);
                off_mm.push(off as f32);
                regions.push(label);
            } else {
                without.places_mm.push(place);
                regions_without.push(label);
            }
        }
    }
    with.numbers = vec![("_DEVIATION", off_mm), ("_REGION", regions)];
    without.numbers = vec![("_REGION", regions_without)];
    vec![with, without]
}

/// The least step that leaves no more nodes than these.
fn step(deviations: &Deviations<'_>, most: usize) -> usize {
    let image = deviations.image();
    let most_steps = image.columns().max(image.rows()).max(1);
    let left = |step: usize| {
        let columns = (0..image.columns()).step_by(step);
        let rows = || (0..image.rows()).step_by(step);
        let valid = |column| rows().filter(move |&row| image.z_mm(column, row).is_some());
        columns.map(|column| valid(column).count()).sum::<usize>()
    };
    (1..most_steps)
        .find(|&step| left(step) <= most)
        .unwrap_or(most_steps)
}
