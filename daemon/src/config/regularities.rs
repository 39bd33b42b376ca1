//! Whether regularities are looked for, as it is written in the configuration.

use core::fmt;

use pipeline::RegularizeSettings;
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Whether shapes are given the regularities that they are likely to have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Regularize {
    /// No.
    Off,
    /// Within so many standard uncertainties.
    Bound(f64),
}

/// The unit that numbers are round in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RegularizeUnits {
    /// Millimetres and their parts.
    Mm,
    /// Inches and their fractions.
    Inch,
}

impl From<RegularizeUnits> for pipeline::Round {
    fn from(units: RegularizeUnits) -> Self {
        match units {
            RegularizeUnits::Mm => Self::Millimetre,
            RegularizeUnits::Inch => Self::Inch,
        }
    }
}

impl Regularize {
    /// The choice, and the unit, as the pipeline has them.
    #[must_use]
    pub fn settings(self, units: Option<RegularizeUnits>) -> pipeline::Regularize {
        match self {
            Self::Off => pipeline::Regularize::Off,
            Self::Bound(bound) => pipeline::Regularize::On(RegularizeSettings {
                bound,
                round: units.map(Into::into).unwrap_or_default(),
                ..RegularizeSettings::default()
            }),
        }
    }
}

impl Serialize for Regularize {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Off => serializer.serialize_str("off"),
            Self::Bound(bound) => serializer.serialize_f64(*bound),
        }
    }
}

impl<'de> Deserialize<'de> for Regularize {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Written)
    }
}

/// Reads what is written.
struct Written;

impl Visitor<'_> for Written {
    type Value = Regularize;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (low, high) = RegularizeSettings::BOUNDS;
        write!(
            f,
            "a bound of {low} to {high} standard uncertainties, or \"off\""
        )
    }

    fn visit_f64<E: Error>(self, bound: f64) -> Result<Regularize, E> {
        let (low, high) = RegularizeSettings::BOUNDS;
        if (low..=high).contains(&bound) {
            return Ok(Regularize::Bound(bound));
        }
        Err(E::custom(format!(
            "{bound} is out of range: {low} to {high} standard uncertainties are possible, or \"off\""
        )))
    }

    fn visit_i64<E: Error>(self, bound: i64) -> Result<Regularize, E> {
        self.visit_f64(bound as f64)
    }

    fn visit_u64<E: Error>(self, bound: u64) -> Result<Regularize, E> {
        self.visit_f64(bound as f64)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Regularize, E> {
        if text == "off" {
            return Ok(Regularize::Off);
        }
        Err(E::custom(format!(
            "{text:?} is neither a number nor \"off\": write the bound, such as 3.0"
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_or_off_is_read_as_it_is_written() {
        let read = |text: &str| serde_json::from_str::<Regularize>(text);
        for (text, value) in [
            ("3", Regularize::Bound(3.0)),
            ("2.5", Regularize::Bound(2.5)),
            ("\"off\"", Regularize::Off),
        ] {
            let found = read(text).unwrap();
            assert_eq!(found, value);
            let written = serde_json::to_string(&found).unwrap();
            assert_eq!(read(&written).unwrap(), value, "{written}");
        }
        for (text, expected) in [
            ("0.5", "0.5 is out of range: 1 to 6"),
            ("-3", "-3 is out of range"),
            ("7", "out of range"),
            ("\"on\"", "\"on\" is neither a number nor \"off\""),
            (
                "true",
                "a bound of 1 to 6 standard uncertainties, or \"off\"",
            ),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }

    #[test]
    fn the_unit_counts_where_it_is_on() {
        let inch = Some(RegularizeUnits::Inch);
        assert_eq!(Regularize::Off.settings(inch), pipeline::Regularize::Off);
        let pipeline::Regularize::On(on) = Regularize::Bound(2.0).settings(inch) else {
            panic!("it is on");
        };
        assert_eq!((on.bound, on.round), (2.0, pipeline::Round::Inch));
    }
}
