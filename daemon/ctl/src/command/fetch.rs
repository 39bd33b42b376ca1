//! `relief fetch`.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use deliverables::{MANIFEST_NAME, Manifest};
use relief_api::{ScanList, SpoolEntry, path};
use serde::Serialize;

use crate::failure::Failure;
use crate::output;
use crate::service::{Client, EndpointArgs};

/// Copy the deliverables of a scan here and check them against their manifest
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The scan (or the result of a rerun), or `latest`
    #[arg(value_name = "SCAN")]
    scan: String,
    /// Directory for the files, instead of one named after the scan
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Fetched {
    result: String,
    directory: PathBuf,
    files: Vec<deliverables::ManifestFile>,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = Client::new(args.endpoint.endpoint());
    let result = if args.scan == "latest" {
        latest(&client).await?
    } else {
        args.scan
    };
    let entry: SpoolEntry = client.get(&path::spool(&result)).await?;
    let directory = args.output.unwrap_or_else(|| PathBuf::from(&entry.result));
    fs::create_dir_all(&directory)
        .map_err(|error| Failure::at(format!("cannot make {}", directory.display()), &error))?;
    for file in &entry.files {
        download(&client, &entry.result, &file.name, &directory).await?;
    }
    let files = checked(&directory)?;
    let fetched = Fetched {
        result: entry.result,
        directory,
        files,
    };
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

async fn latest(client: &Client) -> Result<String, Failure> {
    let list: ScanList = client.get(path::SCANS).await?;
    let newest = list.scans.into_iter().next();
    newest
        .map(|scan| scan.id)
        .ok_or_else(|| Failure::Failed("there is no scan yet".into()))
}

/// Into a temporary name first, so that no file is ever half there.
async fn download(
    client: &Client,
    result: &str,
    name: &str,
    directory: &Path,
) -> Result<(), Failure> {
    if name.is_empty() || name.starts_with('.') || name.contains(['/', '\\', '\0']) {
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

/// Checks every file against the manifest that came with it.
fn checked(directory: &Path) -> Result<Vec<deliverables::ManifestFile>, Failure> {
    let path = directory.join(MANIFEST_NAME);
    let text = fs::read(&path)
        .map_err(|error| Failure::at(format!("cannot read {}", path.display()), &error))?;
    let manifest: Manifest = serde_json::from_slice(&text)
        .map_err(|error| Failure::at(format!("{} is not a manifest", path.display()), &error))?;
    for listed in &manifest.files {
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
