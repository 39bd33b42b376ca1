//! Scans a scene and leaves its deliverables for judges outside.
//!
//! A simulated scanner on a pseudo-terminal and a private service do what a real scanner
//! and the installed service would do. The files of the result are copied to the folder
//! given with `--out`, and beside them goes `truth.json`, what is really there, for objects
//! whose visible faces are known in closed form:
//!
//! ```json
//! {
//!   "pitch_mm": 0.42,
//!   "faces": [{ "name": "face 1", "area_mm2": 1.0, "corners": 4, "outline_mm": [[0, 0, 0]] }]
//! }
//! ```
//!
//! The service never sees it. With `--replay` a recorded scan takes the scene's place, and
//! there is no truth.
//!
//! ```sh
//! cargo run --release -p relief-studies --bin scan-scene -- --object house --out out
//! cargo run --release -p relief-studies --bin scan-scene -- --replay view.ply.gz --out out
//! ```

mod truth;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::{Parser, ValueEnum};
use relief_api::{Event, StartScan};
use relief_tests::rig::{Published, Rig};
use sim_scanner::config::{Object, SimConfig};
use sim_scanner::preset::{Overrides, Preset};
use sim_scanner::source::Source;

/// Scan a scene with the simulated scanner and a private service, for judging what comes out
#[derive(Debug, Parser)]
#[command(name = "scan-scene", version)]
struct Options {
    /// What stands on the table: a built-in object of the simulator, or an STL file in mm
    #[arg(long, value_name = "OBJECT|FILE.stl", default_value = "house")]
    object: Object,
    /// Send a recorded scan instead
    #[arg(long, value_name = "FILE", conflicts_with_all = ["object", "preset"])]
    replay: Option<PathBuf>,
    /// The scanner to imitate
    #[arg(long, value_enum, default_value = "paper")]
    preset: PresetName,
    /// Seed of the scanner's noise and of the processing's random draws
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Columns of the scan
    #[arg(long, value_name = "N")]
    columns: Option<u32>,
    /// Samples per column
    #[arg(long, value_name = "N")]
    samples: Option<u32>,
    /// Range noise at normal incidence (1 sigma), mm
    #[arg(long, value_name = "S")]
    noise_mm: Option<f64>,
    /// Probability of an outlier anywhere in the range window
    #[arg(long, value_name = "P")]
    outliers: Option<f64>,
    /// Probability that a sample whose spot lies on a step edge is mixed
    #[arg(long, value_name = "P")]
    mixed: Option<f64>,
    /// Probability of a lost sample at normal incidence
    #[arg(long, value_name = "P")]
    dropouts: Option<f64>,
    /// Probability of a lost sample where gloss mirrors the beam at the sensor
    #[arg(long, value_name = "P", requires = "glare_width_deg")]
    glare: Option<f64>,
    /// Angle between mirrored beam and sensor over which that fades, degrees
    #[arg(long, value_name = "D", requires = "glare")]
    glare_width_deg: Option<f64>,
    /// The road from samples to surfaces: relief or shim-lee
    #[arg(long, value_name = "METHOD")]
    method: Option<String>,
    /// IGES entities of the surfaces: 114, 128, 190 or 186
    #[arg(long, value_name = "TYPE")]
    entities: Option<u16>,
    /// Fail if the result takes longer than this after the last column, seconds
    #[arg(long, value_name = "S")]
    within_s: Option<f64>,
    /// Where the files go; made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum PresetName {
    Paper,
    Cyberware,
    Rf627,
}

impl From<PresetName> for Preset {
    fn from(name: PresetName) -> Self {
        match name {
            PresetName::Paper => Self::Paper,
            PresetName::Cyberware => Self::Cyberware,
            PresetName::Rf627 => Self::Rf627,
        }
    }
}

impl Options {
    fn scanner(&self) -> SimConfig {
        SimConfig {
            object: self
                .replay
                .clone()
                .map_or_else(|| self.object.clone(), Object::Recording),
            preset: self.preset.into(),
            overrides: Overrides {
                columns: self.columns,
                samples: self.samples,
                noise_mm: self.noise_mm,
                outliers: self.outliers,
                mixed: self.mixed,
                dropouts: self.dropouts,
                glare: self.glare,
                glare_width_deg: self.glare_width_deg,
                ..Overrides::default()
            },
            seed: self.seed,
            ..SimConfig::default()
        }
    }

    fn request(&self) -> StartScan {
        let mut settings = relief_api::SettingOverrides::new();
        settings.insert("regrid.seed".into(), self.seed.into());
        if let Some(method) = &self.method {
            settings.insert("reconstruct.method".into(), method.as_str().into());
        }
        if let Some(entities) = self.entities {
            settings.insert("deliverables.entities".into(), entities.into());
        }
        StartScan {
            name: self.name(),
            settings,
            ..StartScan::default()
        }
    }

