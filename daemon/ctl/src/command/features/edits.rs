//! The user's changes, as a file.

use std::collections::BTreeMap;
use std::path::Path;

use features::edit::Edit;
use serde::Deserialize;

use crate::failure::Failure;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    edit: Vec<Entry>,
}

#[derive(Deserialize)]
struct Entry {
    id: u32,
    #[serde(rename = "type")]
    class: Option<String>,
    direction: Option<[f64; 3]>,
    /// All other keys are dimensions.
    #[serde(flatten)]
    dimensions_mm: BTreeMap<String, f64>,
}

/// Reads a file of changes.
pub(super) fn read(path: &Path) -> Result<Vec<Edit>, Failure> {
    let name = path.display();
    let text = std::fs::read_to_string(path)
        .map_err(|error| Failure::at(format!("cannot read {name}"), &error))?;
    let file: File =
        toml::from_str(&text).map_err(|error| Failure::at(format!("{name}"), &error))?;
    if file.edit.is_empty() {
        return Err(Failure::Failed(format!(
            "{name}: there is no [[edit]] in it; give one for each feature to be changed, such as \
             [[edit]] with id = 1 and depth = 5.0"
        )));
    }
    let edits = file.edit.into_iter().map(|entry| Edit {
        id: entry.id,
        class: entry.class,
        dimensions_mm: entry.dimensions_mm,
        direction: entry.direction,
    });
    Ok(edits.collect())
}
