//! `relief doctor`: looks for the usual troubles and says how to mend each.

mod disk;
mod finding;
mod machine;
mod port;
mod reach;
mod rules;
mod servers;
mod usb;

use std::path::{Path, PathBuf};

use jiff::Timestamp;
use reliefd::Config;
use reliefd::config::{ScannerConfig, Transport};
use serde::Serialize;

use crate::failure::Failure;
use crate::output::{self, counted};
use crate::service::EndpointArgs;
use finding::{Finding, Grade};

/// Look for the usual troubles and say how to mend each
///
/// Checks the configuration, each scanner's port or USB device (there, permitted, not held by
/// somebody else), the udev rules, programs that disturb serial ports, the folders and their
/// disk, the clock, whether the service answers, and whether it reaches the NATS servers that it is
/// to use; lists the serial ports and USB scanners
/// that are there. Changes nothing.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The service's configuration [default: /etc/relief/reliefd.toml]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

/// Where the package keeps the configuration.
const PACKAGED: &str = "/etc/relief/reliefd.toml";

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// What is to be said of a port or device that nobody seems to have open: only root sees what
/// other users' programs have.
fn free() -> &'static str {
    if rustix::process::geteuid().is_root() {
        "free"
    } else {
        "in the hands of none of this user's programs (as root, the doctor sees everybody's)"
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Told {
    version: &'static str,
    healthy: bool,
    findings: Vec<Finding>,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let mut findings = vec![Finding::good("version", VERSION)];
    let path = args.config.as_deref().unwrap_or(Path::new(PACKAGED));
    let config = match Config::load(path) {
        Ok(config) => {
            let said = format!("{} is sound", path.display());
            findings.push(Finding::good("configuration", said));
            config
        }
        // On a machine without the package that is no trouble in itself.
        Err(_) if args.config.is_none() && !path.exists() => {
            findings.push(Finding::doubtful(
                "configuration",
                format!("there is no {PACKAGED}; the checks below take the defaults"),
                "name the configuration that reliefd runs with by --config, or install one there",
            ));
            Config::default()
        }
        Err(error) => {
            findings.push(Finding::bad(
                "configuration",
                format!("{error}; the checks below take the defaults"),
                "mend the file at the place named (`relief config check` looks at it again), or \
                 name another with --config",
            ));
            Config::default()
        }
    };
    for named in config.each_scanner() {
        let found = scanner(named.config).into_iter();
        findings.extend(found.map(|finding| finding.of(&named)));
        let found = calibration(named.config).into_iter();
        findings.extend(found.map(|finding| finding.of(&named)));
    }
    findings.push(port::present());
    findings.push(usb::present());
    findings.extend(machine::disturbers());
    let reserve_bytes = config.storage.reserve_bytes();
    findings.push(disk::check(
        "kept scans",
        "service.state_dir",
        &config.service.state_dir,
        reserve_bytes,
    ));
    findings.push(disk::check(
        "spool",
        "service.spool_dir",
        &config.service.spool_dir,
        reserve_bytes,
    ));
    findings.push(machine::clock());
    let endpoint = args.endpoint.endpoint()?;
    findings.push(reach::check(endpoint.clone()).await);
    findings.extend(servers::check(endpoint, &config.nats).await);

    let bad = findings
        .iter()
        .filter(|finding| finding.grade == Grade::Bad)
        .count();
    let told = Told {
        version: VERSION,
        healthy: bad == 0,
        findings,
    };
    output::either(json, &told, |told| {
        told.findings
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join("\n")
    })?;
    if bad == 0 {
        Ok(())
    } else {
        Err(Failure::Failed(format!(
            "{} found; each says how to mend it",
            counted(bad, "trouble")
        )))
    }
}

/// The calibration that is named, and how old it is.
fn calibration(config: &ScannerConfig) -> Option<Finding> {
    let own = config.in_force.as_ref()?;
    let now = Timestamp::now();
    Some(match own.overdue(now) {
        None => Finding::good(
            "calibration",
            format!(
                "of {}, {} ago, for {} {}",
                own.file.date,
                counted(usize::try_from(own.file.age_days(now)).unwrap_or(0), "day"),
                own.file.scanner_model,
                own.file.scanner_serial
            ),
        ),
        Some(told) => Finding::doubtful(
            "calibration",
            told,
            "scan the reference sphere, run relief calibrate, and name its file as `calibration`",
        ),
    })
}

/// The way to the scanner, by its kind.
fn scanner(config: &ScannerConfig) -> Vec<Finding> {
    match config.transport {
        Transport::Serial => {
            let mut findings = port::check(&config.port);
            if let Some((vendor_id, product_id)) = port::usb_numbers(&config.port) {
                findings.push(rules::check(vendor_id, product_id));
            }
            findings
        }
        Transport::Usb => {
            let mut findings = usb::check(&config.usb());
            findings.push(rules::check(config.vendor_id, config.product_id));
            findings
        }
    }
}
