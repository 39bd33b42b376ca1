//! Milling of a surface: from triangles to NC code.
//!
//! ```text
//! triangles --> Surface --> cutter dropped onto it: heights of the tip
//!                             |
//!                             +--> roughing in levels, around the surface and an allowance
//!                             +--> finishing passes, as far apart as their cusps allow; short ones
//!                                    |   where these are still too high
//!                                    |
//!                                    v
//!               samples --> lines and arcs above them --> links, retracts --> Operation
//!                                                                               |
//!                            NC code, time, simulated removal <-----------------+
//! ```
//!
//! A cutter stands on a surface at the highest of all heights at which it touches a face, an edge or
//! a corner of a triangle (Hwang 1992; Chuang, Chen & Yau 2002). Whatever is made of these heights
//! only ever lies above them: the path leaves material rather than taking too much.
//!
//! Everything is pure, and gives the same bits whatever the number of threads. Millimetres; z is up,
//! along the cutter's axis.

mod arc;
mod between;
mod check;
mod cusp;
mod cutter;
mod drop;
mod edge;
mod error;
mod facet;
mod field;
mod link;
mod machine;
mod mend;
mod motion;
mod parallel;
mod plan;
mod post;
mod quantize;
mod reach;
mod ridge;
mod rough;
mod scallop;
mod settings;
mod simplify;
mod simulate;
mod strand;
mod surface;
mod time;
mod trace;
mod way;
mod ways;

pub use cutter::{Cutter, CutterError, DIAMETERS_MM, Kind};
pub use drop::drop_cutter;
pub use error::ToolpathError;
pub use facet::Contact;
pub use machine::{Cuboid, DECIMALS, Dialect, Feed, Fixture, Machine, MachineError, Speed, Tool};
pub use motion::{Arc, Move, Operation, Plane, Travel};
pub use plan::{Plan, plan};
pub use post::{Header, rounded, write};
pub use settings::{Pattern, Settings};
pub use simulate::{HeightField, Removal};
pub use surface::Surface;
pub use time::{Duration, duration};
