//! What benches and workers find besides what every queue gives.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

use async_nats::jetstream::consumer::{FromConsumer, PullConsumer, pull};
use job_queue::jetstream::{JetStreamQueue, News, Node, Options, Role};
use job_queue::{
    BenchName, Ending, FORMAT, JobKey, JobQueue, Lease, Need, Order, Outcome, Priority, QueueError,
    Stop, Worker,
};
use relief_api::JobState;

use crate::server::{self, LIMIT, behind, connect, lose_orders, options};
use nats_child::Server;

pub(crate) fn key(job: u64) -> JobKey {
    JobKey {
        bench: BenchName::try_from("lab-1".to_owned()).unwrap(),
        job,
    }
}

pub(crate) fn order(job: u64) -> Order {
    Order {
        format: FORMAT,
        key: key(job),
        turn: 1,
        priority: Priority::Normal,
        need: Need::default(),
        body: serde_json::json!({ "scan": format!("scan-{job}") }),
    }
}

pub(crate) fn take(queue: &JetStreamQueue, name: &str) -> Box<dyn Lease> {
    queue.take(&Worker::named(name), LIMIT).unwrap().unwrap()
}

pub(crate) fn done() -> Outcome {
    Outcome {
        ending: Ending::Done {
            result: serde_json::json!("r"),
            left_out: Vec::new(),
        },
        timings: Vec::new(),
    }
}

fn rig() -> Option<(Arc<Server>, Options, Arc<JetStreamQueue>)> {
    let server = server::shared()?;
    let options = options(&server.url());
    let queue = connect(&options);
    Some((server, options, queue))
}

#[test]
fn low_priority_goes_on() {
    let Some((_server, _, queue)) = rig() else {
        return;
    };
    let mut low = order(1);
    low.priority = Priority::Low;
    queue.offer(&low).unwrap();
    for job in 2..=20 {
        let mut high = order(job);
        high.priority = Priority::High;
        queue.offer(&high).unwrap();
    }
    let mut before = 0;
    loop {
        let mut lease = take(&queue, "w");
        lease.settle(&done()).unwrap();
        if lease.order().key == low.key {
            break;
        }
        before += 1;
    }
    assert_eq!(before, 7, "every eighth order is looked for from below");
}

#[test]
fn a_later_turn_takes_the_place_of_one_that_runs() {
    let Some((_server, _, queue)) = rig() else {
        return;
    };
    queue.offer(&order(1)).unwrap();
    let mut first = take(&queue, "first");
    let mut again = order(1);
    again.turn = 2;
    queue.offer(&again).unwrap();
    let mut second = take(&queue, "second");
    assert_eq!(second.order().turn, 2);
    let begun = Instant::now();
    while first.stop() != Some(Stop::Lost) {
        assert!(begun.elapsed() < LIMIT);
        std::thread::sleep(Duration::from_millis(5));
    }
    let late = first.settle(&done());
    assert!(matches!(late, Err(QueueError::Lost(_))), "{late:?}");
    second.settle(&done()).unwrap();
    // An earlier turn changes nothing any more.
    queue.offer(&order(1)).unwrap();
    let standing = queue.standing(&key(1)).unwrap().unwrap();
    assert_eq!((standing.turn, standing.state), (2, JobState::Done));
    let nothing = queue.take(&Worker::named("w"), Duration::from_millis(200));
    assert!(nothing.unwrap().is_none());
}

