//! The recognition itself.

use std::borrow::Cow;
use std::path::PathBuf;
use std::time::Instant;

use deliverables::features::{
    FeaturesFile, features_solid, write_features_picture, write_features_step,
};
use deliverables::{CadOptions, WriteError, write_atomically};
use features::network::Classifier;
use features::recognise::{RecogniseError, Settings, Teller, recognise};
use serde::Serialize;

use super::{Args, edits, summary};
use crate::command::shown::{self, Shown};
use crate::command::{convert, places, timestamp};
use crate::failure::Failure;
use crate::{input, output};

/// What `--json` prints.
#[derive(Debug, Serialize)]
pub(super) struct Recognised {
    pub(super) output: PathBuf,
    #[serde(flatten)]
    pub(super) file: FeaturesFile,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) step: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) picture: Option<PathBuf>,
    pub(super) seconds: f64,
    pub(super) warnings: Vec<String>,
}

/// Recognises; Ctrl-C ends it without leaving half a file.
pub(super) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let found = shown::work("recognition", move |shown| of_file(&args, shown)).await?;
    for warning in &found.warnings {
        eprintln!("relief: note: {warning}");
    }
    output::either(json, &found, summary::told)
}

fn of_file(args: &Args, shown: &Shown) -> Result<Recognised, Failure> {
    let output = args.output();
    for written in std::iter::once(&output)
        .chain(&args.picture)
        .chain(&args.step)
    {
        places::check_file(written)?;
        if convert::same_file(written, args.scan()) {
            return Err(Failure::Usage(format!(
                "{} is the scan itself; name another file",
                written.display()
            )));
        }
    }
    let network = network(&args.network)?;
    let mut scan = input::read(args.scan(), args.units())?;
    scan.columns.sort_by(range_image::Column::compare_x);
    let settings = Settings {
        teller: match args.classes_by_chance {
            Some(seed) => Teller::Chance(&network, seed),
            None => Teller::Network(&network),
        },
        seed: args.seed,
        least_pitches: args.least_pitches,
    };
    shown.begin("features");
    let began = Instant::now();
    let edits = args.edit.as_deref().map(edits::read).transpose()?;
    let mut recognition = regrid::with_threads(args.threads, || {
        recognise(&scan.columns, scan.camera_mm, &settings, shown)
    })
    .map_err(|error| Failure::at("cannot recognise features", &error))?
    .map_err(|error| match error {
        RecogniseError::Cancelled(_) => Failure::Interrupted,
        other => Failure::at(args.scan().display(), &other),
    })?;
    let seconds = began.elapsed().as_secs_f64();
    if let (Some(edits), Some(path)) = (&edits, &args.edit) {
        features::edit::edit(&mut recognition, edits)
            .map_err(|error| Failure::at(path.display(), &error))?;
    }
    let file = FeaturesFile::of(&recognition);
    write_atomically::<std::io::Error>(&output, |sink| file.write(sink))
        .map_err(|error| Failure::at(format!("cannot write {}", output.display()), &error))?;
    if let Some(path) = &args.picture {
        let name = scan.name.clone().unwrap_or_else(|| args.name());
        write_atomically::<std::io::Error>(path, |sink| {
            write_features_picture(&recognition.image, &recognition, &name, sink)
        })
        .map_err(|error| Failure::at(format!("cannot draw {}", path.display()), &error))?;
    }
    let mut notes = Vec::new();
    if let Some(path) = &args.step {
        let (solid, told) = features_solid(&recognition)
            .map_err(|error| Failure::at("cannot rebuild the part", &error))?;
        notes = told;
        let timestamp = timestamp::of(args.timestamp, scan.timestamp, args.scan())?;
        let name = scan.name.clone().unwrap_or_else(|| args.name());
        let cad = CadOptions::default();
        write_atomically::<WriteError>(path, |sink| {
            write_features_step(&solid, &name, timestamp, &cad, sink)
        })
        .map_err(|error| Failure::at(format!("cannot write {}", path.display()), &error))?;
    }
    let mut warnings: Vec<String> = scan
        .notes
        .iter()
        .map(|note| format!("{}: {note}", args.scan().display()))
        .collect();
    warnings.extend(recognition.notes.iter().cloned());
    if let Some(path) = &args.step {
        warnings.extend(
            notes
                .iter()
                .map(|note| format!("{}: {note}", path.display())),
        );
    }
    Ok(Recognised {
        output,
        file,
        step: args.step.clone(),
        picture: args.picture.clone(),
        seconds,
        warnings,
    })
}

/// The network that was asked for.
fn network(name: &str) -> Result<Cow<'static, Classifier>, Failure> {
    match name {
        "default" => Ok(Cow::Borrowed(Classifier::shipped())),
        "published" => Ok(Cow::Borrowed(Classifier::published())),
        path => {
            let text = std::fs::read_to_string(path)
                .map_err(|error| Failure::at(format!("cannot read the network {path}"), &error))?;
            let network = Classifier::read(&text)
                .map_err(|error| Failure::at(format!("{path} is no network"), &error))?;
            Ok(Cow::Owned(network))
        }
    }
}
