//! From the first column to the summary.

use std::future::Future;
use std::path::{Path, PathBuf};

use deliverables::{REPORT_NAME, Report};
use relief_api::{Job, Scan, SettingOverrides, StartScan, path};
use serde::Serialize;
use tokio::signal::unix::{SignalKind, signal};

use super::Args;
use super::bench::Bench;
use crate::command::fetch;
use crate::failure::Failure;
use crate::follow;
use crate::output;
use crate::service::Client;
use crate::summary;

/// What `--json` prints.
#[derive(Serialize)]
struct Told {
    directory: PathBuf,
    iges: PathBuf,
    after_last_column_s: f64,
    scan: Scan,
    job: Job,
    report: Report,
}

/// Runs the demo; Ctrl-C clears everything away.
pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    // From here on an interrupt is ours to handle, whatever we are at.
    let interrupt = interrupted()?;
    if args.out.exists() && !args.out.is_dir() {
        // Better told now than after the scan.
        return Err(Failure::Usage(format!(
            "{} is not a directory; choose another with --out",
            args.out.display()
        )));
    }
    if let Some(share) = args.dropouts.filter(|share| *share >= 1.0) {
        return Err(Failure::Usage(format!(
            "--dropouts {share} drops every sample, so that nothing would be left of the scan; \
             choose a share below 1"
        )));
    }
    let bench = Bench::set_up(&args).await?;
    eprintln!(
        "A simulated scanner at {} scans the {}; a private service processes it.",
        bench.port().display(),
        name_of(&args.object)
    );
    let client = bench.client();
    let told = tokio::select! {
        told = scan(&args, &client) => told,
        () = interrupt => Err(Failure::Interrupted),
    };
    bench.clear().await;
    output::either(json, &told?, lines)
}

async fn scan(args: &Args, client: &Client) -> Result<Told, Failure> {
    let events = client.events().await?;
    let mut settings = SettingOverrides::from([("regrid.seed".to_owned(), args.seed.into())]);
    args.regularize.add_to(&mut settings);
    let request = StartScan {
        name: name_of(&args.object),
        operator: "relief demo".into(),
        note: "simulated scanner".into(),
        settings,
        ..StartScan::default()
    };
    let scan: Scan = client.post(path::SCANS, &request).await?;
    let followed = follow::scan(client, events, &scan.id).await?;
    let result = &followed.job.result;
    let fetched = fetch::into_directory(client, result, args.out.clone()).await?;
    let cad = fetched
        .files
        .iter()
        .find(|file| file.name.ends_with(".igs"));
    let iges = cad.map_or_else(|| args.out.clone(), |file| args.out.join(&file.name));
    Ok(Told {
        report: read_report(&fetched.directory)?,
        directory: fetched.directory,
        iges,
        after_last_column_s: followed.after_last_column_s,
        scan: followed.scan,
        job: followed.job,
    })
}

fn read_report(directory: &Path) -> Result<Report, Failure> {
    let path = directory.join(REPORT_NAME);
    let failed = |error: &dyn std::error::Error| {
        Failure::at(format!("cannot read {}", path.display()), error)
    };
    let text = std::fs::read(&path).map_err(|error| failed(&error))?;
    serde_json::from_slice(&text).map_err(|error| failed(&error))
}

fn lines(told: &Told) -> String {
    let mut lines = summary::lines(&told.report);
    lines.push(format!(
        "published    {:.2} s after the last column",
        told.after_last_column_s
    ));
    lines.push(String::new());
    lines.push(format!("CAD file     {}", told.iges.display()));
    lines.push(format!(
        "beside it    STEP file, page, pictures, view, report and manifest in {}",
        told.directory.display()
    ));
    lines.join("\n")
}

/// The object's name, or that of its file.
fn name_of(object: &str) -> String {
    let path = Path::new(object);
    path.file_stem().map_or_else(
        || object.to_owned(),
        |stem| stem.to_string_lossy().into_owned(),
    )
}

/// Comes to its end on Ctrl-C or when somebody ends the process politely.
fn interrupted() -> Result<impl Future<Output = ()>, Failure> {
    let listen =
        |kind| signal(kind).map_err(|error| Failure::at("cannot listen for Ctrl-C", &error));
    let mut interrupt = listen(SignalKind::interrupt())?;
    let mut terminate = listen(SignalKind::terminate())?;
    Ok(async move {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
        }
    })
}
