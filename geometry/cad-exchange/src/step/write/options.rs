//! What the caller decides about a file.

use super::WriteError;
use crate::common::DEFAULT_PALETTE;

/// The application protocol that a file follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Schema {
    /// ISO 10303-242, managed model based 3D engineering.
    #[default]
    Ap242,
    /// ISO 10303-214, core data for automotive mechanical design processes, for readers
    /// that do not know the former.
    Ap214,
}

impl Schema {
    /// Name and object identifier, as they stand in `FILE_SCHEMA`.
    pub(super) fn identifier(self) -> &'static str {
        match self {
            Self::Ap242 => {
                "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 1 1 4 }"
            }
            Self::Ap214 => "AUTOMOTIVE_DESIGN { 1 0 10303 214 3 1 1 }",
        }
    }
}

/// The unit in which lengths are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LengthUnit {
    /// Millimetre.
    #[default]
    Millimetre,
    /// Inch of 25.4 mm.
    Inch,
}

impl LengthUnit {
    /// Its length in millimetres.
    #[must_use]
    pub fn mm(self) -> f64 {
        match self {
            Self::Millimetre => 1.0,
            Self::Inch => 25.4,
        }
    }
}

/// Everything about a file that is not in the model. Texts may hold any characters.
#[derive(Debug, Clone, PartialEq)]
pub struct WriteOptions {
    /// Which application protocol the file follows.
    pub schema: Schema,
    /// The unit of lengths. The part's size is the same in either.
    pub unit: LengthUnit,
    /// Name of the part.
    pub product: String,
    /// Name of the file, for its header.
    pub file_name: String,
    /// Name and version of the writing program.
    pub system: String,
    /// Who made the model; may be empty.
    pub author: String,
    /// The author's organisation; may be empty.
    pub organization: String,
    /// When the file is written: `YYYY-MM-DDTHH:MM:SS`, with `Z`, `+HH:MM` or `-HH:MM`
    /// after it if the zone is known.
    pub timestamp: String,
    /// Least gap between what should meet, millimetres: readers take it as the tolerance
    /// of every vertex and edge. A larger gap in the file is written instead.
    pub resolution_mm: f64,
    /// A crease is one edge of two faces as far as the curves that they make of it are as
    /// near to the other face as this, millimetres; the mean of both is written there. Where the
    /// faces do not meet beside it either, three times as far is better than a gap. Where
    /// they part farther, each face has an edge of its own. A face is written as the cylinder, cone,
    /// sphere or torus that it is if its edges lie as near to that, too; else as a spline.
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
            schema: Schema::default(),
            unit: LengthUnit::default(),
            file_name: format!("{product}.step"),
            product,
            system: concat!("Relief ", env!("CARGO_PKG_VERSION")).to_owned(),
            author: String::new(),
            organization: String::new(),
            timestamp: timestamp.into(),
            resolution_mm: 1e-4,
            sharing_mm: 0.1,
            palette: DEFAULT_PALETTE.to_vec(),
        }
    }

    pub(super) fn validate(&self) -> Result<(), WriteError> {
        let wrong = |option, value: &dyn std::fmt::Display, expected| WriteError::Option {
            option,
            value: value.to_string(),
            expected,
        };
        if !is_timestamp(&self.timestamp) {
            let expected = "a time such as 2026-11-21T09:30:00 or 2026-11-21T09:30:00+00:00";
            return Err(wrong("timestamp", &self.timestamp, expected));
        }
        for (option, value) in [("product", &self.product), ("file_name", &self.file_name)] {
            if value.trim().is_empty() {
                return Err(wrong(option, value, "a name that is not empty"));
            }
        }
        if !(1e-9..=1.0).contains(&self.resolution_mm) {
            let expected = "a gap between 1e-9 and 1 mm";
            return Err(wrong("resolution_mm", &self.resolution_mm, expected));
        }
        if !(0.0..=1.0).contains(&self.sharing_mm) {
            let expected = "a gap between 0 and 1 mm";
            return Err(wrong("sharing_mm", &self.sharing_mm, expected));
        }
        if self.palette.is_empty() {
            return Err(wrong("palette", &"[]", "at least one colour"));
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

/// ISO 8601, extended format, to the second, with or without a zone.
fn is_timestamp(text: &str) -> bool {
    let Some((time, zone)) = text.split_at_checked(19) else {
        return false;
    };
    fits(time, "....-..-..T..:..:..")
        && in_range(time, 0, 4, 1..=9999)
        && in_range(time, 5, 7, 1..=12)
        && in_range(time, 8, 10, 1..=31)
        && in_range(time, 11, 13, 0..=23)
        && in_range(time, 14, 16, 0..=59)
        && in_range(time, 17, 19, 0..=60)
        && (zone.is_empty()
            || zone == "Z"
            || ((fits(zone, "+..:..") || fits(zone, "-..:.."))
                && in_range(zone, 1, 3, 0..=23)
                && in_range(zone, 4, 6, 0..=59)))
}

/// Digits where the form has points, else the same characters.
fn fits(text: &str, form: &str) -> bool {
    text.len() == form.len()
        && text.bytes().zip(form.bytes()).all(|(c, f)| {
            if f == b'.' {
                c.is_ascii_digit()
            } else {
                c == f
            }
        })
}

fn in_range(text: &str, from: usize, to: usize, range: std::ops::RangeInclusive<u32>) -> bool {
    let number = text.get(from..to).and_then(|digits| digits.parse().ok());
    number.is_some_and(|number| range.contains(&number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timestamps() {
        for right in [
            "2026-11-21T09:30:00",
            "1995-01-01T23:59:60Z",
            "2026-11-21T09:30:00-05:30",
        ] {
            assert!(is_timestamp(right), "{right}");
        }
        for wrong in [
            "",
            "2026-11-21",
            "2026-13-21T09:30:00",
            "2026-11-00T09:30:00",
            "2026-11-21 09:30:00",
            "2026-11-21T24:30:00",
            "2026-11-21T09:30:0",
            "2026-11-21T09:30:00z",
            "2026-11-21T09:30:00+5:30",
            "2026-11-21T09:30:00+05:60",
            "+026-11-21T09:30:00",
            "2026-11-21T09:30:0\u{e9}",
        ] {
            assert!(!is_timestamp(wrong), "{wrong}");
        }
    }

    #[test]
    fn wrong_options_are_named() {
        let right = WriteOptions::new("part", "2026-11-21T09:30:00");
        assert!(right.validate().is_ok());
        let change = |change: fn(&mut WriteOptions)| {
            let mut options = right.clone();
            change(&mut options);
            match options.validate() {
                Err(WriteError::Option { option, .. }) => option,
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(change(|o| o.timestamp = "now".into()), "timestamp");
        assert_eq!(change(|o| o.product = " ".into()), "product");
        assert_eq!(change(|o| o.file_name = String::new()), "file_name");
        assert_eq!(change(|o| o.resolution_mm = 0.0), "resolution_mm");
        assert_eq!(change(|o| o.resolution_mm = f64::NAN), "resolution_mm");
        assert_eq!(change(|o| o.sharing_mm = -1.0), "sharing_mm");
        assert_eq!(change(|o| o.sharing_mm = f64::NAN), "sharing_mm");
        assert_eq!(change(|o| o.palette.clear()), "palette");
    }
}
