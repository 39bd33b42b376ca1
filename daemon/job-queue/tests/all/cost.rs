//! What the queue itself costs. Run by hand: `cargo test --release -p job-queue -- --ignored
//! --nocapture cost`.

use std::time::{Duration, Instant};

use job_queue::JobQueue;
use job_queue::depot::Kind;

use crate::bench::{done, key, order, take};
use crate::server::{RUNTIME, Server, connect, options};

fn median(mut times: Vec<Duration>) -> f64 {
    times.sort();
    times[times.len() / 2].as_secs_f64() * 1e3
}

#[test]
#[ignore = "measures"]
fn cost() {
    let Some(server) = Server::start() else {
        return;
    };
    let options = options(&server.url());
    let queue = connect(&options);
    let mut times = [Vec::new(), Vec::new(), Vec::new(), Vec::new()];
    let written = || {
        RUNTIME.block_on(async {
            let client = async_nats::connect(server.url()).await.unwrap();
            let context = async_nats::jetstream::new(client);
            let mut last = Vec::new();
            for name in [
                format!("{}_JOBS", options.prefix.to_uppercase()),
                format!("KV_{}-jobs", options.prefix),
            ] {
                let stream = context.get_stream(name).await.unwrap();
                last.push(stream.get_info().await.unwrap().state.last_sequence);
            }
            last
        })
    };
    for job in 1..=210 {
        let begun = Instant::now();
        queue.offer(&order(job)).unwrap();
        let offered = Instant::now();
        let mut lease = take(&queue, "w");
        let taken = Instant::now();
        lease.settle(&done()).unwrap();
        let settled = Instant::now();
        if job > 10 {
            times[0].push(offered - begun);
            times[1].push(taken - offered);
            times[2].push(settled - taken);
            times[3].push(settled - begun);
        }
    }
    let [offer, take, settle, all] = times.map(median);
    println!("offer {offer:.2} ms, take {take:.2} ms, settle {settle:.2} ms, all {all:.2} ms");
    println!(
        "messages and standings written in 210 jobs: {:?}",
        written()
    );
    let depot = queue.depot();
    let mut state = 1_u64;
    let bytes: Vec<u8> = (0..64 << 20)
        .map(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 56) as u8
        })
        .collect();
    let bench = key(1).bench;
    let begun = Instant::now();
    let parcel = depot
        .put(&bench, Kind::Result, &mut bytes.as_slice())
        .unwrap();
    let put = begun.elapsed().as_secs_f64();
    let begun = Instant::now();
    let mut fetched = Vec::with_capacity(bytes.len());
    depot
        .fetch(&bench, Kind::Result, &parcel, &mut fetched)
        .unwrap();
    let got = begun.elapsed().as_secs_f64();
    assert!(fetched == bytes);
    let mb = bytes.len() as f64 / 1e6;
    println!("put {:.0} MB/s, fetch {:.0} MB/s", mb / put, mb / got);
}
