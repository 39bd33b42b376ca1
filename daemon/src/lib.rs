//! The Relief service: acquisition, job queue, spool and HTTP API.
//!
//! ```text
//! scanner-driver --> acquisition --> journal on disk
//!                        |   \-----> events --> HTTP --> clients
//!                        v
//!                    job queue --> worker --> spool
//! ```
//!
//! [`Daemon::start`] runs the whole in this process; the program `reliefd` adds signals,
//! the log and systemd. Each scanner takes one scan at a time, on threads of its own, whatever
//! the other scanners do; jobs run on others, so that a second scan can be taken while the
//! first is processed.

pub mod calibration;
pub mod config;
pub mod discovery;
pub mod logging;
pub mod systemd;

mod acquisition;
mod arguments;
mod confined;
mod daemon;
mod error;
mod events;
mod fit;
mod fleet;
mod http;
mod ids;
mod images;
mod jobs;
mod laser;
mod lists;
mod liveness;
mod metrics;
mod receivers;
mod recovery;
mod scans;
mod service;
mod space;
mod spool;
mod starts;
mod station;
mod stopping;
mod store;
mod tokens;
mod traces;

pub use acquisition::PlanError;
pub use arguments::Arguments;
pub use config::{Config, ConfigError};
pub use confined::{HOOK_CHILD, become_hook};
pub use daemon::{Daemon, StartError};
pub use error::ServiceError;
pub use fleet::{BareWorker, FleetError, WorkerError, WorkerOptions};
pub use http::ListenError;
pub use laser::LaserLogError;
pub use receivers::ReceiverError;
pub use spool::SpoolError;
pub use station::OpenScanner;
pub use store::StoreError;
pub use tokens::TokenError;
