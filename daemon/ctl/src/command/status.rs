//! `relief status`.

use relief_api::{LaserEntry, Scan, ScannerLink, ScannerStatus, Status, THE_SCANNER, path};

use crate::failure::Failure;
use crate::output::counted;
use crate::service::EndpointArgs;

/// Show the service, its scanners and what is under way
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    args.endpoint.show(path::STATUS, json, told).await
}

fn told(status: &Status) -> String {
    let mut lines = vec![format!(
        "service   reliefd {}, since {}",
        status.version, status.started_at
    )];
    if status.scanners.is_empty() {
        scanner(&mut lines, &status.scanner, &status.laser, &status.scan);
    }
    for one in &status.scanners {
        scanner(&mut lines, &one.status, &one.laser, &one.scan);
    }
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

/// Some lines on a scanner, its laser and its scan.
fn scanner(
    lines: &mut Vec<String>,
    scanner: &ScannerStatus,
    laser: &Option<Box<LaserEntry>>,
    scan: &Option<Scan>,
) {
    let link = match scanner.link {
        ScannerLink::Unknown => "not spoken to yet",
        ScannerLink::Ready => "ready",
        ScannerLink::Scanning => "scanning",
        ScannerLink::Trouble => "in trouble",
    };
    let name = match scanner.name.as_str() {
        "" | THE_SCANNER => String::new(),
        name => format!("{name}, "),
    };
    let model = scanner.model.as_deref().unwrap_or("unknown model");
    let serial = scanner
        .serial
        .as_ref()
        .map_or(String::new(), |serial| format!(" {serial}"));
    let endpoint = &scanner.endpoint;
    lines.push(format!(
        "scanner   {name}{link}: {model}{serial} at {endpoint}"
    ));
    if let Some(problem) = &scanner.problem {
        lines.push(format!("          {problem}"));
    }
    if let Some(calibration) = &scanner.calibration {
        let old = if calibration.overdue {
            "; it is old: calibrate anew"
        } else {
            ""
        };
        lines.push(format!(
            "          calibrated {}, {} ago, residual {:.4} mm{old}",
            calibration.date,
            counted(usize::try_from(calibration.age_days).unwrap_or(0), "day"),
            calibration.residual_mm
        ));
    }
    lines.push(match laser {
        Some(laser) => format!(
            "laser     {} since {}: {}",
            laser.laser.as_str(),
            laser.at,
            laser.cause
        ),
        None => "laser     not known yet".into(),
    });
    lines.push(match scan {
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
}

/// A size for people.
fn size(bytes: u64) -> String {
    match bytes {
        0..1_000_000_000 => format!("{:.1} MB", bytes as f64 * 1e-6),
        _ => format!("{:.1} GB", bytes as f64 * 1e-9),
    }
}
