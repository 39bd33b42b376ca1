//! The teaching itself.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use deliverables::write_atomically;
use features::network::{Classifier, Epoch, TrainError, judge, train};
use features::patterns::{GivenPattern, parse};
use serde::Serialize;

use super::{Args, summary};
use crate::command::shown::{self, Shown};
use crate::failure::Failure;
use crate::output;

/// What `--json` prints.
#[derive(Debug, Serialize)]
pub(super) struct Told {
    pub(super) output: PathBuf,
    pub(super) classes: Vec<String>,
    /// Inputs, hidden neurons, outputs.
    pub(super) neurons: [usize; 3],
    pub(super) seed: u64,
    pub(super) patterns: usize,
    /// Attributes that were taught and are known by themselves.
    pub(super) known: usize,
    pub(super) epochs: usize,
    pub(super) converged: bool,
    pub(super) errors: Vec<EpochTold>,
    /// Bounds of answers; none of the published network.
    pub(super) bounds: Option<BoundsTold>,
    pub(super) judged: JudgedTold,
    pub(super) seconds: f64,
}

#[derive(Debug, Serialize)]
pub(super) struct EpochTold {
    pub(super) epoch: usize,
    pub(super) error: f64,
}

#[derive(Debug, Serialize)]
pub(super) struct BoundsTold {
    pub(super) output: f64,
    pub(super) margin: f64,
    pub(super) distance: f64,
}

#[derive(Debug, Serialize)]
pub(super) struct JudgedTold {
    pub(super) patterns: usize,
    pub(super) right: usize,
    pub(super) unknown: usize,
    /// For each class how its patterns were called: each class in turn, then unknown.
    pub(super) confusion: Vec<Vec<usize>>,
    pub(super) random_codes: usize,
    pub(super) random_codes_known: usize,
}

/// Files of patterns are written by hand.
const LARGEST_FILE: u64 = 16 << 20;
/// Errors that are told, from the first epoch to the last.
const EPOCHS_TOLD: usize = 12;

/// Teaches a network; Ctrl-C ends it without leaving half a file.
pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let told = shown::work("training", move |shown| train_file(&args, shown)).await?;
    output::either(json, &told, summary::told)
}

fn train_file(args: &Args, shown: &Shown) -> Result<Told, Failure> {
    let recipe = args.recipe();
    let output = args.output()?;
    let mut given = Vec::new();
    for path in &args.patterns {
        given.extend(read(path)?);
    }
    shown.begin("train");
    let start = Instant::now();
    let failed = |error: TrainError| match error {
        TrainError::Cancelled(_) => Failure::Interrupted,
        TrainError::Recipe { .. } => Failure::Usage(error.to_string()),
        other => Failure::Failed(other.to_string()),
    };
    let (network, epochs) = train(&recipe, &given, shown).map_err(failed)?;
    let judged = judge(&network, &given).map_err(failed)?;
    let seconds = start.elapsed().as_secs_f64();
    write_atomically::<io::Error>(output, |sink| sink.write_all(network.written().as_bytes()))
        .map_err(|error| Failure::at(format!("cannot write {}", output.display()), &error))?;
    Ok(Told {
        output: output.to_owned(),
        judged: JudgedTold {
            patterns: judged.patterns(),
            right: judged.right(),
            unknown: judged.unknown(),
            confusion: judged.confusion,
            random_codes: judged.foreign,
            random_codes_known: judged.foreign_known,
        },
        seconds,
        ..told(&network, &epochs)
    })
}

/// All of it but how it was judged, where it went and how long it took.
fn told(network: &Classifier, epochs: &[Epoch]) -> Told {
    let trained = network.trained();
    let bounds = network.bounds();
    Told {
        output: PathBuf::new(),
        classes: network.classes().to_vec(),
        neurons: network.net().sizes(),
        seed: trained.recipe.seed,
        patterns: trained.patterns,
        known: network.known().taught().len(),
        epochs: trained.epochs,
        converged: trained.has_converged,
        errors: some_of(epochs),
        bounds: bounds.distance.is_finite().then_some(BoundsTold {
            output: bounds.output,
            margin: bounds.margin,
            distance: bounds.distance,
        }),
        judged: JudgedTold {
            patterns: 0,
            right: 0,
            unknown: 0,
            confusion: Vec::new(),
            random_codes: 0,
            random_codes_known: 0,
        },
        seconds: 0.0,
    }
}

/// The first epochs one by one, then ever fewer, and the last: errors fall fast at first.
fn some_of(epochs: &[Epoch]) -> Vec<EpochTold> {
    let count = epochs.len();
    let mut told: Vec<usize> = (0..EPOCHS_TOLD)
        .map(|k| {
            let share = k as f64 / (EPOCHS_TOLD - 1) as f64;
            (count.max(1) as f64).powf(share).round() as usize
        })
        .collect();
    told.dedup();
    let epoch = |number: usize| epochs.get(number.checked_sub(1)?);
    told.into_iter()
        .filter_map(epoch)
        .map(|own| EpochTold {
            epoch: own.epoch,
            error: own.error,
        })
        .collect()
}

fn read(path: &Path) -> Result<Vec<GivenPattern>, Failure> {
    let name = path.display().to_string();
    let cannot = |error: io::Error| Failure::at(format!("cannot read {name}"), &error);
    let length = fs::metadata(path).map_err(cannot)?.len();
    if length > LARGEST_FILE {
        return Err(Failure::Failed(format!(
            "{name}: {length} bytes are too many for a file of patterns; at most {LARGEST_FILE}"
        )));
    }
    let text = fs::read_to_string(path).map_err(cannot)?;
    parse(&text, &name).map_err(|error| Failure::Failed(error.to_string()))
}