#[test]
fn what_is_forgotten_is_gone() {
    let Some((_server, _, queue)) = rig() else {
        return;
    };
    for job in 1..=2 {
        queue.offer(&order(job)).unwrap();
    }
    queue.forget(&key(1)).unwrap();
    queue.forget(&key(9)).unwrap();
    let lease = take(&queue, "w");
    assert_eq!(lease.order().key, key(2));
    queue.forget(&key(2)).unwrap();
    let begun = Instant::now();
    while lease.stop() != Some(Stop::Lost) {
        assert!(begun.elapsed() < LIMIT);
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(queue.standings(&key(1).bench).unwrap(), []);
    // Forgotten, it may be offered as if it had never been there.
    queue.offer(&order(1)).unwrap();
    assert_eq!(take(&queue, "w").order().key, key(1));
}

#[test]
fn more_than_the_quota_is_refused() {
    let Some((_server, mut options, _)) = rig() else {
        return;
    };
    options.prefix.push_str("-small");
    options.quota_jobs = 3;
    let queue = connect(&options);
    for job in 1..=3 {
        queue.offer(&order(job)).unwrap();
    }
    let refused = queue.offer(&order(4)).unwrap_err();
    assert!(matches!(refused, QueueError::Full(_)), "{refused}");
    queue.offer(&order(3)).unwrap();
    take(&queue, "w").settle(&done()).unwrap();
    queue.offer(&order(4)).unwrap();
    for job in 2..=4 {
        let mut lease = take(&queue, "w");
        lease.settle(&done()).unwrap();
        assert_eq!(lease.order().key, key(job));
    }
}

/// A server that has lost its disk is told again by benches that offer again.
#[test]
fn a_server_that_lost_all_is_told_again() {
    let Some(server) = server::start() else {
        return;
    };
    let options = options(&server.url());
    let queue = connect(&options);
    queue.offer(&order(1)).unwrap();
    server.kill();
    server.wipe().unwrap();
    server.start().unwrap();
    let begun = Instant::now();
    while queue.offer(&order(1)).is_err() {
        assert!(begun.elapsed() < LIMIT);
    }
    take(&queue, "w").settle(&done()).unwrap();
}

/// The message alone is lost, as of a bench that was killed before it was sent.
#[test]
fn an_order_without_a_message_is_put_again() {
    let Some((server, options, queue)) = rig() else {
        return;
    };
    queue.offer(&order(1)).unwrap();
    assert_eq!(lose_orders(&server, &options), 1);
    let nothing = queue.take(&Worker::named("w"), Duration::ZERO).unwrap();
    assert!(nothing.is_none());
    queue.offer(&order(1)).unwrap();
    let mut lease = take(&queue, "w");
    // So it is when the message is lost under a worker's hands.
    assert_eq!(lose_orders(&server, &options), 1);
    queue.offer(&order(1)).unwrap();
    let mut next = take(&queue, "v");
    assert_eq!(next.begun().attempts, 2);
    assert!(matches!(lease.settle(&done()), Err(QueueError::Lost(_))));
    next.settle(&done()).unwrap();
}

/// As a server does that believes after it was killed that a worker has answered: here it is told to
/// give out nothing twice.
#[test]
fn an_order_that_the_server_gives_to_nobody_any_more_is_put_anew() {
    let Some((server, options, queue)) = rig() else {
        return;
    };
    queue.offer(&order(1)).unwrap();
    let name = format!("{}_JOBS", options.prefix.to_uppercase());
    behind(&server, |context| async move {
        let stream = context.get_stream(name).await.unwrap();
        let consumer: PullConsumer = stream.get_consumer("v1-normal-m0").await.unwrap();
        let mut config = consumer.cached_info().config.clone();
        config.max_deliver = 1;
        let config = pull::Config::try_from_consumer_config(config).unwrap();
        stream.create_consumer(config).await.unwrap();
    });
    drop(take(&queue, "dies"));
    let soon = Duration::from_millis(200);
    let nothing = queue
        .take(&Worker::named("w"), 3 * options.ack_wait)
        .unwrap();
    assert!(nothing.is_none());
    let begun = Instant::now();
    let mut next = loop {
        queue.offer(&order(1)).unwrap();
        if let Some(lease) = queue.take(&Worker::named("w"), soon).unwrap() {
            break lease;
        }
        assert!(begun.elapsed() < LIMIT);
    };
    assert_eq!(next.begun().attempts, 2);
    // What a worker has is not taken from it.
    queue.offer(&order(1)).unwrap();
    assert!(queue.take(&Worker::named("v"), soon).unwrap().is_none());
    next.settle(&done()).unwrap();
}

/// The same turn once more with another priority is another message, and the same order.
#[test]
fn two_messages_of_an_order_are_one() {
    let Some((_server, _, queue)) = rig() else {
        return;
    };
    queue.offer(&order(1)).unwrap();
    let mut twin = order(1);
    twin.priority = Priority::High;
    queue.offer(&twin).unwrap();
    let mut lease = take(&queue, "w");
    let nothing = queue.take(&Worker::named("v"), Duration::from_millis(300));
    assert!(nothing.unwrap().is_none());
    lease.settle(&done()).unwrap();
    let nothing = queue.take(&Worker::named("v"), Duration::from_millis(300));
    assert!(nothing.unwrap().is_none());
    let depth = queue.depth().unwrap();
    assert_eq!(depth.running + depth.waiting.values().sum::<u64>(), 0);
}

#[test]
fn an_order_that_cannot_be_read_fails() {
    let Some((server, options, queue)) = rig() else {
        return;
    };
    queue.offer(&order(1)).unwrap();
    lose_orders(&server, &options);
    behind(&server, |context| async move {
        for job in ["lab-1.1-1", "nobody.x"] {
            let subject = format!("{}.jobs.v1.normal.m0.{job}", options.prefix);
            let sent = context.publish(subject, "{".into()).await.unwrap();
            sent.await.unwrap();
        }
    });
    let nothing = queue.take(&Worker::named("w"), Duration::from_millis(300));
    assert!(nothing.unwrap().is_none());
    let standing = queue.standing(&key(1)).unwrap().unwrap();
    let Some(Ending::Failed { error, .. }) = standing.outcome.map(|outcome| outcome.ending) else {
        unreachable!("it failed");
    };
    assert!(error.contains("cannot be read"), "{error}");
    let depth = queue.depth().unwrap();
    assert_eq!(depth.running + depth.waiting.values().sum::<u64>(), 0);
}

/// Waits for news that are as they should be, and gives all until then.
fn hear(news: &Receiver<News>, wanted: impl Fn(&News) -> bool) -> Vec<News> {
    let mut heard = Vec::new();
    loop {
        let next = news.recv_timeout(LIMIT);
        heard.push(next.unwrap_or_else(|_| unreachable!("only heard {heard:?}")));
        if heard.last().is_some_and(&wanted) {
            return heard;
        }
    }
}

#[test]
fn a_bench_hears_what_happens_to_its_orders() {
    let Some(server) = server::start() else {
        return;
    };
    let options = options(&server.url());
    let queue = connect(&options);
    let is = |job, state| move |news: &News| matches!(news, News::Standing(of, Some(standing)) if *of == key(job) && standing.state == state);
    queue.offer(&order(1)).unwrap();
    let mut other = order(2);
    other.key.bench = BenchName::try_from("lab-2".to_owned()).unwrap();
    queue.offer(&other).unwrap();
    let news = queue.news(&key(1).bench);
    hear(&news, is(1, JobState::Queued));
    let mut lease = take(&queue, "w");
    hear(&news, is(1, JobState::Running));
    lease.tell("segment", 0.25, None);
    hear(&news, |news| {
        matches!(news, News::Progress { key: of, stage, fraction, seconds: None }
            if *of == key(1) && stage == "segment" && *fraction == 0.25)
    });
    hear(
        &news,
        |news| matches!(news, News::Standing(_, Some(standing)) if standing.stage.as_deref() == Some("segment")),
    );
    for percent in 26..=99 {
        lease.tell("segment", f64::from(percent) / 100.0, None);
    }
    lease.tell("segment", 1.0, Some(1.5));
    let heard = hear(
        &news,
        |news| matches!(news, News::Progress { seconds: Some(seconds), .. } if *seconds == 1.5),
    );
    assert!(heard.len() < 20, "too much is told: {}", heard.len());
    lease.settle(&done()).unwrap();
    let heard = hear(&news, is(1, JobState::Done));
    for news in &heard {
        assert!(!matches!(news, News::Standing(of, _) if of.bench != key(1).bench));
    }
    server.kill();
    hear(&news, |news| *news == News::Away);
    let away = queue.standing(&key(1)).unwrap_err();
    assert!(matches!(away, QueueError::Away(_)), "{away}");
    assert!(queue.away_since().is_some() && !queue.is_connected());
    server.start().unwrap();
    hear(&news, |news| *news == News::Connected);
    hear(&news, is(1, JobState::Done));
    let standings = queue.standings(&key(1).bench).unwrap();
    assert_eq!(standings.len(), 1);
    assert_eq!(standings[0].1.state, JobState::Done);
    // Nobody tells once the queue is gone.
    drop((lease, queue));
    while news.recv_timeout(LIMIT).is_ok() {}
    assert!(matches!(news.try_recv(), Err(TryRecvError::Disconnected)));
}

#[test]
fn depth_tells_what_is_to_be_done() {
    let Some((_server, _, queue)) = rig() else {
        return;
    };
    assert_eq!(queue.depth().unwrap().oldest_s, None);
    for (job, priority) in [
        (1, Priority::Low),
        (2, Priority::High),
        (3, Priority::High),
        (4, Priority::Normal),
    ] {
        let mut order = order(job);
        order.priority = priority;
        queue.offer(&order).unwrap();
    }
    let mut lease = take(&queue, "w");
    let depth = queue.depth().unwrap();
    let waiting: Vec<_> = depth.waiting.into_values().collect();
    assert_eq!(waiting, [1, 1, 1]);
    assert_eq!(depth.running, 1);
    let age = depth.oldest_s.unwrap();
    assert!((0.0..60.0).contains(&age), "{age} s");
    std::thread::sleep(Duration::from_millis(20));
    assert!(queue.depth().unwrap().oldest_s.unwrap() >= age + 0.02);
    lease.settle(&done()).unwrap();
    assert_eq!(queue.depth().unwrap().running, 0);
}

#[test]
fn nodes_tell_that_they_are_there() {
    let Some((_server, options, queue)) = rig() else {
        return;
    };
    let mut node = Node {
        role: Role::Worker,
        name: "tower 3".to_owned(),
        version: "0.1.0".to_owned(),
        formats: (1, FORMAT),
        memory_mib: Some(8192),
        tools: vec!["occt".to_owned()],
        busy_with: None,
        threads: 8,
        waiting: 0,
        since: "2026-01-01T00:00:00Z".to_owned(),
    };
    queue.beat(&node).unwrap();
    // Another of the same name is another one.
    let twin = connect(&options);
    twin.beat(&node).unwrap();
    node.busy_with = Some(key(7));
    queue.beat(&node).unwrap();
    let bench = Node {
        role: Role::Bench,
        name: "lab-1".to_owned(),
        waiting: 3,
        ..node.clone()
    };
    queue.beat(&bench).unwrap();
    queue.depth().unwrap();
    let nodes = queue.nodes().unwrap();
    assert_eq!(nodes.len(), 3, "{nodes:?}");
    assert!(nodes.contains(&bench) && nodes.contains(&node));
    queue.leave(&node).unwrap();
    assert_eq!(queue.nodes().unwrap().len(), 2);
}

/// A message may be left behind, as when a server does not hear that it was answered. Without a
/// standing that speaks for it, it is nothing.
#[test]
fn a_message_that_nothing_speaks_for_is_dropped() {
    let Some((server, options, queue)) = rig() else {
        return;
    };
    let leave_behind = |order: &Order| {
        let subject = format!(
            "{}.jobs.v1.normal.m0.{}-{}",
            options.prefix, order.key, order.turn
        );
        let payload = serde_json::to_vec(order).unwrap();
        behind(&server, |context| async move {
            let sent = context.publish(subject, payload.into()).await.unwrap();
            sent.await.unwrap();
        });
    };
    let mut settled = order(1);
    settled.turn = 2;
    queue.offer(&settled).unwrap();
    take(&queue, "w").settle(&done()).unwrap();
    for order in [settled, order(1), order(2)] {
        leave_behind(&order);
        assert_eq!(queue.depth().unwrap().waiting[&Priority::Normal], 1);
        let nothing = queue.take(&Worker::named("w"), Duration::ZERO).unwrap();
        assert!(nothing.is_none(), "{order:?}");
        // The server may be about to hear of it.
        let begun = Instant::now();
        let left = || {
            let depth = queue.depth().unwrap();
            depth.running + depth.waiting[&Priority::Normal]
        };
        while left() > 0 {
            assert!(begun.elapsed() < LIMIT, "{order:?} is still there");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
    // One that is cancelled leaves none.
    queue.offer(&order(3)).unwrap();
    queue.cancel(&key(3)).unwrap();
    assert_eq!(queue.depth().unwrap().waiting[&Priority::Normal], 0);
}
