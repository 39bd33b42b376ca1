//! What can go wrong.

use range_image::Cancelled;

use crate::settings::SettingsError;

/// Why there are no triangles.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TessellateError {
    /// A setting cannot be.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The caller asked for an end.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// There is nothing to divide.
    #[error("the model has no faces")]
    NoFaces,
    /// A face refers to what the model lacks, or to numbers that are none.
    #[error("face {face}: {reason}")]
    Malformed {
        /// Name of the face.
        face: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// The border of a face touches or crosses itself however finely it is divided.
    #[error(
        "face {face}: its border touches or crosses itself near x {:.3}, y {:.3} mm",
        at_mm[0], at_mm[1]
    )]
    Crossing {
        /// Name of the face.
        face: String,
        /// Where.
        at_mm: [f64; 2],
    },
    /// The tolerance asks for more triangles than are made.
    #[error(
        "face {face} would need more than {most} triangles to keep the tolerance: choose a larger \
         one"
    )]
    TooMany {
        /// Name of the face.
        face: String,
        /// Most triangles of one face.
        most: usize,
    },
}
