//! What scans of reference spheres, step gauges and plates tell of the scanner that took them.
//!
//! ```text
//! counts --> find (spheres, steps, plate) --> calibrate: deviations, with uncertainties
//!                                        \--> figures: size, form, spacing, flatness
//!                                                 \--> series: repeatability, drift
//! ```
//!
//! # What can be told
//!
//! A sample is where the camera is at its table position, and the range along a ray from there
//! ([`range_image::Calibration`]). A sphere of known diameter that stands nobody knows where tells
//! what changes its *shape*: the scales of angle, range and table, and the direction of travel
//! against the laser plane, which shears it. Where the camera stands and how it is rolled about x
//! moves and turns all that is seen as one; no size on a part depends on it, and no sphere at an
//! unknown place tells it. An offset of the ranges shows only in how the scale of y changes with
//! the distance. So [`calibrate`](calibrate::calibrate) determines what the scans allow of, leaves
//! the rest at zero, and says which ([`Undetermined`]). Spheres at known places tell the rest.

mod adjust;
pub mod calibrate;
pub mod deviations;
pub mod figures;
pub mod find;
mod linear;
mod measured;
mod random;
mod robust;
pub mod scan;
pub mod series;
mod sight;
mod sizes;
pub mod sphere;
pub mod steps;

pub use calibrate::{CalibrateError, Calibrated, Determined, Seen, Undetermined, calibrate};
pub use deviations::{Deviation, Deviations};
pub use scan::{RawSample, Scan};
