//! Patterns that users give, as TOML.

use serde::Deserialize;
use toml::Spanned;

use crate::code::{Attributes, Digit, End, Form, Section, Sense, code};

/// A pattern of a class, as given.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenPattern {
    /// The class's name.
    pub class: String,
    /// What it looks like.
    pub shown: Shown,
    /// In or out.
    pub sense: Sense,
    /// Of its outline.
    pub form: Form,
    /// Where it begins in its file, from 1.
    pub line: usize,
}

/// What a pattern looks like.
#[derive(Debug, Clone, PartialEq)]
pub enum Shown {
    /// By its code.
    Code(Vec<Digit>),
    /// By a section, which is put in its code as those of scans are.
    Section {
        /// (s, z) of its corners in order, millimetres.
        points: Vec<[f64; 2]>,
        /// Noise that it is seen with, millimetres.
        noise_mm: f64,
        /// Distance of samples that it is seen with, millimetres.
        pitch_mm: f64,
        /// What it ends in.
        ends: [End; 2],
    },
}

impl GivenPattern {
    /// What the network sees of it, without any imperfection.
    #[must_use]
    pub fn attributes(&self) -> Attributes {
        let code = match &self.shown {
            Shown::Code(code) => code.clone(),
            Shown::Section { points, ends, .. } => code(&Section {
                points,
                noise_mm: 0.0,
                pitch_mm: 0.0,
                ends: *ends,
            }),
        };
        Attributes {
            code,
            sense: self.sense,
            form: self.form,
        }
    }
}

/// What is wrong with a file of patterns.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{name}:{line}: {message}")]
pub struct PatternError {
    /// The file, as it was named.
    pub name: String,
    /// From 1.
    pub line: usize,
    /// What, and what to do.
    pub message: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    pattern: Vec<Spanned<Entry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    class: String,
    sense: SenseName,
    form: FormName,
    code: Option<Vec<u8>>,
    section: Option<Vec<[f64; 2]>>,
    noise_mm: Option<f64>,
    pitch_mm: Option<f64>,
    ends: Option<[EndName; 2]>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum SenseName {
    Concave,
    Convex,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum FormName {
    Circular,
    #[serde(alias = "rectangular")]
    Closed,
    Open,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum EndName {
    Rim,
    Open,
}

/// Longest name of a class.
const LONGEST_NAME: usize = 40;
/// Longest code.
const LONGEST_CODE: usize = 99;
/// Most samples across a section.
const MOST_SAMPLES: f64 = 10_000.0;

/// Reads a file of patterns; `name` is what the file is called in errors.
///
/// ```toml
/// [[pattern]]
/// class = "keyway"
/// code = [4, 5, 4, 3, 2, 1, 2]     # or section = [[s, z], ...] in millimetres, with pitch_mm = 0.5,
/// sense = "concave"                # noise_mm = 0.05 and ends = ["rim", "rim"] ("open") if they differ
/// form = "closed"                  # "circular", "closed" or "open"
/// ```
///
/// # Errors
/// Where the text is no TOML, or a pattern cannot be one, with its line.
pub fn parse(text: &str, name: &str) -> Result<Vec<GivenPattern>, PatternError> {
    let at = |offset: usize, message: String| PatternError {
        name: name.to_owned(),
        line: line_of(text, offset),
        message,
    };
    let file: File = toml::from_str(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start);
        at(start, error.message().replace('\n', "; "))
    })?;
    if file.pattern.is_empty() {
        let message = "no patterns; begin each with a line [[pattern]]".to_owned();
        return Err(at(0, message));
    }
    let given = |entry: Spanned<Entry>| {
        let start = entry.span().start;
        let line = line_of(text, start);
        given(entry.into_inner(), line).map_err(|message| at(start, message))
    };
    file.pattern.into_iter().map(given).collect()
}

fn line_of(text: &str, offset: usize) -> usize {
    let before = text.as_bytes().iter().take(offset);
    1 + before.filter(|&&byte| byte == b'\n').count()
}

fn given(entry: Entry, line: usize) -> Result<GivenPattern, String> {
    let class = entry.class.trim().to_owned();
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if class.is_empty() || class.len() > LONGEST_NAME || !class.chars().all(is_name) {
        return Err(format!(
            "class {class:?}: must be 1 to {LONGEST_NAME} letters, digits, _ and -"
        ));
    }
    if class == "unknown" {
        return Err("class \"unknown\" is what the network answers where it knows none".to_owned());
    }
    let shown = match (&entry.code, &entry.section) {
        (Some(_), Some(_)) => return Err("give either code or section, not both".to_owned()),
        (None, None) => return Err("give its code, or a section".to_owned()),
        (Some(numbers), None) => {
            if entry.noise_mm.is_some() || entry.pitch_mm.is_some() || entry.ends.is_some() {
                return Err(
                    "noise_mm, pitch_mm and ends belong to a section, not a code".to_owned(),
                );
            }
            Shown::Code(digits(numbers)?)
        }
        (None, Some(points)) => section(points, &entry)?,
    };
    let given = GivenPattern {
        class,
        shown,
        sense: match entry.sense {
            SenseName::Concave => Sense::Concave,
            SenseName::Convex => Sense::Convex,
        },
        form: match entry.form {
            FormName::Circular => Form::Circular,
            FormName::Closed => Form::ClosedRectangular,
            FormName::Open => Form::Open,
        },
        line,
    };
    if given.attributes().code.is_empty() {
        return Err(
            "its section has no wall between its rims; end it \"open\" if it has none".to_owned(),
        );
    }
    Ok(given)
}

fn digits(numbers: &[u8]) -> Result<Vec<Digit>, String> {
    if numbers.is_empty() || numbers.len() > LONGEST_CODE {
        return Err(format!("code: must have 1 to {LONGEST_CODE} digits"));
    }
    let digit = |&number: &u8| {
        Digit::of(number)
            .ok_or_else(|| format!("code: {number} is no direction; 1 is straight up, 2 slanting up, 3 level, 4 slanting down, 5 straight down"))
    };
    numbers.iter().map(digit).collect()
}

fn section(points: &[[f64; 2]], entry: &Entry) -> Result<Shown, String> {
    if points.len() < 2 || points.iter().flatten().any(|own| !own.is_finite()) {
        return Err("section: must have two points or more, [s, z] in millimetres".to_owned());
    }
    if points.windows(2).any(|pair| pair[1][0] < pair[0][0]) {
        return Err(
            "section: s must not go back; list its points from one side to the other".to_owned(),
        );
    }
    let length = points[points.len() - 1][0] - points[0][0];
    let noise_mm = entry.noise_mm.unwrap_or(0.05);
    let pitch_mm = entry.pitch_mm.unwrap_or(0.5);
    if !(noise_mm.is_finite() && noise_mm >= 0.0) {
        return Err(format!("noise_mm {noise_mm}: must be 0 or more"));
    }
    if !(pitch_mm.is_finite() && pitch_mm > 0.0 && length / pitch_mm <= MOST_SAMPLES) {
        return Err(format!(
            "pitch_mm {pitch_mm}: must be above 0, and at least a {MOST_SAMPLES}th of the section's length"
        ));
    }
    let end = |name: EndName| match name {
        EndName::Rim => End::Rim,
        EndName::Open => End::Open,
    };
    Ok(Shown::Section {
        points: points.to_vec(),
        noise_mm,
        pitch_mm,
        ends: entry.ends.map_or([End::Rim; 2], |ends| ends.map(end)),
    })
}
