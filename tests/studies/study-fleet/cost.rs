//! What the queue and its object store cost by themselves.

use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use job_queue::depot::Kind;
use job_queue::jetstream::{JetStreamQueue, Options};
use job_queue::{
    BenchName, Ending, FORMAT, JobKey, JobQueue, Need, Order, Outcome, Priority, Worker,
};
use serde_json::Value;
use tokio::runtime::Handle;

use crate::cluster::{Cluster, urls};

const GUARD: Duration = Duration::from_secs(60);
const JOBS: u64 = 200;
/// Before it is measured: consumers and buckets are made by the first.
const WARM: u64 = 10;
const DEPOT_BYTES: usize = 64 << 20;

/// Offers, takes and settles jobs that do nothing, and puts and fetches bytes that cannot be packed.
pub(crate) async fn measure() -> Result<()> {
    let handle = Handle::current();
    tokio::task::spawn_blocking(move || run(handle)).await?
}

fn run(handle: Handle) -> Result<()> {
    let cluster = Cluster::start(1)?;
    let queue = JetStreamQueue::new(Options::new(urls(&cluster.ports())), handle)?;
    queue.wait_connected(GUARD)?;
    let bench = BenchName::try_from("bench-1".to_owned())?;
    let worker = Worker::named("hand-1");
    let done = Outcome {
        ending: Ending::Done {
            result: Value::Null,
            left_out: Vec::new(),
        },
        timings: Vec::new(),
    };
    let mut steps: [Vec<Duration>; 4] = Default::default();
    for job in 1..=WARM + JOBS {
        let order = Order {
            format: FORMAT,
            key: JobKey {
                bench: bench.clone(),
                job,
            },
            turn: 1,
            priority: Priority::Normal,
            need: Need::default(),
            body: Value::Null,
        };
        let begun = Instant::now();
        queue.offer(&order)?;
        let offered = Instant::now();
        let mut lease = queue.take(&worker, GUARD)?.context("no order came")?;
        let taken = Instant::now();
        lease.settle(&done)?;
        let settled = Instant::now();
        if job > WARM {
            steps[0].push(offered - begun);
            steps[1].push(taken - offered);
            steps[2].push(settled - taken);
            steps[3].push(settled - begun);
        }
    }
    let [offer, take, settle, all] = steps.map(median_ms);
    println!(
        "a job of {JOBS} that do nothing, median: offer {offer:.2} ms, take {take:.2} ms, settle \
         {settle:.2} ms, all {all:.2} ms"
    );
    let depot = queue.depot();
    let bytes = noise(DEPOT_BYTES);
    let begun = Instant::now();
    let parcel = depot.put(&bench, Kind::Result, &mut bytes.as_slice())?;
    let put = begun.elapsed().as_secs_f64();
    let begun = Instant::now();
    let mut fetched = Vec::with_capacity(bytes.len());
    depot.fetch(&bench, Kind::Result, &parcel, &mut fetched)?;
    let got = begun.elapsed().as_secs_f64();
    anyhow::ensure!(fetched == bytes, "what is fetched is not what was put");
    let mb = bytes.len() as f64 / 1e6;
    println!(
        "{mb:.0} MB that cannot be packed: put at {:.0} MB/s, fetched at {:.0} MB/s",
        mb / put,
        mb / got
    );
    Ok(())
}

fn median_ms(mut times: Vec<Duration>) -> f64 {
    times.sort();
    times[times.len() / 2].as_secs_f64() * 1e3
}

/// Bytes in which no packer finds anything.
fn noise(count: usize) -> Vec<u8> {
    let mut state = 1_u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 56) as u8
    };
    (0..count).map(|_| next()).collect()
}
