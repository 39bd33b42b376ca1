//! The service from outside, over its own API, with a scanner in memory.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

mod access;
mod acknowledge;
mod ailing;
mod api;
mod brokers;
mod calibration;
mod client;
mod config;
mod cut_short;
mod events;
mod fake;
mod fleet;
mod further;
mod hooks;
mod hostile;
mod jobs;
mod laser;
mod mail;
mod old_state;
mod pause;
mod power;
mod preview;
mod refusals;
mod rig;
mod scanners;
mod scans;
mod traces;
mod uploads;
mod webhooks;
