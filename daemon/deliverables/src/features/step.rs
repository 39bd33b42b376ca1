//! The part rebuilt from its features, as a solid in a STEP file.

use std::io::Write;

use cad_exchange::step;
use features::rebuild::{RebuildError, rebuilt};
use features::recognise::Recognition;
use jiff::Timestamp;
use terraces::{BuildError, Solid};

use crate::export::{CadOptions, WriteError, step_options};

/// Why there is no solid.
#[derive(Debug, thiserror::Error)]
pub enum FeaturesStepError {
    /// The features describe no part.
    #[error(transparent)]
    Rebuild(#[from] RebuildError),
    /// No solid came of the part.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// The solid of the features, and what was assumed or left out for it.
///
/// # Errors
/// The features make no solid.
pub fn features_solid(
    recognition: &Recognition,
) -> Result<(Solid, Vec<String>), FeaturesStepError> {
    let rebuilt = rebuilt(recognition)?;
    let built = rebuilt.part.build()?;
    let mut notes = rebuilt.assumed;
    notes.extend(built.warnings.iter().map(ToString::to_string));
    Ok((built.solid, notes))
}

/// Writes the solid as STEP; AP242 where the options name no schema.
///
/// # Errors
/// As of [`step::write_solid`].
pub fn write_features_step(
    solid: &Solid,
    name: &str,
    timestamp: Timestamp,
    cad: &CadOptions,
    mut sink: impl Write,
) -> Result<(), WriteError> {
    step::write_solid(solid, &step_options(name, timestamp, cad), &mut sink)?;
    Ok(())
}
