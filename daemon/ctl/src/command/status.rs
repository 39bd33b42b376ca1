//! `relief status`.

use relief_api::{ScannerLink, Status, path};

use crate::failure::Failure;
use crate::output::counted;
use crate::service::EndpointArgs;

/// Show the service, its scanner and what is under way
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    args.endpoint.show(path::STATUS, json, told).await
}

fn told(status: &Status) -> String {
    let scanner = &status.scanner;
    let link = match scanner.link {
        ScannerLink::Unknown => "not spoken to yet",
        ScannerLink::Ready => "ready",
        ScannerLink::Scanning => "scanning",
        ScannerLink::Trouble => "in trouble",
    };
    let model = scanner.model.as_deref().unwrap_or("unknown model");
    let serial = scanner
        .serial
        .as_ref()
        .map_or(String::new(), |serial| format!(" {serial}"));
    let mut lines = vec![
        format!(
            "service   reliefd {}, since {}",
            status.version, status.started_at
        ),
        format!("scanner   {link}: {model}{serial} at {}", scanner.endpoint),
    ];
    if let Some(problem) = &scanner.problem {
        lines.push(format!("          {problem}"));
    }
    lines.push(match &status.laser {
        Some(laser) => format!(
            "laser     {} since {}: {}",
            laser.laser.as_str(),
            laser.at,
            laser.cause
        ),
        None => "laser     not known yet".into(),
    });
    lines.push(match &status.scan {
        Some(scan) => format!(
            "scan      {} ({}): {}, {} of {} columns",
            scan.id,
            scan.name,
            scan.state.as_str(),
            scan.columns,
            scan.columns_planned
        ),
        None => "scan      none".into(),
    });
    lines.push(format!(
        "jobs      {} running, {} waiting",
        status.jobs_running,
        counted(status.jobs_queued, "job")
    ));
    lines.push(format!("spool     {}", status.spool));
    if let Some(storage) = &status.storage {
        let least = [storage.scans_free_bytes, storage.results_free_bytes]
            .into_iter()
            .flatten()
            .min();
        lines.push(format!(
            "storage   scans {}, results {}; {} free",
            size(storage.scans_bytes),
            size(storage.results_bytes),
            least.map_or_else(|| "unknown room".into(), size),
        ));
    }
    lines.join("\n")
}

/// A size for people.
fn size(bytes: u64) -> String {
    match bytes {
        0..1_000_000_000 => format!("{:.1} MB", bytes as f64 * 1e-6),
        _ => format!("{:.1} GB", bytes as f64 * 1e-9),
    }
}
