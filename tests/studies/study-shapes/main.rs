//! The shapes found on the faces of scenes drawn from seeds, against what the faces are: is
//! it the right kind, and are its numbers as near to the truth as they say?
//!
//! ```sh
//! cargo xtask study shapes --tune
//! ```

mod compare;
mod table;
mod truth;

use std::collections::VecDeque;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::thread;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use pipeline::{Settings, process_columns};
use range_image::Unmonitored;
use relief_tests::scenes::scan::plain_columns;
use relief_tests::scenes::{Purpose, Set, draw};

use crate::compare::{Face, compare};

/// Hold the shapes found on faces against what the faces are
#[derive(Debug, Parser)]
#[command(name = "study-shapes", version)]
struct Options {
    /// Take the seeds that may be looked at while the method is made
    #[arg(long)]
    tune: bool,
    /// Sets of scenes: polyhedral, curved; both unless named
    #[arg(long, value_name = "SET", value_parser = parse_set)]
    set: Vec<Set>,
    /// How many scenes of each set; all unless named
    #[arg(long, value_name = "N")]
    scenes: Option<usize>,
    /// List every face that is not as it should be
    #[arg(long)]
    list: bool,
    /// Fail if the kind of fewer faces than this is right, percent
    #[arg(long, value_name = "P", default_value_t = 0.0)]
    at_least: f64,
}

fn parse_set(name: &str) -> Result<Set, String> {
    [Set::Polyhedral, Set::Curved]
        .into_iter()
        .find(|set| set.name() == name)
        .ok_or_else(|| "polyhedral or curved".to_owned())
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("study-shapes: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<()> {
    let purpose = if options.tune {
        Purpose::Tune
    } else {
        Purpose::Judge
    };
    let sets = match options.set.as_slice() {
        [] => vec![Set::Polyhedral, Set::Curved],
        named => named.to_vec(),
    };
    let most = options.scenes.unwrap_or(usize::MAX);
    let scenes: Vec<(Set, u64)> = sets
        .iter()
        .flat_map(|&set| set.seeds(purpose).take(most).map(move |seed| (set, seed)))
        .collect();
    let faces = all(&scenes)?;
    println!(
        "{} scenes ({}), seeds {}, preset `paper`: noise 0.05 mm, 2 % outliers, 10 % mixed at \
         steps, 1 % dropouts\n",
        scenes.len(),
        sets.iter()
            .map(|set| set.name())
            .collect::<Vec<_>>()
            .join(", "),
        if options.tune {
            "for tuning"
        } else {
            "for judging"
        },
    );
    if options.list {
        table::list(&faces);
    }
    let right = table::kinds(&faces);
    table::numbers(&faces);
    ensure!(
        right >= options.at_least,
        "the kind of {right:.1} % of the faces is right, of {:.1} % it should be",
        options.at_least
    );
    Ok(())
}

/// The faces of all scenes, in their order, worked on by as many threads as there are
/// processors.
fn all(scenes: &[(Set, u64)]) -> Result<Vec<Face>> {
    let open = Mutex::new(scenes.iter().enumerate().collect::<VecDeque<_>>());
    let next = || {
        open.lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop_front()
    };
    let work = || {
        let mut done = Vec::new();
        while let Some((index, &(set, seed))) = next() {
            done.push((index, scene(set, seed)));
        }
        done
    };
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let mut done: Vec<(usize, Result<Vec<Face>>)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let done = workers.into_iter().flat_map(|worker| worker.join());
        done.flatten().collect()
    });
    ensure!(done.len() == scenes.len(), "a scene was lost to a panic");
    done.sort_by_key(|(index, _)| *index);
    let mut faces = Vec::new();
    for (_, of_scene) in done {
        faces.extend(of_scene?);
    }
    Ok(faces)
}

fn scene(set: Set, seed: u64) -> Result<Vec<Face>> {
    let what = || format!("{} scene {seed}", set.name());
    let drawn = draw(set, seed).with_context(what)?;
    let (scanner, columns) = plain_columns(&drawn).with_context(what)?;
    let settings = Settings::new(drawn.truth.lattice.pitch_mm);
    let (image, outcome) = process_columns(&columns, &settings, &Unmonitored).with_context(what)?;
    Ok(compare(&drawn, &scanner, &image, &outcome))
}
