//! Where the kills fell.

use std::collections::BTreeMap;

/// What the service was doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Phase {
    /// It had just been started, and took up what the last kill had left.
    Starting,
    /// Columns were coming in.
    Scan,
    /// The scan had ended before its last column, without a kill.
    Failed,
    /// All columns were acknowledged and no result was told.
    Job,
    /// The result had been told.
    Published,
}

/// How often what.
#[derive(Debug, Default)]
pub(crate) struct Figures(BTreeMap<Phase, u32>);

impl Figures {
    pub(crate) fn add(&mut self, phase: Phase) {
        *self.0.entry(phase).or_default() += 1;
    }

    pub(crate) fn tell(&self) {
        println!("{:<44} {:>6}", "KILLED", "TIMES");
        for (phase, times) in &self.0 {
            let when = match phase {
                Phase::Starting => "while it started and took up work",
                Phase::Scan => "in the scan",
                Phase::Failed => "after a scan that failed by itself",
                Phase::Job => "in the job",
                Phase::Published => "after the publication",
            };
            println!("{when:<44} {times:>6}");
        }
    }
}
