//! Calibration and figures held against the simulated scanner, whose truth they never see.

mod bench;
mod deviations;
mod figures;
