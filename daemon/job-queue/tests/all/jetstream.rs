//! The queue on JetStream is a queue.

use std::sync::Arc;
use std::time::Duration;

use job_queue::conformance::{CASES, Setting};
use job_queue::jetstream::{JetStreamQueue, Options};
use job_queue::{BenchName, JobKey, JobQueue, Lease};

use crate::server::{self, LIMIT, connect, options};
use nats_child::Server;

struct OnJetStream {
    server: Arc<Server>,
    options: Options,
    queue: Arc<JetStreamQueue>,
    bench: BenchName,
}

impl OnJetStream {
    fn new(server: Arc<Server>) -> Self {
        let options = options(&server.url());
        let queue = connect(&options);
        Self {
            server,
            options,
            queue,
            bench: BenchName::try_from("lab-1".to_owned()).unwrap(),
        }
    }
}

impl Setting for OnJetStream {
    fn queue(&self) -> Arc<dyn JobQueue> {
        self.queue.clone()
    }

    fn key(&self, n: u64) -> JobKey {
        JobKey {
            bench: self.bench.clone(),
            job: n,
        }
    }

    fn worker_dies(&mut self, lease: Box<dyn Lease>) {
        drop(lease);
    }

    fn restart(&mut self) {
        self.server.kill();
        while self.queue.is_connected() {
            std::thread::sleep(Duration::from_millis(5));
        }
        self.server.start().unwrap();
        self.queue.wait_connected(LIMIT).unwrap();
    }

    fn believed_dead(&self) -> Option<Arc<dyn JobQueue>> {
        let mut options = self.options.clone();
        options.silence = Duration::ZERO;
        Some(connect(&options))
    }

    fn deadline(&self) -> Option<Duration> {
        Some(self.options.ack_wait)
    }
}

fn conforms(name: &str) {
    let case = CASES.iter().find(|case| case.name == name).unwrap();
    let server = if case.restarts {
        server::start()
    } else {
        server::shared()
    };
    if let Some(server) = server {
        (case.run)(&mut OnJetStream::new(server));
    }
}

macro_rules! cases {
    ($($name:ident),* $(,)?) => {
        $(#[test]
        fn $name() {
            conforms(stringify!($name));
        })*

        #[test]
        fn every_case_is_run() {
            let run = [$(stringify!($name)),*];
            for case in CASES {
                assert!(run.contains(&case.name), "{} is not run", case.name);
            }
        }
    };
}

cases!(
    taken_once_among_many,
    priority_then_age,
    same_turn_is_one,
    idle_worker_is_woken,
    done_stays_done_across_restart,
    failed_waits_for_a_turn,
    given_back_is_no_attempt,
    dead_worker_is_followed,
    three_deaths_are_enough,
    cancelled_while_waiting,
    cancelled_while_running,
    cancelled_too_late,
    done_though_cancelled,
    cancelled_while_taken,
    alive_beyond_deadline,
    late_settle_counts_once,
    waiting_survives_restart_in_order,
    needs_are_respected,
    formats_are_respected,
    each_of_many_settled_once,
);
