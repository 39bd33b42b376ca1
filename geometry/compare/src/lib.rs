//! A scan held against a nominal triangle mesh: brought onto it, its deviations along the
//! nominal's normals, and which of them are significant.
//!
//! ```text
//! range image --> best fit (icp, from many starts) --> pose
//!                                                       |
//! nominal, as seen along z in that pose <---------------+
//!    |                     |
//!    v                     v
//! nodes: map, statistics   samples: local means, limits --> regions --> passed or not
//! ```
//!
//! The regridder makes nodes that outliers and spots torn at steps do not reach; they are
//! registered, drawn and counted. Small deviations are decided by the samples themselves: their
//! distances from the nominal have no creases, steps or curvature in them that smoothing could
//! bend, and their means have errors that can be told ([`Decision`]). Deciding that a limit is
//! exceeded when a mean lies beyond it by its expanded uncertainty is the rule of ISO 14253-1 for
//! proving that a part does not conform.
//!
//! Registration minimises distances along the normals (Chen & Medioni 1992) by weights that take
//! no notice of what is far off; motions that the surfaces leave free are left alone and told
//! ([`Freedom`]).
//!
//! Everything is pure, and gives the same bits whatever the number of threads.

mod deviation;
mod error;
mod freedom;
mod icp;
mod nominal;
mod normal;
mod patches;
mod pose;
mod regions;
mod register;
mod run;
mod seen;
mod settings;
mod statistics;

pub use deviation::NodeState;
pub use error::CompareError;
pub use freedom::{Freedom, PoseUncertainty};
pub use nominal::{FACETS_MAX, Nominal, NominalError};
pub use patches::{Decision, PatchSize};
pub use pose::Pose;
pub use regions::Region;
pub use register::Registration;
pub use run::{Comparison, compare};
pub use settings::{Alignment, CompareSettings, Tolerance};
pub use statistics::{Histogram, Statistics};
