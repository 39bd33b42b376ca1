//! All tests of IGES and STEP files.

#[path = "../../examples/sample/mod.rs"]
#[allow(
    dead_code,
    clippy::unwrap_used,
    reason = "shared with the examples; a test that cannot go on says where"
)]
mod sample;

mod analytic;
mod boundary;
mod foreign;
mod hostile;
mod layout;
mod refusals;
mod round_trip;
mod solids;
mod step_analytic;
mod step_hostile;
mod step_layout;
mod step_refusals;
mod step_round_trip;
mod step_solid;
mod swept;
