//! Calibration and figures held against the simulated scanner, whose truth they never see.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

mod bench;
mod deviations;
mod figures;
