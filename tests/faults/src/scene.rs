//! What is scanned, and where chance comes from.

use std::sync::OnceLock;

use anyhow::{Context, Result};
use sim_scanner::preset::{self, Overrides, Preset};
use sim_scanner::random::{Draws, Purpose};
use sim_scanner::source::Source;

/// Objects that are scanned in turn.
const OBJECTS: [&str; 4] = ["house", "cylinder", "figure", "groove"];

const COLUMNS: u32 = 50;
const SAMPLES: u32 = 48;

/// Draws of what happens outside the simulator.
#[derive(Debug)]
pub struct Dice(Draws);

impl Dice {
    /// The stream of this number of a seed.
    #[must_use]
    pub fn new(seed: u64, stream: u64) -> Self {
        Self(Draws::keyed(seed, Purpose::Scene, &[0x6661_756c, stream]))
    }

    /// Uniform in \[0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0.uniform()
    }
}

/// Number of different things that are scanned.
#[must_use]
pub fn count() -> u64 {
    OBJECTS.len() as u64
}

/// What a seed scans.
///
/// # Errors
/// If the simulator lacks one of its own objects.
pub fn source(seed: u64) -> Result<Source> {
    static MADE: OnceLock<Vec<Option<Source>>> = OnceLock::new();
    let made = MADE.get_or_init(|| OBJECTS.iter().map(|name| make(name).ok()).collect());
    made[(seed % count()) as usize]
        .clone()
        .context("the simulator lacks an object")
}

fn make(name: &str) -> Result<Source> {
    let scene = preset::object(name, Preset::Paper.material()).context("an object")?;
    let overrides = Overrides {
        columns: Some(COLUMNS),
        samples: Some(SAMPLES),
        ..Overrides::default()
    };
    let (scanner, proposed) = Preset::Paper.set_up(scene, &overrides, 11)?;
    Ok(Source::Simulated {
        scanner: Box::new(scanner),
        proposed,
    })
}
