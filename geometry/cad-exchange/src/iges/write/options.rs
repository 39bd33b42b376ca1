//! What the caller decides about a file.

use super::WriteError;
use crate::common::DEFAULT_PALETTE;

/// The entities that carry the shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Entities {
    /// Parametric splines, 114 and 112, as Shim & Lee 1995 (section V) write them.
    #[default]
    Parametric114,
    /// B-splines of the same shape, 128 and 126, for readers without the former.
    Rational128,
    /// Planes, cylinders, cones, spheres and tori by their numbers, 190 to 198, other faces as
    /// B-splines, 128.
    Analytic,
    /// The same surfaces as boundary representation: shells (514) of faces (510) on edges and
    /// vertices that are each listed once (504, 502); a solid (186) where a shell is closed.
    Boundary,
}

/// Everything about a file that is not in the model. Characters beyond printable ASCII
/// are replaced by `_` in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct WriteOptions {
    /// Which entities carry the shape.
    pub entities: Entities,
    /// Name of the part.
    pub product: String,
    /// Name of the file, for its global section.
    pub file_name: String,
    /// Name and version of the writing program.
    pub system: String,
    /// Who made the model; may be empty.
    pub author: String,
    /// The author's organisation; may be empty.
    pub organization: String,
    /// When the file is written: `YYYYMMDD.HHMMSS`.
    pub timestamp: String,
    /// When the model was made, in the same form; the file's own timestamp if `None`.
    pub model_timestamp: Option<String>,
    /// Least gap between what should meet, millimetres: readers take it as the tolerance
    /// of every vertex and edge. A larger gap in the model is written instead.
    pub resolution_mm: f64,
    /// A crease is one curve of both its faces as far as the curves that they make of it are as near
    /// to the other face as this, millimetres; the mean of both is written there. Where the faces do
    /// not meet beside it either, three times as far is better than a gap. Where entities
    /// have numbers, a face is written by them if its edges lie as near to that, too; else as a
    /// B-spline.
    pub sharing_mm: f64,
    /// Colours of the faces: region `r` gets `palette[r % palette.len()]`.
    pub palette: Vec<[u8; 3]>,
}

impl WriteOptions {
    /// Defaults for everything but the part's name and the time.
    #[must_use]
    pub fn new(product: impl Into<String>, timestamp: impl Into<String>) -> Self {
        let product = product.into();
        Self {
            entities: Entities::default(),
            file_name: format!("{product}.igs"),
            product,
            system: concat!("Relief ", env!("CARGO_PKG_VERSION")).to_owned(),
            author: String::new(),
            organization: String::new(),
            timestamp: timestamp.into(),
            model_timestamp: None,
            resolution_mm: 1e-4,
            sharing_mm: 0.1,
            palette: DEFAULT_PALETTE.to_vec(),
        }
    }

    pub(super) fn validate(&self) -> Result<(), WriteError> {
        for (option, value) in [
            ("timestamp", Some(&self.timestamp)),
            ("model_timestamp", self.model_timestamp.as_ref()),
        ] {
            if let Some(value) = value.filter(|value| !is_timestamp(value)) {
                return Err(WriteError::Option {
                    option,
                    value: value.clone(),
                    expected: "a time such as 20261121.093000 (YYYYMMDD.HHMMSS)",
                });
            }
        }
        for (option, value) in [("product", &self.product), ("file_name", &self.file_name)] {
            if value.trim().is_empty() {
                return Err(WriteError::Option {
                    option,
                    value: value.clone(),
                    expected: "a name that is not empty",
                });
            }
        }
        if !(1e-9..=1.0).contains(&self.resolution_mm) {
            return Err(WriteError::Option {
                option: "resolution_mm",
                value: self.resolution_mm.to_string(),
                expected: "a gap between 1e-9 and 1 mm",
            });
        }
        if !(0.0..=1.0).contains(&self.sharing_mm) {
            return Err(WriteError::Option {
                option: "sharing_mm",
                value: self.sharing_mm.to_string(),
                expected: "a distance between 0 and 1 mm",
            });
        }
        if self.palette.is_empty() {
            return Err(WriteError::Option {
                option: "palette",
                value: "[]".to_owned(),
                expected: "at least one colour",
            });
        }
        Ok(())
    }

    pub(super) fn colour(&self, region: u16) -> [u8; 3] {
        self.palette
            .get(usize::from(region) % self.palette.len().max(1))
            .copied()
            .unwrap_or_default()
    }
}

/// `YYYYMMDD.HHMMSS` with fields in their ranges.
fn is_timestamp(text: &str) -> bool {
    let bytes = text.as_bytes();
    if bytes.len() != 15 || bytes.get(8) != Some(&b'.') {
        return false;
    }
    let field = |from: usize, to: usize| {
        text.get(from..to)
            .filter(|digits| digits.bytes().all(|b| b.is_ascii_digit()))
            .and_then(|digits| digits.parse::<u32>().ok())
    };
    matches!(field(0, 4), Some(1..))
        && matches!(field(4, 6), Some(1..=12))
        && matches!(field(6, 8), Some(1..=31))
        && matches!(field(9, 11), Some(0..=23))
        && matches!(field(11, 13), Some(0..=59))
        && matches!(field(13, 15), Some(0..=60))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timestamps() {
        for right in ["20261121.093000", "19950101.235960"] {
            assert!(is_timestamp(right), "{right}");
        }
        for wrong in [
            "",
            "261121.093000",
            "20261321.093000",
            "20261100.093000",
            "20261121-093000",
            "20261121.246000",
            "20261121.09300",
            "2026112a.093000",
            "+0261121.093000",
            "2026\u{e9}121.09300",
        ] {
            assert!(!is_timestamp(wrong), "{wrong}");
        }
    }

    #[test]
    fn wrong_options_are_named() {
        let right = WriteOptions::new("part", "20261121.093000");
        assert!(right.validate().is_ok());
        let wrong = [
            WriteOptions {
                timestamp: "now".into(),
                ..right.clone()
            },
            WriteOptions {
                model_timestamp: Some("x".into()),
                ..right.clone()
            },
            WriteOptions {
                product: " ".into(),
                ..right.clone()
            },
            WriteOptions {
                file_name: String::new(),
                ..right.clone()
            },
            WriteOptions {
                resolution_mm: 0.0,
                ..right.clone()
            },
            WriteOptions {
                resolution_mm: f64::NAN,
                ..right.clone()
            },
            WriteOptions {
                palette: Vec::new(),
                ..right
            },
        ];
        let names: Vec<_> = wrong
            .iter()
            .map(|options| match options.validate() {
                Err(WriteError::Option { option, .. }) => option,
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(
            names,
            [
                "timestamp",
                "model_timestamp",
                "product",
                "file_name",
                "resolution_mm",
                "resolution_mm",
                "palette"
            ]
        );
    }
}
