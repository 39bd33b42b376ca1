//! `relief rerun`.

use std::path::PathBuf;

use deliverables::features::read_edits;
use relief_api::{Job, Priority, Rerun, path};

use super::named;
use super::part::PartArgs;
use super::priority;
use super::regularize::RegularizeArgs;
use super::setting::{self, Setting};
use crate::failure::Failure;
use crate::follow;
use crate::output;
use crate::service::EndpointArgs;

/// Process a kept scan again, with other settings if wanted
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The scan, as `relief scans` lists it, or its name (of several the newest), or `latest`
    #[arg(value_name = "SCAN")]
    scan: String,
    /// A setting that differs, keyed as in the configuration, such as regrid.neighbours=25;
    /// may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = setting::parse)]
    settings: Vec<Setting>,
    /// Recognise machining features, and change types, dimensions and directions that you know
    /// better, by a file as `relief features --edit` reads it; solid and picture follow
    #[arg(long, value_name = "EDITS.toml")]
    edit: Option<PathBuf>,
    /// Name of the new deliverables, instead of the scan's name
    #[arg(
        long,
        value_name = "NAME",
        default_value = "",
        hide_default_value = true
    )]
    name: String,
    /// Whether it goes before other jobs that wait, or after them: high, normal or low
    #[arg(long, value_name = "PRIORITY", default_value = "normal", value_parser = priority::parse)]
    priority: Priority,
    /// Stay until the deliverables are published
    #[arg(long)]
    wait: bool,
    #[command(flatten)]
    regularize: RegularizeArgs,
    #[command(flatten)]
    processed: PartArgs,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = args.endpoint.client()?;
    let events = if args.wait {
        Some(client.events().await?)
    } else {
        None
    };
    let mut settings = setting::overrides(args.settings)?;
    args.regularize.add_to(&mut settings);
    args.processed.add_to(&mut settings);
    if let Some(path) = &args.edit {
        let edits = read_edits(path).map_err(|error| Failure::Failed(error.to_string()))?;
        let edits =
            serde_json::to_value(edits).map_err(|error| Failure::Failed(error.to_string()))?;
        settings.insert("deliverables.features".to_owned(), true.into());
        settings.insert("deliverables.edit".to_owned(), edits);
    }
    let request = Rerun {
        name: args.name,
        priority: args.priority,
        settings,
    };
    let scan = named::scan_id(&client, args.scan).await?;
    let mut job: Job = client.post(&path::scan_rerun(&scan), &request).await?;
    if let Some(events) = events {
        job = follow::job(&client, events, job.id).await?;
    }
    output::either(json, &job, |job| match &job.directory {
        Some(directory) => directory.clone(),
        None => format!(
            "job {} of scan {}: {}",
            job.id,
            job.scan,
            job.state.as_str()
        ),
    })
}
