//! `relief scans`.

use relief_api::{ScanList, path};

use crate::failure::Failure;
use crate::output::of_scanners;
use crate::service::EndpointArgs;

/// List the kept scans, newest first
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    args.endpoint.show(path::SCANS, json, told).await
}

fn told(list: &ScanList) -> String {
    if list.scans.is_empty() {
        return "no scans yet".into();
    }
    let lines = list.scans.iter().map(|scan| {
        let state = match &scan.reason {
            Some(reason) => format!("{}: {reason}", scan.state.as_str()),
            None => scan.state.as_str().to_owned(),
        };
        let jobs: Vec<String> = scan.jobs.iter().map(u64::to_string).collect();
        (
            scan.scanner.as_str(),
            vec![
                scan.id.clone(),
                scan.name.clone(),
                scan.part.clone(),
                format!("{}/{}", scan.columns, scan.columns_planned),
                jobs.join(" "),
                state,
            ],
        )
    });
    of_scanners(
        &["SCAN", "NAME", "PART", "COLUMNS", "JOBS", "STATE"],
        1,
        &[3],
        lines,
    )
}
