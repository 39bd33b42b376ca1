//! Three servers, of which one is killed.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use job_queue::jetstream::{JetStreamQueue, Options};
use relief_api::JobState;

use crate::bench::{key, order};
use crate::link::{insist, work};
use crate::server::{self, LIMIT, RUNTIME, free_port, options};
use job_queue::JobQueue;
use nats_child::Server;

const ORDERS: u64 = 60;

fn cluster() -> Option<(Vec<Arc<Server>>, Options)> {
    if !nats_child::is_wanted() {
        return None;
    }
    let routes = [(); 3].map(|()| free_port());
    let all: Vec<_> = routes
        .iter()
        .map(|port| format!("nats://127.0.0.1:{port}"))
        .collect();
    let servers: Vec<_> = routes
        .iter()
        .enumerate()
        .map(|(n, route)| {
            let lines = format!(
                "server_name: s{n}\ncluster {{ name: lab, listen: \"127.0.0.1:{route}\", routes: [{}] }}",
                all.join(", ")
            );
            server::on(free_port(), &lines)
        })
        .collect();
    let mut options = options("");
    options.servers = servers.iter().map(|server| server.url()).collect();
    options.replicas = 3;
    Some((servers, options))
}

/// Which server leads the stream of orders.
fn leader(options: &Options) -> Option<usize> {
    RUNTIME.block_on(async {
        let client = async_nats::connect(&options.servers).await.ok()?;
        let context = async_nats::jetstream::new(client);
        let name = format!("{}_JOBS", options.prefix.to_uppercase());
        let stream = context.get_stream(name).await.ok()?;
        let info = stream.get_info().await.ok()?;
        let leader = info.cluster?.leader?;
        leader.strip_prefix('s')?.parse().ok()
    })
}

fn connect(options: &Options) -> Arc<JetStreamQueue> {
    Arc::new(JetStreamQueue::new(options.clone(), RUNTIME.handle().clone()).unwrap())
}

/// The leader is killed while a bench offers and workers take and settle: nothing is lost, and
/// nothing is settled twice.
#[test]
fn a_killed_leader_is_followed() {
    let Some((servers, options)) = cluster() else {
        return;
    };
    let bench = connect(&options);
    insist(|| bench.offer(&order(1)));
    let begun = Instant::now();
    let leads = loop {
        if let Some(leads) = leader(&options) {
            break leads;
        }
        assert!(begun.elapsed() < LIMIT, "nobody leads");
    };
    let queues = [connect(&options), connect(&options)];
    let over = AtomicBool::new(false);
    let settled: u32 = thread::scope(|scope| {
        let workers: Vec<_> = queues
            .iter()
            .enumerate()
            .map(|(n, queue)| {
                let over = &over;
                scope.spawn(move || work(queue, &format!("w{n}"), over))
            })
            .collect();
        scope.spawn(|| {
            for job in 2..=ORDERS {
                insist(|| bench.offer(&order(job)));
            }
        });
        let standings = || insist(|| bench.standings(&key(1).bench));
        let done = |standings: &[(_, job_queue::Standing)]| {
            let done = standings.iter().filter(|(_, s)| s.state == JobState::Done);
            done.count() as u64
        };
        while done(&standings()) < ORDERS / 4 {
            assert!(begun.elapsed() < LIMIT, "{:?}", standings());
            thread::sleep(Duration::from_millis(5));
        }
        servers[leads].kill();
        let killed = Instant::now();
        while done(&standings()) < ORDERS {
            assert!(killed.elapsed() < LIMIT, "{:?}", standings());
            thread::sleep(Duration::from_millis(20));
        }
        over.store(true, Ordering::Relaxed);
        workers
            .into_iter()
            .map(|worker| worker.join().unwrap())
            .sum()
    });
    assert_eq!(u64::from(settled), ORDERS, "each is settled by one");
}
