//! The recognition itself.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use deliverables::features::{
    EditEntry, FeaturesFile, features_solid, read_edits, write_features_picture,
    write_features_step,
};
use deliverables::{CadOptions, WriteError, write_atomically};
use features::network::Classifier;
use features::recognise::{RecogniseError, Recognition, Settings, Teller, recognise};
use serde::Serialize;

use super::reduced::{self, ReducedFile};
use super::{Args, summary};
use crate::command::shown::{self, Shown};
use crate::command::{places, timestamp};
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
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) reduced: Option<ReducedFile>,
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
    check_places(args, &output)?;
    let reduction = args.reduction.reduction()?;
    let network = network(&args.network)?;
    let edits = args.edit.as_deref().map(read_edits).transpose();
    let edits = edits.map_err(|error| Failure::Failed(error.to_string()))?;
    let mut scan = input::read(args.scan(), args.units())?;
    scan.columns.sort_by(range_image::Column::compare_x);
    shown.begin("features");
    let began = Instant::now();
    let mut recognition = recognised(args, &scan, &network, shown)?;
    let seconds = began.elapsed().as_secs_f64();
    if let (Some(edits), Some(path)) = (&edits, &args.edit) {
        let edits: Vec<_> = edits.iter().map(EditEntry::edit).collect();
        features::edit::edit(&mut recognition, &edits, network.classes())
            .map_err(|error| Failure::at(path.display(), &error))?;
    }
    let file = FeaturesFile::of(&recognition);
    write_atomically::<std::io::Error>(&output, |sink| file.write(sink))
        .map_err(|error| Failure::at(format!("cannot write {}", output.display()), &error))?;
    let name = scan.name.clone().unwrap_or_else(|| args.name());
    if let Some(path) = &args.picture {
        write_atomically::<std::io::Error>(path, |sink| {
            write_features_picture(&recognition.image, &recognition, &name, sink)
        })
        .map_err(|error| Failure::at(format!("cannot draw {}", path.display()), &error))?;
    }
    let reduced = match &args.reduced {
        Some(path) => Some(reduced::write(
            path,
            &reduction,
            &scan.columns,
            &recognition,
        )?),
        None => None,
    };
    let at = |path: &Path, note: &String| format!("{}: {note}", path.display());
    let mut warnings: Vec<String> = scan
        .notes
        .iter()
        .map(|note| at(args.scan(), note))
        .collect();
    warnings.extend(recognition.notes.iter().cloned());
    if let Some(path) = &args.step {
        let notes = write_solid(args, path, &scan, &name, &recognition)?;
        warnings.extend(notes.iter().map(|note| at(path, note)));
    }
    Ok(Recognised {
        output,
        file,
        step: args.step.clone(),
        picture: args.picture.clone(),
        reduced,
        seconds,
        warnings,
    })
}

/// That nothing is written over what is read, or over something else that is written.
fn check_places(args: &Args, output: &Path) -> Result<(), Failure> {
    let more = [&args.picture, &args.step, &args.reduced];
    let more = more.into_iter().flatten().map(PathBuf::as_path);
    let written: Vec<&Path> = std::iter::once(output).chain(more).collect();
    let mut read = vec![("scan", args.scan()), ("network", Path::new(&args.network))];
    read.extend(args.edit.as_deref().map(|path| ("file of edits", path)));
    places::check_files(&written, &read)
}

fn recognised(
    args: &Args,
    scan: &input::Input,
    network: &Classifier,
    shown: &Shown,
) -> Result<Recognition, Failure> {
    let settings = Settings {
        teller: match args.classes_by_chance {
            Some(seed) => Teller::Chance(network, seed),
            None => Teller::Network(network),
        },
        seed: args.seed,
        least_pitches: args.least_pitches,
    };
    regrid::with_threads(args.threads, || {
        recognise(&scan.columns, scan.camera_mm, &settings, shown)
    })
    .map_err(|error| Failure::at("cannot recognise features", &error))?
    .map_err(|error| match error {
        RecogniseError::Cancelled(_) => Failure::Interrupted,
        other => Failure::at(args.scan().display(), &other),
    })
}

/// Writes the part rebuilt from its features; gives what the user should know of it.
fn write_solid(
    args: &Args,
    path: &Path,
    scan: &input::Input,
    name: &str,
    recognition: &Recognition,
) -> Result<Vec<String>, Failure> {
    let (solid, notes) = features_solid(recognition)
        .map_err(|error| Failure::at("cannot rebuild the part", &error))?;
    let timestamp = timestamp::of(args.timestamp, scan.timestamp, args.scan())?;
    let cad = CadOptions::default();
    write_atomically::<WriteError>(path, |sink| {
        write_features_step(&solid, name, timestamp, &cad, sink)
    })
    .map_err(|error| Failure::at(format!("cannot write {}", path.display()), &error))?;
    Ok(notes)
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
