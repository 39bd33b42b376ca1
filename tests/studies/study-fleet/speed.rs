//! How much faster two workers are than one, and how soon one has its first job.

use std::time::Instant;

use anyhow::Result;

use crate::bench::Bench;
use crate::cluster::{Cluster, urls};
use crate::workers::Hire;
use crate::{Options, SILENCE_S, order};

/// Rounds, one worker and two in turn: machines are not always as fast.
const ROUNDS: usize = 3;

pub(crate) async fn measure(options: &Options) -> Result<()> {
    let folder = tempfile::Builder::new().prefix("fleet-").tempdir()?;
    let mut bench = Bench::alone(&options.program("reliefd")?, folder.path()).await?;
    let scans = bench.take(options.scans).await?;
    let cluster = Cluster::start(1)?;
    let servers = urls(&cluster.ports());
    bench.join(&servers, 1, SILENCE_S).await?;
    let hire = Hire {
        program: options.program("relief")?,
        servers,
        folder: folder.path().to_owned(),
        silence_s: SILENCE_S,
    };
    let mut ratios = Vec::new();
    for round in 1..=ROUNDS {
        let mut seconds = Vec::new();
        for workers in [1, 2] {
            order(&bench, &scans, options.jobs).await?;
            let started = Instant::now();
            let following = bench.follow(options.jobs);
            let hired: Vec<_> = (1..=workers)
                .map(|number| hire.start(&format!("hand-{number}")))
                .collect::<Result<_>>()?;
            let (first, last) = following.await?;
            drop(hired);
            let took = (last - first).as_secs_f64();
            println!(
                "round {round}: {} jobs, {workers} worker{}: {took:.2} s, the first begun {:.2} s \
                 after the start of the program",
                options.jobs,
                if workers == 1 { "" } else { "s" },
                (first - started).as_secs_f64()
            );
            seconds.push(took);
        }
        ratios.push(seconds[0] / seconds[1]);
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "two workers are {:.2} times as fast as one",
        ratios[ROUNDS / 2]
    );
    Ok(())
}
