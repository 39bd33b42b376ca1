//! Permissions of each role suffice for it, and keep it from what is another's.

use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

use job_queue::depot::Kind;
use job_queue::jetstream::{JetStreamQueue, Login, Node, Options, Role, Secret};
use job_queue::{BenchName, JobQueue, QueueError, Worker};

use crate::bench::{done, key, order};
use crate::server::{self, LIMIT, connect, options};
use nats_child::Server;

/// What each role may publish; all listen on their own inbox. `{p}` is the prefix, `{P}` the same
/// in capitals.
const BENCH: &[&str] = &[
    "$JS.API.STREAM.INFO.{P}_JOBS",
    "$JS.API.STREAM.CREATE.{P}_JOBS",
    "$JS.API.STREAM.PURGE.{P}_JOBS",
    "$JS.API.STREAM.MSG.GET.{P}_JOBS",
    "$JS.API.CONSUMER.INFO.{P}_JOBS.*",
    "$JS.API.CONSUMER.CREATE.{P}_JOBS.>",
    "$JS.API.CONSUMER.LIST.{P}_JOBS",
    "$JS.API.STREAM.INFO.KV_{p}-jobs",
    "$JS.API.STREAM.CREATE.KV_{p}-jobs",
    "$JS.API.STREAM.PURGE.KV_{p}-jobs",
    "$JS.API.STREAM.MSG.GET.KV_{p}-jobs",
    "$JS.API.CONSUMER.CREATE.KV_{p}-jobs",
    "$JS.API.STREAM.INFO.KV_{p}-nodes",
    "$JS.API.STREAM.CREATE.KV_{p}-nodes",
    "$JS.API.STREAM.MSG.GET.KV_{p}-nodes",
    "$JS.API.STREAM.INFO.OBJ_{p}-lab-1",
    "$JS.API.STREAM.CREATE.OBJ_{p}-lab-1",
    "$JS.API.STREAM.PURGE.OBJ_{p}-lab-1",
    "$JS.API.STREAM.MSG.GET.OBJ_{p}-lab-1",
    "$JS.API.DIRECT.GET.OBJ_{p}-lab-1",
    "$JS.API.DIRECT.GET.OBJ_{p}-lab-1.>",
    "$JS.FC.>",
    "{p}.jobs.*.*.*.lab-1.*",
    "$KV.{p}-jobs.lab-1.*",
    "$KV.{p}-nodes.bench.lab-1",
    "$KV.{p}-nodes.clock.lab-1",
    "$O.{p}-lab-1.>",
    "{p}.bell",
    "{p}.cancel.lab-1.*",
];
const WORKER: &[&str] = &[
    "$JS.API.STREAM.INFO.{P}_JOBS",
    "$JS.API.STREAM.MSG.GET.{P}_JOBS",
    "$JS.API.CONSUMER.NAMES.{P}_JOBS",
    "$JS.API.CONSUMER.INFO.{P}_JOBS.*",
    "$JS.API.CONSUMER.MSG.NEXT.{P}_JOBS.*",
    "$JS.ACK.{P}_JOBS.>",
    "$JS.API.STREAM.INFO.KV_{p}-jobs",
    "$JS.API.STREAM.MSG.GET.KV_{p}-jobs",
    "$JS.API.STREAM.INFO.KV_{p}-nodes",
    "$JS.API.STREAM.INFO.OBJ_{p}-lab-1",
    "$JS.API.STREAM.PURGE.OBJ_{p}-lab-1",
    "$JS.API.STREAM.MSG.GET.OBJ_{p}-lab-1",
    "$JS.API.DIRECT.GET.OBJ_{p}-lab-1",
    "$JS.API.DIRECT.GET.OBJ_{p}-lab-1.>",
    "$KV.{p}-jobs.*.*",
    "$KV.{p}-nodes.worker.tower.*",
    "$O.{p}-lab-1.>",
    "{p}.bell",
    "{p}.progress.*.*",
];
const VIEWER: &[&str] = &[
    "$JS.API.STREAM.INFO.{P}_JOBS",
    "$JS.API.STREAM.MSG.GET.{P}_JOBS",
    "$JS.API.CONSUMER.LIST.{P}_JOBS",
    "$JS.API.STREAM.INFO.KV_{p}-jobs",
    "$JS.API.STREAM.MSG.GET.KV_{p}-jobs",
    "$JS.API.CONSUMER.CREATE.KV_{p}-jobs",
    "$JS.API.STREAM.INFO.KV_{p}-nodes",
    "$JS.API.STREAM.MSG.GET.KV_{p}-nodes",
    "$JS.FC.>",
    "$KV.{p}-nodes.clock.desk",
];

fn user(name: &str, may: &[&str], hears: &[&str], prefix: &str) -> String {
    let list = |subjects: &[&str]| {
        let filled = subjects.iter().map(|subject| {
            let subject = subject.replace("{p}", prefix);
            format!("\"{}\"", subject.replace("{P}", &prefix.to_uppercase()))
        });
        filled.collect::<Vec<_>>().join(", ")
    };
    let inbox = format!("_INBOX_{name}.>");
    let hears = [hears, &[inbox.as_str()]].concat();
    format!(
        "{{ user: {name}, password: secret, permissions: {{ publish: [{}], subscribe: [{}] }} }}",
        list(may),
        list(&hears)
    )
}

fn node(role: Role, name: &str) -> Node {
    Node {
        role,
        name: name.to_owned(),
        version: "0.1.0".to_owned(),
        formats: (1, 1),
        memory_mib: None,
        tools: Vec::new(),
        busy_with: None,
        threads: 2,
        waiting: 0,
        since: "2026-01-01T00:00:00Z".to_owned(),
    }
}

