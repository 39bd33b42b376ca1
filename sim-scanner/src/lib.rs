//! A simulated slide-table laser scanner: optics, mechanics, noise, faults, and the device's
//! side of the wire protocol.
//!
//! ```text
//! scene ---> optics ---> noise ---> scanner: column by column, each the same whenever asked for
//!   |                                  |
//!   v                                  v
//! truth (for tests and judging)     device: sans-I/O state machine, clock injected
//!                                      |
//!                                      v
//!                                   endpoint: pseudo-terminal | memory; with a control side
//! ```
//!
//! Everything random is drawn from one seed keyed by what is measured (column, sample,
//! surface point), never by the order of asking.
//!
//! Frame: right-handed part frame in millimetres, **x** along the slide table, **y** up, **z**
//! towards the camera. Rays lie in planes x = const.
//!
//! The crate shares no code with the geometry that is judged by what [`truth`] says.

pub mod config;
pub mod control;
pub mod device;
pub mod endpoint;
pub mod fault;
pub mod line;
pub mod mechanics;
pub mod mount;
pub mod noise;
pub mod optics;
pub mod preset;
pub mod random;
pub mod replay;
pub mod scanner;
pub mod scene;
pub mod source;
pub mod truth;

pub use glam::DVec3 as Vec3;
