//! The network between.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use job_queue::depot::Kind;
use job_queue::jetstream::JetStreamQueue;
use job_queue::{JobQueue, QueueError, Worker};
use nats_child::Server;
use relief_api::JobState;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;

use crate::bench::{done, key, order};
use crate::server::{self, LIMIT, RUNTIME, connect, options};

/// Passes bytes on, unless it is cut.
struct Cable {
    port: u16,
    whole: Arc<watch::Sender<bool>>,
}

impl Cable {
    fn to(port: u16) -> Self {
        let whole = Arc::new(watch::Sender::new(true));
        let listener = RUNTIME.block_on(TcpListener::bind("127.0.0.1:0")).unwrap();
        let here = listener.local_addr().unwrap().port();
        let state = Arc::clone(&whole);
        RUNTIME.spawn(async move {
            while let Ok((mut near, _)) = listener.accept().await {
                let mut state = state.subscribe();
                if !*state.borrow() {
                    continue;
                }
                tokio::spawn(async move {
                    let mut far = TcpStream::connect(("127.0.0.1", port)).await.unwrap();
                    tokio::select! {
                        _ = tokio::io::copy_bidirectional(&mut near, &mut far) => {}
                        _ = state.wait_for(|whole| !whole) => {}
                    }
                });
            }
        });
        Self { port: here, whole }
    }

    fn url(&self) -> String {
        format!("nats://127.0.0.1:{}", self.port)
    }

    fn cut(&self) {
        self.whole.send_replace(false);
    }

    fn mend(&self) {
        self.whole.send_replace(true);
    }
}

/// Does it again until the network is there.
pub(crate) fn insist<T>(mut what: impl FnMut() -> Result<T, QueueError>) -> T {
    let begun = Instant::now();
    loop {
        match what() {
            Ok(done) => return done,
            Err(QueueError::Away(why)) => assert!(begun.elapsed() < LIMIT, "{why}"),
            Err(error) => unreachable!("{error}"),
        }
        thread::sleep(Duration::from_millis(20));
    }
}

pub(crate) fn work(queue: &JetStreamQueue, name: &str, over: &AtomicBool) -> u32 {
    let mut settled = 0;
    while !over.load(Ordering::Relaxed) {
        let taken = queue.take(&Worker::named(name), Duration::from_millis(100));
        let Ok(Some(mut lease)) = taken else {
            thread::sleep(Duration::from_millis(20));
            continue;
        };
        // Long enough for the cable to be cut meanwhile.
        thread::sleep(Duration::from_millis(20));
        let begun = Instant::now();
        loop {
            match lease.settle(&done()) {
                Ok(standing) => {
                    settled += u32::from(standing.worker.as_deref() == Some(name));
                    break;
                }
                Err(QueueError::Away(why)) => assert!(begun.elapsed() < LIMIT, "{why}"),
                // Another worker was given it meanwhile.
                Err(QueueError::Lost(_)) => break,
                Err(error) => unreachable!("{error}"),
            }
            thread::sleep(Duration::from_millis(20));
        }
    }
    settled
}

/// A cable is cut and mended while a bench offers, and others while workers work: nothing is lost,
/// and nothing is settled twice.
#[test]
fn what_a_cut_cable_interrupts_goes_on() {
    const ORDERS: u64 = 60;
    let Some(server) = server::shared() else {
        return;
    };
    let options = options(&server.url());
    let judge = connect(&options);
    let cables: Vec<_> = (0..3).map(|_| Cable::to(server.port())).collect();
    let queues: Vec<_> = cables
        .iter()
        .map(|cable| {
            let mut options = options.clone();
            options.servers = vec![cable.url()];
            connect(&options)
        })
        .collect();
    let over = AtomicBool::new(false);
    let settled: u32 = thread::scope(|scope| {
        let workers: Vec<_> = [1, 2]
            .map(|n| {
                let (queue, over) = (&queues[n], &over);
                scope.spawn(move || work(queue, &format!("w{n}"), over))
            })
            .into();
        scope.spawn(|| {
            for job in 1..=ORDERS {
                insist(|| queues[0].offer(&order(job)));
            }
        });
        for round in 0..6 {
            thread::sleep(Duration::from_millis(150));
            let cable = &cables[round % cables.len()];
            cable.cut();
            thread::sleep(Duration::from_millis(250));
            cable.mend();
        }
        let begun = Instant::now();
        let bench = key(1).bench;
        loop {
            let standings = judge.standings(&bench).unwrap();
            let done = |state: JobState| state == JobState::Done;
            if standings.len() as u64 == ORDERS && standings.iter().all(|(_, s)| done(s.state)) {
                break;
            }
            assert!(begun.elapsed() < LIMIT, "{standings:?}");
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

/// A queue that is connected by a cable.
fn by_cable() -> Option<(Arc<Server>, Cable, Arc<JetStreamQueue>)> {
    let server = server::shared()?;
    let mut options = options(&server.url());
    let cable = Cable::to(server.port());
    options.servers = vec![cable.url()];
    let queue = connect(&options);
    Some((server, cable, queue))
}

#[test]
fn bytes_go_on_where_a_cable_was_cut() {
    let Some((_server, cable, queue)) = by_cable() else {
        return;
    };
    let depot = queue.depot();
    let bench = key(1).bench;
    let bytes: Vec<u8> = (0..12_u32 << 20)
        .map(|n| (n.wrapping_mul(n) >> 7) as u8)
        .collect();
    let cut = |after_ms| {
        thread::sleep(Duration::from_millis(after_ms));
        cable.cut();
        thread::sleep(Duration::from_millis(200));
        cable.mend();
    };
    thread::scope(|scope| {
        scope.spawn(|| cut(20));
        let parcel = insist(|| depot.put(&bench, Kind::Journal, &mut bytes.as_slice()));
        scope.spawn(|| cut(20));
        let fetched = insist(|| {
            let mut to = Vec::new();
            depot.fetch(&bench, Kind::Journal, &parcel, &mut to)?;
            Ok(to)
        });
        assert!(fetched == bytes);
    });
}

/// Calls do not wait for a network that is not there.
#[test]
fn what_is_away_is_told_at_once() {
    let Some((_server, cable, queue)) = by_cable() else {
        return;
    };
    thread::scope(|scope| {
        let waits = scope.spawn(|| {
            queue
                .take(&Worker::named("w"), LIMIT)
                .map(|taken| taken.is_some())
        });
        thread::sleep(Duration::from_millis(50));
        let begun = Instant::now();
        cable.cut();
        let told = waits.join().unwrap();
        assert!(matches!(told, Err(QueueError::Away(_))), "{told:?}");
        assert!(begun.elapsed() < LIMIT / 2);
    });
    let begun = Instant::now();
    for _ in 0..100 {
        let away = queue.standing(&key(1)).unwrap_err();
        assert!(matches!(away, QueueError::Away(_)), "{away}");
    }
    assert!(begun.elapsed() < LIMIT / 2);
    cable.mend();
    insist(|| queue.standing(&key(1)));
}
