//! The outlines of simulated scans lie within a pitch of the true ones.

use anyhow::Result;
use relief_tests::outline::measure;
use sim_scanner::config::{Object, SimConfig};

/// Greatest distance of an outline from the truth, either way.
const BOUND_PITCHES: f64 = 1.0;

fn assert_within_a_pitch(object: &str, seed: u64) -> Result<()> {
    let config = SimConfig {
        object: Object::BuiltIn(object.into()),
        seed,
        ..SimConfig::default()
    };
    let outlines = measure(&config)?;
    let worst = outlines.worst_pitches();
    assert!(worst <= BOUND_PITCHES, "seed {seed}: {outlines:?}");
    Ok(())
}

#[test]
fn outlines_of_the_house() -> Result<()> {
    assert_within_a_pitch("house", 1)
}

// With seed 26 samples suggest corners that are none; with seed 135 a junction lies
// beside the curve that ends there. A plain one is the second tier's.
#[test]
fn outlines_of_the_cylinder() -> Result<()> {
    let plain = std::env::var_os("RELIEF_SEEDS").map(|_| 1);
    for seed in [26, 135].into_iter().chain(plain) {
        assert_within_a_pitch("cylinder", seed)?;
    }
    Ok(())
}
