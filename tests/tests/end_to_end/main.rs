//! The service driven through its API with a simulated scanner on a real pseudo-terminal.

mod abort;
mod bad_input;
mod errors;
mod features;
mod further;
mod line;
mod pause;
mod queue;
mod real_input;
mod restart;
mod same_bytes;
mod scan;
mod several;
mod slow_disk;

use relief_api::StartScan;

/// A scan without wishes but a name.
fn named(name: &str) -> StartScan {
    StartScan {
        name: name.into(),
        ..StartScan::default()
    }
}

/// Settings with which a job of a small scan is at work for some seconds before its
/// first result: it can be found at work and stopped there.
fn slowly() -> Vec<(&'static str, serde_json::Value)> {
    vec![
        ("regrid.draws", 4_000.into()),
        ("regrid.pitch_mm", 0.8.into()),
        ("regrid.neighbours", 64.into()),
    ]
}
