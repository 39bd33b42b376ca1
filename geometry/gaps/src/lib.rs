//! Enclosed places of a range image that belong to no region: openings of the part are kept, what was
//! only not measured is closed.
//!
//! ```text
//! image, regions --> gaps --> surfaces of the regions around each, carried on into it
//!                         --> what something higher hides from the sensor or the laser: closed
//!                         --> the rest by the rays that went there: opening or surface?
//! ```
//!
//! The surfaces are implicit ones as for the holes of polygon models (Yoo, section 2; [`fill::Implicit`]).
//! Whether something is an opening is decided by evidence alone: what came back from below the surface,
//! or from the surface itself; how often rays are lost around it; what would hide it. Where none of it
//! tells, it stays open, since an opening that vanishes does more harm than a gap that stays.

mod carry;
mod close;
mod find;
mod odds;
mod rays;
mod report;
mod settings;
mod shadow;
mod sight;
mod surface;

pub use close::{Closed, Visit, close};
pub use odds::{Counts, Evidence};
pub use report::{Cause, Decision, Gap};
pub use settings::{Mode, Settings, SettingsError, UnknownMode};
pub use sight::Sight;
