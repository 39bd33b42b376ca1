//! `relief fleet`.

use relief_api::{Fleet, path};

use crate::failure::Failure;
use crate::output;
use crate::service::EndpointArgs;

/// Show the workers elsewhere, the benches, and the jobs that wait for them
///
/// Where the service's configuration names NATS servers ([nats]), jobs go to workers on other
/// machines: see `relief worker`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    endpoint: EndpointArgs,
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    args.endpoint.show(path::FLEET, json, told).await
}

fn told(fleet: &Fleet) -> String {
    if !fleet.is_used {
        return "all jobs are done by this service: no servers are named in [nats] of its \
                configuration"
            .into();
    }
    let servers = fleet.servers.join(", ");
    let mut told = match fleet.away_s {
        None => format!("{} is connected with {servers}", fleet.bench),
        Some(seconds) => format!("{} has not reached {servers} for {seconds} s", fleet.bench),
    };
    if let Some(problem) = &fleet.problem {
        told += &format!("\nproblem: {problem}");
    }
    told += &format!(
        "\n{} of its jobs handed over, {} at most",
        fleet.handed_over, fleet.most_handed_over
    );
    if let Some(jobs) = &fleet.jobs {
        told += &format!(
            "\njobs of all benches: {} wait ({} high, {} normal, {} low), {} run",
            jobs.waiting(),
            jobs.waiting_high,
            jobs.waiting_normal,
            jobs.waiting_low,
            jobs.running
        );
        if let Some(seconds) = jobs.oldest_s {
            told += &format!(", the oldest has waited for {seconds:.0} s");
        }
    }
    let workers = fleet.workers.iter().map(|worker| {
        vec![
            worker.name.clone(),
            worker.version.clone(),
            worker.threads.to_string(),
            worker
                .memory_mib
                .map_or_else(String::new, |mib| mib.to_string()),
            worker.tools.join(", "),
            worker.busy_with.clone().unwrap_or_else(|| "idle".into()),
        ]
    });
    told += "\n\n";
    if fleet.workers.is_empty() {
        told += "no workers are there: start one with `relief worker`";
    } else {
        let heads = ["WORKER", "VERSION", "THREADS", "MEMORY/MIB", "TOOLS", "AT"];
        told += &output::table(&heads, &[2, 3], workers);
    }
    let benches = fleet.benches.iter().map(|bench| {
        vec![
            bench.name.clone(),
            bench.version.clone(),
            bench.waiting.to_string(),
        ]
    });
    told + "\n\n" + &output::table(&["BENCH", "VERSION", "WAITING THERE"], &[2], benches)
}
