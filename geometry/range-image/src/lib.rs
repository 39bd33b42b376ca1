//! The ground floor of the geometry crates: units, frames, calibration from device
//! counts to millimetres, columns of samples, and the uniform range image.
//!
//! Everything here is plain data. Lengths are millimetres, angles radians, both `f64`.

pub mod calibration;
pub mod column;
pub mod correction;
pub mod frame;
pub mod image;
pub mod monitor;
pub mod quality;
pub mod region_map;

pub use calibration::Calibration;
pub use column::{Column, Sample};
pub use correction::Correction;
pub use frame::{Part, Position, Sensor};
pub use image::{GridColumn, Lattice, RangeImage, RangeImageBuilder};
pub use monitor::{Cancelled, Monitor, Unmonitored};
pub use quality::NodeQuality;
pub use region_map::RegionMap;
