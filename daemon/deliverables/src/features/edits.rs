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
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(try_from = "BTreeMap<String, Value>", into = "BTreeMap<String, Value>")]
pub struct EditEntry {
    id: u32,
    class: Option<String>,
    direction: Option<[f64; 3]>,
    dimensions_mm: BTreeMap<String, f64>,
}

/// What keys of a change have.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(untagged)]
enum Value {
    Whole(i64),
    Number(f64),
    Text(String),
    Numbers(Vec<f64>),
    #[serde(skip_serializing)]
    Other(serde::de::IgnoredAny),
}

impl TryFrom<BTreeMap<String, Value>> for EditEntry {
    type Error = String;

    fn try_from(table: BTreeMap<String, Value>) -> Result<Self, String> {
        let mut own = Self {
            id: 0,
            class: None,
            direction: None,
            dimensions_mm: BTreeMap::new(),
        };
        let id = table.get("id").ok_or("an edit needs the id of a feature")?;
        let number = |value: &Value| match value {
            Value::Whole(own) => u32::try_from(*own).ok(),
            _ => None,
        };
        own.id = number(id).ok_or("id must be the number of a feature, from 0 on")?;
        for (key, value) in table {
            match (key.as_str(), value) {
                ("id", _) => {}
                ("type", Value::Text(class)) => own.class = Some(class),
                ("type", _) => return Err("type must be the name of a class, in quotes".into()),
                ("direction", Value::Numbers(along)) => {
                    let along: Result<[f64; 3], _> = along.try_into();
                    own.direction = Some(along.map_err(|_| DIRECTION)?);
                }
                ("direction", _) => return Err(DIRECTION.into()),
                (_, Value::Number(value_mm)) => {
                    own.dimensions_mm.insert(key, value_mm);
                }
                (_, Value::Whole(value_mm)) => {
                    own.dimensions_mm.insert(key, value_mm as f64);
                }
                _ => {
                    return Err(format!(
                        "{key} must be a number of millimetres if it is a dimension; other keys \
                         are id, type and direction"
                    ));
                }
            }
        }
        Ok(own)
    }
}

const DIRECTION: &str = "direction must be a vector of three numbers, such as [0.0, 1.0, 0.0]";

impl From<EditEntry> for BTreeMap<String, Value> {
    fn from(own: EditEntry) -> Self {
        let sizes = own.dimensions_mm.into_iter();
        let mut table: Self = sizes.map(|(key, mm)| (key, Value::Number(mm))).collect();
        table.insert("id".to_owned(), Value::Whole(own.id.into()));
        let class = own.class.map(Value::Text);
        table.extend(class.map(|value| ("type".to_owned(), value)));
        let direction = own.direction.map(|along| Value::Numbers(along.to_vec()));
        table.extend(direction.map(|value| ("direction".to_owned(), value)));
        table
    }
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
    #[error("{path}: line {line}: {message}", path = path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Where, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
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
    let file: File = toml::from_str(&text).map_err(|error| {
        let before = error.span().map_or(0, |span| span.start).min(text.len());
        let ends = text.as_bytes()[..before]
            .iter()
            .filter(|byte| **byte == b'\n');
        EditsError::Parse {
            path: path.to_owned(),
            line: 1 + ends.count(),
            message: error.message().trim().to_owned(),
        }
    })?;
    if file.edit.is_empty() {
        return Err(EditsError::Empty(path.to_owned()));
    }
    Ok(file.edit)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<EditEntry>, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("edits.toml");
        std::fs::write(&path, text).unwrap();
        let shown = path.display().to_string();
        read_edits(&path).map_err(|error| error.to_string().replace(&shown, "edits.toml"))
    }

    #[test]
    fn changes_are_read_and_told_again() {
        let text = "[[edit]]\nid = 3\ndiameter = 8\ndepth = 2.5\n\n[[edit]]\nid = 4\ntype = \"slot\"\n\
                    direction = [0, 1.0, 0]\n";
        let edits = read(text).unwrap();
        assert_eq!(edits[0].dimensions_mm.get("diameter"), Some(&8.0));
        assert_eq!(edits[1].edit().direction, Some([0.0, 1.0, 0.0]));
        let json = serde_json::to_string(&edits).unwrap();
        assert_eq!(
            json,
            r#"[{"depth":2.5,"diameter":8.0,"id":3},{"direction":[0.0,1.0,0.0],"id":4,"type":"slot"}]"#
        );
        assert_eq!(
            serde_json::from_str::<Vec<EditEntry>>(&json).unwrap(),
            edits
        );
    }

    #[test]
    fn what_is_no_change_is_told_with_its_key_and_line() {
        let of = |text: &str| read(text).unwrap_err();
        for (text, told) in [
            ("[[edit]]\ndepth = 1.0\n", "needs the id"),
            ("[[edit]]\nid = -1\n", "id must be the number"),
            ("[[edit]]\nid = 1.5\n", "id must be the number"),
            (
                "[[edit]]\nid = 1\ncolour = \"red\"\n",
                "colour must be a number",
            ),
            ("[[edit]]\nid = 1\ndepth = true\n", "depth must be a number"),
            ("[[edit]]\nid = 1\ntype = 4\n", "type must be the name"),
            (
                "[[edit]]\nid = 1\ndirection = [1, 2]\n",
                "direction must be a vector",
            ),
            (
                "[[edit]]\nid = 1\ndirection = \"x\"\n",
                "direction must be a vector",
            ),
        ] {
            let error = of(text);
            assert!(
                error.starts_with("edits.toml: line 1: ") && error.contains(told),
                "{error}"
            );
            assert_eq!(error.lines().count(), 1, "{error}");
        }
        assert!(of("\n\n[[edit]\n").starts_with("edits.toml: line 3: "));
        assert!(of("[[change]]\nid = 1\n").contains("unknown field"));
        assert!(of("").contains("no [[edit]]"));
    }
}
