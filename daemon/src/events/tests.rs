use super::*;

/// One that forgets at once.
fn hub(backlog_bytes: usize, remembered_bytes: usize) -> Hub {
    Hub::with_limits(Limits {
        backlog_bytes,
        remembered_bytes,
        remembered_for: Duration::ZERO,
    })
}

/// An event of about this many bytes.
fn event(number: u64, bytes: usize) -> Event {
    Event::Progress {
        job: number,
        scan: "x".repeat(bytes),
        scanner: String::new(),
        stage: String::new(),
        fraction: 0.0,
        seconds: None,
    }
}

#[tokio::test]
async fn subscribers_hear_everything_told_since_they_came() {
    let hub = hub(1_000_000, 0);
    hub.tell(event(1, 10));
    let mut early = hub.subscribe();
    hub.tell(event(2, 10));
    let mut late = hub.subscribe();
    hub.tell(event(3, 10));
    let heard = |number| Some(Heard::Event(Arc::new(Told::new(&event(number, 10)))));
    assert_eq!(early.next().await, heard(2));
    assert_eq!(early.next().await, heard(3));
    assert_eq!(late.next().await, heard(3));
    let (next, ()) = tokio::join!(early.next(), async { hub.tell(event(4, 10)) });
    assert_eq!(next, heard(4));
    drop(hub);
    assert_eq!(late.next().await, heard(4));
    assert_eq!(late.next().await, None);
}

#[tokio::test]
async fn the_backlog_is_bounded_in_bytes_and_losses_are_told() {
    let hub = hub(100_000, 0);
    let mut slow = hub.subscribe();
    for number in 0..1_000 {
        hub.tell(event(number, 10_000));
        assert!(lock(&hub.backlog).bytes <= 100_000);
    }
    let Some(Heard::Lagged(missed)) = slow.next().await else {
        panic!("nothing was lost");
    };
    assert_eq!(missed, 1_000 - lock(&hub.backlog).events.len() as u64);
    let first = Told::new(&event(missed, 10_000));
    assert_eq!(slow.next().await, Some(Heard::Event(Arc::new(first))));
    // One that is larger than all is still heard.
    hub.tell(event(1_000, 200_000));
    assert!(matches!(slow.next().await, Some(Heard::Lagged(_))));
    let last = Told::new(&event(1_000, 200_000));
    assert_eq!(slow.next().await, Some(Heard::Event(Arc::new(last))));
    // Nothing is kept for nobody.
    hub.tell(event(1_001, 10));
    assert_ne!(lock(&hub.backlog).bytes, 0);
    drop(slow);
    assert_eq!(lock(&hub.backlog).bytes, 0);
    hub.tell(event(1_001, 10));
    assert_eq!(lock(&hub.backlog).bytes, 0);
    let mut late = hub.subscribe();
    hub.tell(event(1_002, 10));
    let heard = Told::new(&event(1_002, 10));
    assert_eq!(late.next().await, Some(Heard::Event(Arc::new(heard))));
}

#[tokio::test]
async fn what_all_have_heard_is_let_go() {
    let hub = hub(1_000_000, 0);
    let (mut quick, mut slow) = (hub.subscribe(), hub.subscribe());
    for number in 0..3 {
        hub.tell(event(number, 10));
    }
    let kept = || lock(&hub.backlog).events.len();
    for _ in 0..3 {
        quick.next().await.unwrap();
    }
    assert_eq!(kept(), 3);
    for heard in 1..=3 {
        slow.next().await.unwrap();
        assert_eq!(kept(), 3 - heard);
    }
    assert_eq!(lock(&hub.backlog).bytes, 0);
}

fn patient() -> Hub {
    Hub::with_limits(Limits {
        backlog_bytes: 1_000_000,
        remembered_bytes: 10_000,
        // Far longer than this takes.
        remembered_for: Duration::from_secs(600),
    })
}

async fn numbers(subscriber: &mut Subscriber, count: usize) -> Vec<String> {
    let mut heard = Vec::new();
    for _ in 0..count {
        match subscriber.next().await {
            Some(Heard::Event(told)) => {
                let event: serde_json::Value = serde_json::from_str(&told.json).unwrap();
                heard.push(event["job"].to_string());
            }
            other => heard.push(format!("{other:?}")),
        }
    }
    heard
}

#[tokio::test]
async fn who_comes_back_hears_what_was_missed_and_nothing_twice() {
    let hub = patient();
    let mut first = hub.subscribe();
    let fresh = first.heard();
    for number in 0..5 {
        hub.tell(event(number, 10));
    }
    assert_eq!(numbers(&mut first, 2).await, ["0", "1"]);
    let last = first.heard();
    drop(first);
    // Nobody listens, but somebody may come back.
    hub.tell(event(5, 10));
    let last: EventId = last.to_string().parse().unwrap();
    let mut back = hub.resume(last).unwrap();
    assert_eq!(numbers(&mut back, 4).await, ["2", "3", "4", "5"]);
    // From the status, before which nothing was told, all over again.
    let mut again = hub.resume(fresh).unwrap();
    assert_eq!(numbers(&mut again, 1).await, ["0"]);
    // Who has heard all waits for the next.
    let mut idle = hub.resume(back.heard()).unwrap();
    let (next, ()) = tokio::join!(numbers(&mut idle, 1), async { hub.tell(event(6, 10)) });
    assert_eq!(next, ["6"]);
}

#[tokio::test]
async fn what_is_not_known_any_more_is_not_resumed() {
    let hub = patient();
    let mut first = hub.subscribe();
    let start = first.heard();
    for number in 0..50 {
        hub.tell(event(number, 1_000));
        first.next().await.unwrap();
    }
    assert!(lock(&hub.backlog).bytes <= 10_000);
    assert!(hub.resume(start).is_none(), "too long ago");
    let EventId { run, next } = first.heard();
    let other_run = EventId { run: run + 1, next };
    assert!(hub.resume(other_run).is_none());
    let to_come = EventId {
        run,
        next: next + 1,
    };
    assert!(hub.resume(to_come).is_none());
    assert!(hub.resume(EventId { run, next }).is_some());
    for wrong in ["", "-", "1", "x-1", "1-x", "1-2-3"] {
        assert!(wrong.parse::<EventId>().is_err(), "{wrong}");
    }
}

#[tokio::test]
async fn nothing_is_made_once_nobody_comes_back() {
    let hub = hub(1_000_000, 10_000);
    let subscriber = hub.subscribe();
    let last = subscriber.heard();
    hub.tell(event(0, 10));
    drop(subscriber);
    assert!(!hub.has_listeners());
    assert_eq!(lock(&hub.backlog).bytes, 0);
    hub.tell(event(1, 10));
    let late = hub.subscribe();
    assert!(hub.resume(last).is_none(), "an event has gone by unmade");
    assert!(hub.resume(late.heard()).is_some());
}
