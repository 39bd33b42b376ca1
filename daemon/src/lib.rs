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
//! the log and systemd. One scan at a time is taken, on threads of its own; jobs run on
//! others, so that a second scan can be taken while the first is processed.

pub mod config;
pub mod logging;

mod acquisition;
mod daemon;
mod error;
mod events;
mod http;
mod ids;
mod jobs;
mod scans;
mod service;
mod spool;
mod store;

pub use acquisition::PlanError;
pub use config::{Config, ConfigError};
pub use daemon::{Daemon, StartError};
pub use error::ServiceError;
pub use http::ListenError;
pub use spool::SpoolError;
pub use store::StoreError;
