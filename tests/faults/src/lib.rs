//! Scans under faults, in simulated time and replayable from a seed: the driver's session and
//! recovery against the simulated device, over a line in memory, without threads and clocks.
//!
//! ```text
//! reader, journal <-- recovery <-- session <== bad line, 1 ms ==> device <-- mishaps
//!                         ^
//!                     a person, who looks after a while
//! ```

pub mod class;
pub mod conditions;
pub mod journal;
pub mod scene;
pub mod simulation;

pub use class::{CLASSES, Class, Need};
pub use conditions::{Conditions, HostFaults, Outcome};
pub use simulation::run;
