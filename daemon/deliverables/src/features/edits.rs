//! What users change of features, as files and settings have it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use features::edit::Edit;
use serde::{Deserialize, Serialize};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    edit: Vec<EditEntry>,
}

/// One change of one feature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EditEntry {
    id: u32,
    #[serde(rename = "type", skip_serializing_if = "Option::is_none")]
    class: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    direction: Option<[f64; 3]>,
    /// All other keys are dimensions.
    #[serde(flatten)]
    dimensions_mm: BTreeMap<String, f64>,
}

impl EditEntry {
    /// The change.
    #[must_use]
    pub fn edit(&self) -> Edit {
        Edit {
            id: self.id,
            class: self.class.clone(),
            dimensions_mm: self.dimensions_mm.clone(),
            direction: self.direction,
        }
    }
}

/// A file of changes that is none.
#[derive(Debug, thiserror::Error)]
pub enum EditsError {
    /// It cannot be read.
    #[error("cannot read {path}: {error}", path = .0.display(), error = .1)]
    Read(PathBuf, std::io::Error),
    /// It is no file of changes.
    #[error("{path}: {error}", path = .0.display(), error = .1)]
    Parse(PathBuf, Box<toml::de::Error>),
    /// There is no change in it.
    #[error(
        "{path}: there is no [[edit]] in it; give one for each feature to be changed, such as \
         [[edit]] with id = 1 and depth = 5.0",
        path = .0.display()
    )]
    Empty(PathBuf),
}

/// Reads a file of changes: tables `[[edit]]` with `id`, and any of `type`, `direction` and
/// dimensions.
///
/// # Errors
/// [`EditsError`].
pub fn read_edits(path: &Path) -> Result<Vec<EditEntry>, EditsError> {
    let text =
        std::fs::read_to_string(path).map_err(|error| EditsError::Read(path.to_owned(), error))?;
    let file: File = toml::from_str(&text)
        .map_err(|error| EditsError::Parse(path.to_owned(), Box::new(error)))?;
    if file.edit.is_empty() {
        return Err(EditsError::Empty(path.to_owned()));
    }
    Ok(file.edit)
}
