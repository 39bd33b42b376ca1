//! `relief uploads`.

use relief_api::{UploadList, UploadRuns, path};

use super::runs;
use crate::failure::Failure;
use crate::output;
use crate::service::EndpointArgs;

/// Show where copies of results go, what became of them, and try it
///
/// An upload is a section [[uploads]] of the service's configuration: a folder such as a mounted
/// share, an object store (S3), or a folder of another machine (SFTP), where a copy of each result
/// goes. Without a further word, all of them are listed with what was last tried.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Args {
    #[command(subcommand)]
    action: Option<Action>,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    /// Show the results that are still to be copied, and the latest copies, with every attempt
    Log {
        /// The upload
        name: String,
        #[command(flatten)]
        endpoint: EndpointArgs,
    },
    /// Copy the newest result, within 25 s, and show what comes of it
    Test {
        /// The upload
        name: String,
        #[command(flatten)]
        endpoint: EndpointArgs,
    },
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    match args.action {
        None => args.endpoint.show(path::UPLOADS, json, list).await,
        Some(Action::Log { name, endpoint }) => {
            let log = |list: &UploadRuns| runs::log(&list.runs, "nothing was copied yet");
            endpoint.show(&path::upload_runs(&name), json, log).await
        }
        Some(Action::Test { name, endpoint }) => {
            runs::test(&path::upload_test(&name), &name, &endpoint, json).await
        }
    }
}

fn list(list: &UploadList) -> String {
    if list.uploads.is_empty() {
        return "there are no uploads: each is a section [[uploads]] of the configuration".into();
    }
    let lines = list.uploads.iter().map(|upload| {
        vec![
            upload.name.clone(),
            upload.to.clone(),
            upload.waiting.to_string(),
            runs::latest(upload.latest.as_ref(), "nothing copied yet"),
        ]
    });
    output::table(&["UPLOAD", "TO", "WAITING", "LATEST"], &[2], lines)
}
