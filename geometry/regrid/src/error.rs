//! What can go wrong with columns.

use range_image::Cancelled;

use crate::settings::SettingsError;

/// Why columns could not be regridded.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RegridError {
    /// A setting is out of its range.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// Columns that do not go one way.
    #[error(
        "column {index} at x = {x_mm} mm follows one at {previous_mm} mm: columns must come in \
         strictly ascending or strictly descending x"
    )]
    NotMonotone {
        /// Index of the column, from 0, as handed over.
        index: usize,
        /// Its x.
        x_mm: f64,
        /// x of the column before it.
        previous_mm: f64,
    },
    /// A coordinate that no scanner reaches, or that is not a number.
    #[error(
        "column {index}: coordinate {value_mm} mm is beyond {limit_mm} mm; check the units and \
         the calibration"
    )]
    TooFar {
        /// Index of the column, from 0, as handed over.
        index: usize,
        /// The coordinate.
        value_mm: f64,
        /// The limit.
        limit_mm: f64,
    },
    /// A grid with more nodes than memory should be spent on.
    #[error(
        "the grid would have {columns} x {rows} nodes at a pitch of {pitch_mm} mm, more than \
         {limit}; choose a larger pitch or a region of interest"
    )]
    TooManyNodes {
        /// Columns of the grid.
        columns: u64,
        /// Rows of the grid.
        rows: u64,
        /// Distance of nodes.
        pitch_mm: f64,
        /// Most nodes allowed.
        limit: u64,
    },
    /// The system gave no threads.
    #[error("{threads} threads could not be started: {reason}")]
    Threads {
        /// Threads asked for.
        threads: usize,
        /// What the system said.
        reason: String,
    },
    /// The caller has lost interest.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