    /// The object's name, or that of its file without the endings.
    fn name(&self) -> String {
        let file = match (&self.replay, &self.object) {
            (Some(file), _) => file,
            (None, Object::BuiltIn(name)) => return name.clone(),
            (None, Object::Stl(file) | Object::Recording(file)) => file,
        };
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let name = name.strip_suffix(".gz").unwrap_or(&name);
        name.rsplit_once('.').map_or(name, |(stem, _)| stem).into()
    }
}

/// What was measured on the way.
struct Figures {
    columns: u32,
    samples: u64,
    /// From the last column's being on disk to publication, as the events tell it.
    after_last_column_s: f64,
    total_s: f64,
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("scan-scene: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<()> {
    let scanner = options.scanner();
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()?;
    let (figures, result) = runtime.block_on(scan(&scanner, &options.request()))?;
    write_files(&options.out, &result)?;
    let pitch_mm = result.json("report.json")?["range_image"]["pitch_mm"]
        .as_f64()
        .context("the report has no pitch")?;
    match truth::of(&scanner.source()?, pitch_mm)? {
        Some(truth) => {
            let text = serde_json::to_string_pretty(&truth)?;
            write(&options.out.join("truth.json"), text.as_bytes())?;
        }
        None => println!("truth    not known in closed form"),
    }
    println!("columns  {}", figures.columns);
    println!("samples  {}", figures.samples);
    println!("pitch    {pitch_mm} mm");
    if let Source::Simulated { scanner, .. } = scanner.source()? {
        let noise = &scanner.noise;
        println!(
            "noise    {} mm, outliers {}, mixed {}, dropouts {}; seed {}",
            noise.noise_mm, noise.outliers, noise.mixed, noise.dropouts, scanner.seed
        );
    }
    println!(
        "result   {:.3} s after the last column was on disk",
        figures.after_last_column_s
    );
    println!("total    {:.3} s", figures.total_s);
    println!("files    {}", options.out.display());
    if let Some(limit_s) = options.within_s {
        anyhow::ensure!(
            figures.after_last_column_s <= limit_s,
            "the result took {:.3} s after the last column, more than {limit_s} s",
            figures.after_last_column_s
        );
    }
    Ok(())
}

async fn scan(scanner: &SimConfig, request: &StartScan) -> Result<(Figures, Published)> {
    let rig = Rig::start(scanner).await?;
    let figures = follow(&rig, request).await;
    let found = match figures {
        Ok((figures, result)) => rig.result(&result).await.map(|files| (figures, files)),
        Err(error) => Err(error),
    };
    rig.end().await?;
    found
}

/// Takes the scan; gives the name of its result, too.
async fn follow(rig: &Rig, request: &StartScan) -> Result<(Figures, String)> {
    let mut events = rig.client().events().await?;
    let begun = Instant::now();
    let scan = rig.scan(request).await?;
    let mut figures = Figures {
        columns: 0,
        samples: 0,
        after_last_column_s: 0.0,
        total_s: 0.0,
    };
    let mut last_column = begun;
    events
        .until(|event| match event {
            Event::Column {
                scan: of, samples, ..
            } if *of == scan.id => {
                figures.columns += 1;
                figures.samples += u64::from(*samples);
                last_column = Instant::now();
                None
            }
            Event::Scan(told) if told.id == scan.id && told.state.is_over() => Some(()),
            _ => None,
        })
        .await?;
    let scan = rig
        .client()
        .get::<relief_api::Scan>(&relief_api::path::scan(&scan.id))
        .await?;
    anyhow::ensure!(
        scan.state == relief_api::ScanState::Complete,
        "the scan is {}: {}",
        scan.state.as_str(),
        scan.reason.unwrap_or_default()
    );
    let job = rig.first_job(&scan, &mut events).await?;
    figures.after_last_column_s = last_column.elapsed().as_secs_f64();
    figures.total_s = begun.elapsed().as_secs_f64();
    Ok((figures, job.result))
}

fn write_files(directory: &Path, result: &Published) -> Result<()> {
    std::fs::create_dir_all(directory)
        .with_context(|| format!("cannot make {}", directory.display()))?;
    for (name, bytes) in &result.files {
        write(&directory.join(name), bytes)?;
    }
    Ok(())
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    std::fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Options::command().debug_assert();
    }

    #[test]
    fn the_name_is_that_of_the_object_or_file() {
        for (words, name) in [
            (&["--object", "cylinder"][..], "cylinder"),
            (&["--object", "a/part.v2.stl"], "part.v2"),
            (&["--replay", "/data/view.ply.gz"], "view"),
        ] {
            let words = [&["scan-scene", "--out", "x"], words].concat();
            assert_eq!(Options::try_parse_from(words).unwrap().name(), name);
        }
    }
}
