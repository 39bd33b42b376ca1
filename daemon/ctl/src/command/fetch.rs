//! `relief fetch`.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use deliverables::{MANIFEST_NAME, Manifest};
use relief_api::{Job, SpoolEntry, path};
use serde::Serialize;

use super::named;
use crate::failure::Failure;
use crate::output;
use crate::service::{Client, EndpointArgs};

/// Copy the deliverables of a scan here and check them against their manifest
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The scan or its name (of several the newest), the result of a rerun or the name it was
    /// given, or `latest`
    #[arg(value_name = "SCAN")]
    scan: String,
    /// Directory for the files, instead of one named after the scan
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Tell the service that the files are here, once they are whole and on disk: it may then
    /// remove its own (`[storage]` of the configuration)
    #[arg(long)]
    ack: bool,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

/// What was fetched; `--json` prints it.
#[derive(Serialize)]
pub(crate) struct Fetched {
    /// Name of the folder in the spool.
    pub(crate) result: String,
    /// Where the files are now.
    pub(crate) directory: PathBuf,
    /// Every file but the manifest.
    pub(crate) files: Vec<deliverables::ManifestFile>,
    /// When the service first heard that somebody has them, if it did.
    #[serde(skip_serializing_if = "Option::is_none")]
    acknowledged_at: Option<String>,
    /// From whom.
    #[serde(skip_serializing_if = "Option::is_none")]
    acknowledged_by: Option<String>,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = args.endpoint.client()?;
    let result = named::result(&client, args.scan).await?;
    let directory = args.output.unwrap_or_else(|| PathBuf::from(&result));
    let mut fetched = into_directory(&client, &result, directory).await?;
    if args.ack {
        acknowledge(&client, &mut fetched).await?;
    }
    output::either(json, &fetched, |fetched| {
        let mut lines: Vec<String> = fetched
            .files
            .iter()
            .map(|file| fetched.directory.join(&file.name).display().to_string())
            .collect();
        lines.push(fetched.directory.join(MANIFEST_NAME).display().to_string());
        lines.join("\n")
    })
}

/// Copies a result's files into a directory, which is made if need be, and checks them.
pub(crate) async fn into_directory(
    client: &Client,
    result: &str,
    directory: PathBuf,
) -> Result<Fetched, Failure> {
    let entry: SpoolEntry = client.get(&path::spool(result)).await?;
    fs::create_dir_all(&directory)
        .map_err(|error| Failure::at(format!("cannot make {}", directory.display()), &error))?;
    for file in &entry.files {
        download(client, &entry.result, &file.name, &directory).await?;
    }
    let files = checked(&directory)?;
    Ok(Fetched {
        result: entry.result,
        directory,
        files,
        acknowledged_at: entry.acknowledged_at,
        acknowledged_by: entry.acknowledged_by,
    })
}

/// Tells the service that the files are here, once no power failure can take them: it may remove
/// its own at once.
async fn acknowledge(client: &Client, fetched: &mut Fetched) -> Result<(), Failure> {
    let names = fetched.files.iter().map(|file| file.name.as_str());
    for name in names.chain([MANIFEST_NAME, "."]) {
        let path = fetched.directory.join(name);
        File::open(&path)
            .and_then(|file| file.sync_all())
            .map_err(|error| Failure::at(format!("cannot sync {}", path.display()), &error))?;
    }
    let path = path::spool_ack(&fetched.result);
    let job: Job = client.post(&path, &serde_json::json!({})).await?;
    fetched.acknowledged_at = job.acknowledged_at;
    fetched.acknowledged_by = job.acknowledged_by;
    Ok(())
}

/// Into a temporary name first, so that no file is ever half there.
async fn download(
    client: &Client,
    result: &str,
    name: &str,
    directory: &Path,
) -> Result<(), Failure> {
    if !is_plain(name) {
        return Err(Failure::Failed(format!(
            "the service names a file {name:?}, which is not safe"
        )));
    }
    let target = directory.join(name);
    let temporary = directory.join(format!(".{name}.part"));
    let failed =
        |error: std::io::Error| Failure::at(format!("cannot write {}", target.display()), &error);
    let done = async {
        let mut file = BufWriter::new(File::create(&temporary).map_err(failed)?);
        client
            .download::<Failure>(&path::spool_file(result, name), |bytes| {
                file.write_all(bytes).map_err(failed)
            })
            .await?;
        file.flush().map_err(failed)?;
        fs::rename(&temporary, &target).map_err(failed)
    }
    .await;
    if done.is_err() {
        // The first error is the one worth telling.
        let _ = fs::remove_file(&temporary);
    }
    done
}

/// Whether a name is that of a file in the directory itself, and not hidden.
fn is_plain(name: &str) -> bool {
    !(name.is_empty() || name.starts_with('.') || name.contains(['/', '\\', '\0']))
}

/// Checks every file against the manifest that came with it.
fn checked(directory: &Path) -> Result<Vec<deliverables::ManifestFile>, Failure> {
    let path = directory.join(MANIFEST_NAME);
    let text = fs::read(&path)
        .map_err(|error| Failure::at(format!("cannot read {}", path.display()), &error))?;
    let manifest: Manifest = serde_json::from_slice(&text)
        .map_err(|error| Failure::at(format!("{} is not a manifest", path.display()), &error))?;
    for listed in &manifest.files {
        if !is_plain(&listed.name) {
            return Err(Failure::Failed(format!(
                "the manifest names a file {:?}, which is not safe",
                listed.name
            )));
        }
        let path = directory.join(&listed.name);
        let found = File::open(&path)
            .and_then(deliverables::sha256_of)
            .map_err(|error| Failure::at(format!("cannot check {}", path.display()), &error))?;
        if found != listed.sha256 {
            return Err(Failure::Failed(format!(
                "{} is not what the manifest says (SHA-256 {found}, expected {}); fetch it again",
                path.display(),
                listed.sha256
            )));
        }
    }
    Ok(manifest.files)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn directory_with(content: &[u8], sha256: &str) -> tempfile::TempDir {
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join("house.igs"), content).unwrap();
        let manifest = serde_json::json!({
            "name": "house", "timestamp": "2026-11-21T09:30:00Z", "versions": {}, "seed": 1,
            "files": [{"name": "house.igs", "bytes": content.len(), "sha256": sha256}],
            "settings": {
                "method": "relief", "seed": 1, "pitch_mm": 0.4, "neighbours": 32, "draws": 32,
                "reach_columns": 8, "estimator": "least-median", "clusters": 20,
                "crease_angle_rad": 0.2, "step_factor": 1.0, "minimum_nodes": 50,
                "tolerance_mm": 0.01, "iges_entities": 114,
            },
        });
        fs::write(directory.path().join(MANIFEST_NAME), manifest.to_string()).unwrap();
        directory
    }

    #[test]
    fn files_are_held_against_their_manifest() {
        // SHA-256 of "abc": FIPS 180-2, appendix B.1.
        let sha256 = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        let good = directory_with(b"abc", sha256);
        assert_eq!(checked(good.path()).unwrap().len(), 1);
        let bad = directory_with(b"abd", sha256);
        let error = checked(bad.path()).unwrap_err().to_string();
        assert!(error.contains("is not what the manifest says"), "{error}");
    }

    #[test]
    fn names_that_lead_elsewhere_are_not_plain() {
        assert!(is_plain("house.igs") && is_plain("front cover 7.igs"));
        for name in ["", "..", "../x", "/etc/passwd", "a/b", ".hidden", "a\\b"] {
            assert!(!is_plain(name), "{name:?}");
        }
    }
}
