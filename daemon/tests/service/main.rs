//! The service from outside, over its own API, with a scanner in memory.

mod client;
mod config;
mod events;
mod fake;
mod jobs;
mod refusals;
mod rig;
mod scans;
