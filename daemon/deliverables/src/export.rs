//! The model as CAD files.

use std::io::Write;

use cad_exchange::{iges, step};
use jiff::Timestamp;
use jiff::tz::TimeZone;
use reconstruct::Model;

use crate::further::Further;
use crate::meshes::MeshOptions;

pub use cad_exchange::iges::Entities;
pub use cad_exchange::step::{LengthUnit, Schema};

/// What the user may say about the CAD files.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CadOptions {
    /// Which IGES entities carry the shape.
    pub entities: Entities,
    /// What the STEP file follows, where there is one.
    pub step: Option<Schema>,
    /// The unit of lengths in the STEP file.
    pub step_units: LengthUnit,
    /// Files of triangles and points beside the CAD files.
    pub meshes: MeshOptions,
    /// Surfaces and an NC program beside them.
    pub further: Further,
    /// Who made the model; may be empty.
    pub author: String,
    /// The author's organisation; may be empty.
    pub organisation: String,
}

impl CadOptions {
    /// Number of the surfaces' entity type; 190, that of a plane, for surfaces by their numbers;
    /// 186, that of a solid, for the same as boundary representation.
    #[must_use]
    pub fn entity_number(&self) -> u16 {
        match self.entities {
            Entities::Parametric114 => 114,
            Entities::Rational128 => 128,
            Entities::Analytic => 190,
            Entities::Boundary => 186,
        }
    }

    /// What the STEP file follows, in the words of configuration and command line.
    #[must_use]
    pub fn step_name(&self) -> &'static str {
        match self.step {
            Some(Schema::Ap242) => "ap242",
            Some(Schema::Ap214) => "ap214",
            None => "off",
        }
    }

    /// The unit of lengths in the STEP file, in the same words.
    #[must_use]
    pub fn step_units_name(&self) -> &'static str {
        match self.step_units {
            LengthUnit::Millimetre => "mm",
            LengthUnit::Inch => "inch",
        }
    }
}

/// The model is none that a CAD file can hold, or the file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// As IGES.
    #[error(transparent)]
    Iges(#[from] iges::WriteError),
    /// As STEP.
    #[error(transparent)]
    Step(#[from] step::WriteError),
    /// As triangles or points.
    #[error(transparent)]
    Mesh(#[from] mesh_files::MeshFileError),
    /// What the destination said.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

impl WriteError {
    /// What the destination said, where that was the trouble.
    #[must_use]
    pub fn io(&self) -> Option<&std::io::Error> {
        match self {
            Self::Iges(iges::WriteError::Io(error)) | Self::Step(step::WriteError::Io(error)) => {
                Some(error)
            }
            Self::Io(error) => Some(error),
            Self::Mesh(error) => error.io(),
            _ => None,
        }
    }
}

/// Writes a model as IGES. The bytes depend on nothing but the arguments: the service and
/// `relief convert` both come through here.
///
/// # Errors
/// As [`iges::write`].
pub fn write_iges(
    model: &Model,
    name: &str,
    timestamp: Timestamp,
    cad: &CadOptions,
    mut sink: impl Write,
) -> Result<(), WriteError> {
    let stem = file_stem(name);
    let mut options = iges::WriteOptions::new(stem.clone(), iges_time(timestamp));
    options.file_name = format!("{stem}.igs");
    options.entities = cad.entities;
    options.author.clone_from(&cad.author);
    options.organization.clone_from(&cad.organisation);
    iges::write(model, &options, &mut sink)?;
    Ok(())
}

/// Writes whole surfaces as IGES, as entities 114 or, whatever else is asked for, 128.
///
/// # Errors
/// As [`iges::write_surfaces`] and [`iges::write_parametric_surfaces`].
pub fn write_surfaces(
    surfaces: &[iges::NamedSurface<'_>],
    name: &str,
    timestamp: Timestamp,
    author: &str,
    entities: Entities,
    mut sink: impl Write,
) -> Result<iges::Summary, WriteError> {
    let stem = file_stem(name);
    let mut options = iges::WriteOptions::new(stem.clone(), iges_time(timestamp));
    options.file_name = format!("{stem}.igs");
    author.clone_into(&mut options.author);
    Ok(match entities {
        Entities::Parametric114 => iges::write_parametric_surfaces(surfaces, &options, &mut sink)?,
        _ => iges::write_surfaces(surfaces, &options, &mut sink)?,
    })
}

/// Writes trimmed B-spline surfaces as IGES; curves in space may lie `gap_mm` off.
///
/// # Errors
/// As [`iges::write_trimmed`].
pub fn write_trimmed(
    patches: &[iges::NamedPatch<'_>],
    gap_mm: f64,
    name: &str,
    timestamp: Timestamp,
    mut sink: impl Write,
) -> Result<iges::Summary, WriteError> {
    let stem = file_stem(name);
    let mut options = iges::WriteOptions::new(stem.clone(), iges_time(timestamp));
    options.file_name = format!("{stem}.igs");
    Ok(iges::write_trimmed(patches, gap_mm, &options, &mut sink)?)
}

fn iges_time(timestamp: Timestamp) -> String {
    let time = timestamp.to_zoned(TimeZone::UTC);
    time.strftime("%Y%m%d.%H%M%S").to_string()
}

/// Writes a model as STEP; AP242 where the options name no schema. The bytes depend on
/// nothing but the arguments: the service and `relief convert` both come through here.
///
/// # Errors
/// As [`step::write`].
pub fn write_step(
    model: &Model,
    name: &str,
    timestamp: Timestamp,
    cad: &CadOptions,
    mut sink: impl Write,
) -> Result<(), WriteError> {
    step::write(model, &step_options(name, timestamp, cad), &mut sink)?;
    Ok(())
}

/// The options of a STEP file.
pub(crate) fn step_options(
    name: &str,
    timestamp: Timestamp,
    cad: &CadOptions,
) -> step::WriteOptions {
    let time = timestamp
        .to_zoned(TimeZone::UTC)
        .strftime("%Y-%m-%dT%H:%M:%S+00:00")
        .to_string();
    let mut options = step::WriteOptions::new(file_stem(name), time);
    options.schema = cad.step.unwrap_or_default();
    options.unit = cad.step_units;
    options.author.clone_from(&cad.author);
    options.organization.clone_from(&cad.organisation);
    options
}

/// A name made fit for a file: no separators, no control characters, no leading dot or
/// dash, not empty, at most 100 characters.
#[must_use]
pub fn file_stem(name: &str) -> String {
    let cleaned: String = name
        .trim()
        .chars()
        .map(|c| {
            if c.is_control() || "/\\:*?\"<>|".contains(c) {
                '_'
            } else {
                c
            }
        })
        .take(100)
        .collect();
    let stem = cleaned.trim_start_matches(['.', '-', ' ']).trim_end();
    if stem.is_empty() {
        "scan".to_owned()
    } else {
        stem.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_fit_for_files() {
        for (name, stem) in [
            ("house", "house"),
            (" front cover 7 ", "front cover 7"),
            ("../../etc/passwd", "_.._etc_passwd"),
            ("a/b\\c:d\u{7}", "a_b_c_d_"),
            ("", "scan"),
            ("...", "scan"),
            ("-rf", "rf"),
            ("geh\u{e4}use", "geh\u{e4}use"),
        ] {
            assert_eq!(file_stem(name), stem, "{name:?}");
        }
        assert_eq!(file_stem(&"x".repeat(500)).len(), 100);
    }
}
