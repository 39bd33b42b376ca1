//! Where the kills fell.

use std::collections::BTreeMap;

use anyhow::{Result, ensure};

/// What the service was doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Phase {
    /// It had just been started, and took up what the last kill had left.
    Starting,
    /// Columns were coming in.
    Scan,
    /// The scan had ended before its last column, without a kill.
    Failed,
    /// All columns were kept and no result was told.
    Job,
    /// The result had been told.
    Published,
}

impl Phase {
    fn name(self) -> &'static str {
        match self {
            Self::Starting => "while it started and took up work",
            Self::Scan => "in the scan",
            Self::Failed => "after a scan that failed by itself",
            Self::Job => "in the job",
            Self::Published => "after the publication",
        }
    }
}

/// How often what.
#[derive(Debug, Default)]
pub(crate) struct Figures(BTreeMap<Phase, u32>);

impl Figures {
    pub(crate) fn add(&mut self, phase: Phase) {
        *self.0.entry(phase).or_default() += 1;
    }

    /// Fails where no kill fell: nothing is known of that then.
    pub(crate) fn check(&self) -> Result<()> {
        let wanted = [Phase::Starting, Phase::Scan, Phase::Job, Phase::Published];
        for phase in wanted {
            ensure!(
                self.0.contains_key(&phase),
                "no kill fell {}: run it again on a machine with less other work",
                phase.name()
            );
        }
        Ok(())
    }

    pub(crate) fn tell(&self) {
        println!("{:<44} {:>6}", "KILLED", "TIMES");
        for (phase, times) in &self.0 {
            println!("{:<44} {times:>6}", phase.name());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_kill_fell_into_is_named() {
        let mut figures = Figures::default();
        for phase in [Phase::Starting, Phase::Scan, Phase::Published] {
            figures.add(phase);
        }
        let told = figures.check().unwrap_err().to_string();
        assert!(told.starts_with("no kill fell in the job"), "{told}");
        figures.add(Phase::Job);
        figures.check().unwrap();
    }
}
