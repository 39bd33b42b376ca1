//! The whole road from a range image to a model, stage by stage.
//!
//! ```text
//! columns --> regrid --> RangeImage --> segment --> RegionMap --> reconstruct --> Model
//!             (process_columns)         (process ............................)
//!                                          |
//!                                          +--> background, crumbs: listed, not exported
//! ```
//!
//! Everything is pure: the caller brings a monitor for progress and cancellation, and an
//! [`Observer`] learns when each stage begins, so that time is measured outside.

mod background;
mod claims;
mod columns;
mod extent;
mod filling;
mod kinds;
mod method;
mod neighbourhood;
mod observer;
mod outlines;
mod part;
mod process;
mod regular;
mod settings;

pub use background::{BackgroundPolicy, Crumb, NodeRole, UnknownPolicy};
pub use columns::{Columns, InMemory, ReadAgainError};
pub use extent::{Extent, finest_pitch_mm, no_surface, unusual_size};
pub use filling::Filling;
pub use gaps::{
    Cause as FillCause, Counts as RayCounts, Decision as FillDecision, Evidence as FillEvidence,
    Gap, Mode as FillMode, Settings as FillSettings, UnknownMode as UnknownFillMode,
};
pub use kinds::{Basis, Kinds, RegionKind, SmoothJoins, UnknownKinds};
pub use method::{Method, UnknownMethod};
pub use observer::{Observer, Stage};
pub use outlines::SettledNodes;
pub use part::{Part, divide};
pub use process::{
    Outcome, PipelineError, process, process_columns, process_in_view, process_scan,
};
pub use regular::{Regularities, Tangent};
pub use regularize::{
    Adjusted, Kind as RegularityKind, Reason, Refused, Regularity, Round,
    Settings as RegularizeSettings, Target,
};
pub use segment::{Background, BackgroundKind, BackgroundRegion, Plane, View};
pub use settings::{Regularize, Settings, SettingsError};