/// A server, and a connection of each role: bench, worker, viewer.
fn rig() -> Option<(Arc<Server>, Options, [Arc<JetStreamQueue>; 3])> {
    let mut options = options("");
    let prefix = options.prefix.clone();
    let users = [
        user(
            "lab-1",
            BENCH,
            &["{p}.progress.lab-1.*", "{p}.bell"],
            &prefix,
        ),
        user("tower", WORKER, &["{p}.bell", "{p}.cancel.>"], &prefix),
        user("desk", VIEWER, &["{p}.progress.>", "{p}.bell"], &prefix),
    ];
    let lines = format!("authorization {{ users [ {} ] }}", users.join(", "));
    let server = server::configured(&lines)?;
    options.servers = vec![server.url()];
    let as_user = |name: &str, makes_missing| {
        let mut options = options.clone();
        options.name = name.to_owned();
        options.inbox = format!("_INBOX_{name}");
        options.makes_missing = makes_missing;
        options.login = Login::Password {
            user: name.to_owned(),
            password: Secret::new("secret"),
        };
        connect(&options)
    };
    let queues = [
        as_user("lab-1", true),
        as_user("tower", false),
        as_user("desk", false),
    ];
    Some((server, options, queues))
}

#[test]
fn each_role_can_do_its_work() {
    let Some((_server, _, [bench, worker, viewer])) = rig() else {
        return;
    };
    let me = Worker::named("tower");
    let early = worker
        .take(&me, Duration::ZERO)
        .map(|taken| taken.is_some());
    let told = early.unwrap_err().to_string();
    assert!(told.contains("a bench makes it"), "{told}");
    let lab = key(1).bench;
    let news = bench.news(&lab);
    let journal = vec![5; 300_000];
    let put = |from: &[u8]| bench.depot().put(&lab, Kind::Journal, &mut &*from);
    let parcel = put(&journal).unwrap();
    for job in 1..=4 {
        bench.offer(&order(job)).unwrap();
    }
    bench.beat(&node(Role::Bench, "lab-1")).unwrap();
    worker.beat(&node(Role::Worker, "tower")).unwrap();
    // Fetched, made, put, settled.
    let mut lease = worker.take(&me, LIMIT).unwrap().unwrap();
    let mut fetched = Vec::new();
    let depot = worker.depot();
    depot
        .fetch(&lab, Kind::Journal, &parcel, &mut fetched)
        .unwrap();
    assert!(fetched == journal);
    lease.tell("segment", 0.5, None);
    let put = || {
        let mut result: &[u8] = b"STEP";
        depot.put(&lab, Kind::Result, &mut result).unwrap()
    };
    put();
    let parcel = put();
    lease.settle(&done()).unwrap();
    worker
        .take(&me, LIMIT)
        .unwrap()
        .unwrap()
        .give_back()
        .unwrap();
    bench.cancel(&key(3)).unwrap();
    bench.forget(&key(3)).unwrap();
    let lease = worker.take(&me, LIMIT).unwrap().unwrap();
    bench.cancel(&lease.order().key).unwrap();
    while lease.stop().is_none() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let mut result = Vec::new();
    let depot = bench.depot();
    depot
        .fetch(&lab, Kind::Result, &parcel, &mut result)
        .unwrap();
    depot.sweep(&lab, &HashSet::new(), Duration::ZERO).unwrap();
    assert_eq!(depot.list(&lab).unwrap(), []);
    // Whoever looks on.
    assert_eq!(viewer.nodes().unwrap().len(), 2);
    assert_eq!(viewer.standings(&lab).unwrap().len(), 3);
    assert!(viewer.depth().unwrap().oldest_s.is_some());
    assert!(bench.depth().unwrap().oldest_s.is_some());
    let heard = |news: &std::sync::mpsc::Receiver<_>| news.recv_timeout(LIMIT).unwrap();
    heard(&news);
    heard(&viewer.news(&lab));
}

fn is_refused<T: std::fmt::Debug>(done: Result<T, QueueError>) {
    let error = done.unwrap_err();
    assert!(matches!(error, QueueError::Refused(_)), "{error}");
    assert!(error.to_string().contains("permissions"), "{error}");
}

#[test]
fn no_role_can_do_what_is_another_s() {
    let Some((_server, _, [bench, worker, viewer])) = rig() else {
        return;
    };
    bench.offer(&order(1)).unwrap();
    bench.beat(&node(Role::Bench, "lab-1")).unwrap();
    let other = BenchName::try_from("lab-2".to_owned()).unwrap();
    let mut foreign = order(1);
    foreign.key.bench = other.clone();
    std::thread::scope(|scope| {
        scope.spawn(|| is_refused(bench.offer(&foreign)));
        scope.spawn(|| is_refused(worker.beat(&node(Role::Worker, "tower-2"))));
        scope.spawn(|| is_refused(viewer.cancel(&key(1))));
    });
    std::thread::scope(|scope| {
        scope.spawn(|| is_refused(bench.beat(&node(Role::Bench, "lab-2"))));
        scope.spawn(|| is_refused(worker.forget(&key(1))));
        scope.spawn(|| is_refused(viewer.take(&Worker::named("w"), Duration::ZERO).map(|_| ())));
    });
    std::thread::scope(|scope| {
        scope.spawn(|| is_refused(bench.depot().put_chunk(&other, Kind::Journal, b"j")));
        scope.spawn(|| is_refused(worker.depot().put_chunk(&other, Kind::Result, b"r")));
    });
    assert!(bench.take(&Worker::named("w"), Duration::ZERO).is_err());
}
