//! How scans ended, against what must be.

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use anyhow::{Context, Result};
use faults::{Class, Conditions, Need, run};
use rayon::prelude::*;
use scanner_driver::ScannerError;

/// Share of scans that must end by themselves, for classes that need nobody.
const BY_THEMSELVES: f64 = 0.999;

/// The scans of a class.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub(crate) name: String,
    pub(crate) class: Option<Class>,
    pub(crate) scans: u64,
    /// Complete without a person.
    pub(crate) alone: u64,
    /// Complete with a person's help.
    pub(crate) attended: u64,
    pub(crate) pauses: u64,
    pub(crate) measured: u64,
    pub(crate) columns: u64,
    pub(crate) took: Duration,
    /// How often the faults struck, and in how many of the scans at least once.
    pub(crate) strikes: u64,
    pub(crate) struck: u64,
    /// Of another journal or of none, since the object was moved before it was seen.
    pub(crate) excused: u64,
    pub(crate) failures: Vec<String>,
}

impl Tally {
    /// Whether the bars are met.
    pub(crate) fn is_good(&self) -> bool {
        let needs_nobody = self.class.is_some_and(|class| class.need == Need::Nobody);
        let enough = !needs_nobody || self.alone as f64 >= BY_THEMSELVES * self.scans as f64;
        self.failures.is_empty() && enough
    }
}

/// Compares with the journals of scans that nothing befalls.
pub(crate) struct Judge {
    references: Vec<Vec<u8>>,
    flawless: Duration,
}

enum Verdict {
    Ended {
        outcome: faults::Outcome,
        /// It is not the scan without faults, and need not be.
        excused: bool,
        complete: bool,
    },
    Failed(String),
}

impl Judge {
    pub(crate) fn new() -> Result<Self> {
        let mut references = Vec::new();
        let mut flawless = Duration::ZERO;
        for seed in 0..faults::scene::count() {
            let outcome = run(&Conditions {
                seed,
                feels_the_plug: true,
                ..Conditions::default()
            })?;
            flawless = flawless.max(outcome.took);
            references.push(outcome.journal.context("a scan without faults failed")?);
        }
        println!(
            "a scan without faults takes {:.2} s",
            flawless.as_secs_f64()
        );
        Ok(Self {
            references,
            flawless,
        })
    }

    pub(crate) fn many(
        &self,
        name: &str,
        class: Option<&Class>,
        seeds: Range<u64>,
        conditions: impl Fn(u64) -> Conditions + Sync,
    ) -> Tally {
        let verdicts: Vec<Verdict> = seeds
            .into_par_iter()
            .map(|seed| {
                catch_unwind(AssertUnwindSafe(|| self.judge(class, &conditions(seed))))
                    .unwrap_or_else(|_| Verdict::Failed(format!("seed {seed}: a panic")))
            })
            .collect();
        let mut tally = Tally {
            name: name.to_owned(),
            class: class.copied(),
            ..Tally::default()
        };
        for verdict in verdicts {
            tally.scans += 1;
            match verdict {
                Verdict::Failed(why) => tally.failures.push(why),
                Verdict::Ended {
                    outcome,
                    excused,
                    complete,
                } => {
                    let strikes = match class {
                        Some(class) => class.strikes(&outcome.strikes),
                        None => outcome.strikes.total(),
                    };
                    tally.strikes += strikes;
                    tally.struck += u64::from(strikes > 0);
                    tally.excused += u64::from(excused);
                    match (complete, outcome.attended.is_empty()) {
                        (true, true) => tally.alone += 1,
                        (true, false) => tally.attended += 1,
                        (false, _) => {}
                    }
                    tally.pauses += u64::from(outcome.pauses);
                    tally.measured += outcome.measured;
                    tally.columns += u64::from(outcome.columns);
                    tally.took += outcome.took.saturating_sub(self.flawless);
                }
            }
        }
        tally
    }

    fn judge(&self, class: Option<&Class>, conditions: &Conditions) -> Verdict {
        let seed = conditions.seed;
        let failed = |why: String| Verdict::Failed(format!("seed {seed}: {why}"));
        let mut outcome = match run(conditions) {
            Ok(outcome) => outcome,
            Err(error) => return Verdict::Failed(format!("{error:#}")),
        };
        let Some(journal) = outcome.journal.take() else {
            // Measured in two places, it cannot be put where it was.
            if outcome.moved_before_it_was_seen && outcome.error == Some(ScannerError::Aborted) {
                return Verdict::Ended {
                    outcome,
                    excused: true,
                    complete: false,
                };
            }
            return failed(format!("{:?}", outcome.error));
        };
        let reference = self
            .references
            .get((seed % faults::scene::count()) as usize);
        let differs = Some(&journal) != reference;
        if differs && !outcome.moved_before_it_was_seen {
            return failed("another journal".into());
        }
        if let Some(Need::Person(words)) = class.map(|class| class.need)
            && let Some(pause) = outcome
                .attended
                .iter()
                .find(|pause| !pause.to_string().contains(words))
        {
            return failed(format!("it stopped for another cause: {pause}"));
        }
        Verdict::Ended {
            outcome,
            excused: differs,
            complete: true,
        }
    }
}
