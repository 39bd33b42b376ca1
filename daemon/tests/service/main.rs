//! The service from outside, over its own API, with a scanner in memory.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

mod client;
mod config;
mod events;
mod fake;
mod jobs;
mod refusals;
mod rig;
mod scans;
