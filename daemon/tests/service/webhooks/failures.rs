//! Receivers that do not do what they should.

use std::time::Duration;

use relief_api::{Delivery, DeliveryState, Status, WebhookEvent, path};
use reliefd::config::Retry;
use tokio::net::TcpSocket;

use super::receiver::{Answer, Receiver};
use super::{SECRET, log, settled, start, telling, until_delivered, webhook};

/// What is told of the last attempt.
fn error(delivery: &Delivery) -> &str {
    delivery.tried.last().unwrap().error.as_deref().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_not_taken_is_tried_again() {
    let receiver = Receiver::new([
        Answer::Status(500, "out of\x1b order"),
        Answer::Close,
        Answer::Status(302, ""),
    ]);
    let rig = start(|folder| {
        let mut webhook = webhook(folder, "lab", &receiver.url());
        webhook.events = vec![WebhookEvent::JobDone];
        vec![webhook]
    })
    .await;
    rig.scan_to_result("roof").await;
    let first = receiver.next();
    for _ in 0..3 {
        let again = receiver.next();
        assert_eq!((again.id(), &again.body), (first.id(), &first.body));
        assert!(again.is_signed_with(SECRET));
    }
    let delivered = until_delivered(&rig).await;
    assert_eq!((delivered.attempts, delivered.next_attempt_at), (4, None));
    let tried: Vec<(Option<u16>, Option<&str>)> = delivered
        .tried
        .iter()
        .map(|tried| (tried.status, tried.error.as_deref()))
        .collect();
    let closed = format!(
        "{} closed the connection without an answer",
        receiver.address
    );
    assert_eq!(
        tried,
        [
            (Some(500), Some("the receiver answered 500")),
            (None, Some(closed.as_str())),
            (Some(302), Some("the receiver answered 302")),
            (Some(204), None),
        ]
    );
    assert_eq!(delivered.tried[0].answer.as_deref(), Some("out of order"));
    assert!(delivered.tried.is_sorted_by(|a, b| a.at < b.at));
    receiver.is_quiet();
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_receiver_that_hangs_holds_up_nobody_else() {
    let (hangs, other) = (
        Receiver::new([Answer::Hang, Answer::Hang]),
        Receiver::new([]),
    );
    let rig = start(|folder| {
        let mut hanging = webhook(folder, "hanging", &hangs.url());
        hanging.timeout_ms = 25_000;
        let mut told = webhook(folder, "lab", &other.url());
        told.timeout_ms = 5_000;
        vec![hanging, told]
    })
    .await;
    rig.scan_to_result("roof").await;
    hangs.next();
    other.next();
    other.next();
    // The service answers, and takes scans.
    let status: Status = rig.client.get(path::STATUS).await;
    assert_eq!(status.jobs_running, 0);
    rig.scan_to_result("again").await;
    for _ in 0..2 {
        other.next();
    }
    other.will(Answer::Hang);
    let timed_out: Delivery = rig.client.ask(&path::webhook_test("lab")).await;
    let address = other.address;
    assert_eq!(
        error(&timed_out),
        format!("{address} did not answer within 5000 ms (timeout_ms)")
    );
    // It has not ended yet when the service does.
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_receiver_that_is_away_is_told_when_it_is_back() {
    // Nobody else gets the port meanwhile; connections are refused until somebody listens.
    let away = TcpSocket::new_v4().unwrap();
    away.bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let address = away.local_addr().unwrap();
    let rig = start(|folder| {
        let mut webhook = webhook(folder, "lab", &format!("http://{address}/"));
        webhook.events = vec![WebhookEvent::JobDone];
        vec![webhook]
    })
    .await;
    rig.scan_to_result("roof").await;
    let waits = settled(&rig, 0, |delivery| delivery.attempts >= 2).await;
    assert_eq!(waits.state, DeliveryState::Waiting);
    assert_eq!(
        error(&waits),
        format!("{address} refuses the connection: is the receiver running?")
    );
    let listener = away.listen(16).unwrap().into_std().unwrap();
    listener.set_nonblocking(false).unwrap();
    let receiver = Receiver::on(listener, []);
    assert_eq!(receiver.next().id(), waits.id);
    until_delivered(&rig).await;
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn answers_are_bounded_and_redirections_not_followed() {
    let elsewhere = Receiver::new([]);
    let receiver = Receiver::new([]);
    let rig = telling(&receiver).await;
    let to = format!("{}/hunter2?hunter2", elsewhere.url());
    let shown = format!("http://{}/...), where", elsewhere.address);
    for (answer, status, told) in [
        (
            Answer::EndlessBody(500),
            Some(500),
            "the receiver answered 500",
        ),
        (Answer::EndlessHead, None, "cannot be read as HTTP"),
        (Answer::EndlessField, None, "has more than 16384 bytes"),
        (Answer::Elsewhere(301, to.clone()), Some(301), &*shown),
        (Answer::Elsewhere(302, to.clone()), Some(302), &*shown),
        (Answer::Elsewhere(307, to.clone()), Some(307), &*shown),
        (Answer::Elsewhere(308, to.clone()), Some(308), "set url to"),
    ] {
        receiver.will(answer.clone());
        let tested: Delivery = rig.client.ask(&path::webhook_test("lab")).await;
        assert_eq!(tested.state, DeliveryState::GivenUp, "{answer:?}");
        assert_eq!(tested.tried[0].status, status, "{answer:?}");
        assert!(error(&tested).contains(told), "{answer:?}: {tested:?}");
        let said = tested.tried[0].answer.as_deref().unwrap_or_default();
        assert!(said.len() <= 200, "{answer:?}: {said}");
        assert!(!format!("{tested:?}").contains("hunter2"), "{tested:?}");
    }
    // Of what was taken nothing more is read.
    receiver.will(Answer::EndlessBody(200));
    let tested: Delivery = rig.client.ask(&path::webhook_test("lab")).await;
    assert_eq!(tested.state, DeliveryState::Delivered);
    elsewhere.is_quiet();
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_message_is_given_up_when_it_is_enough_or_unwanted() {
    let receiver = Receiver::new([
        Answer::Status(410, ""),
        Answer::Status(500, ""),
        Answer::Status(500, ""),
        Answer::Status(500, ""),
    ]);
    let rig = start(|folder| {
        let mut webhook = webhook(folder, "lab", &receiver.url());
        webhook.retry = Retry {
            lasting: Duration::ZERO,
            attempts: 3,
            ..webhook.retry
        };
        vec![webhook]
    })
    .await;
    rig.scan_to_result("roof").await;
    let given_up = |delivery: &Delivery| delivery.state == DeliveryState::GivenUp;
    let tried = settled(&rig, 0, given_up).await;
    let unwanted = settled(&rig, 1, given_up).await;
    assert_eq!(
        (unwanted.event, unwanted.attempts),
        (WebhookEvent::ScanEnded, 1)
    );
    assert!(error(&unwanted).contains("remove this webhook"));
    assert_eq!((tried.event, tried.attempts), (WebhookEvent::JobDone, 3));
    assert_eq!(
        (&unwanted.next_attempt_at, &tried.next_attempt_at),
        (&None, &None)
    );
    for _ in 0..4 {
        receiver.next();
    }
    // Later messages are tried all the same.
    rig.scan_to_result("again").await;
    until_delivered(&rig).await;
    assert_eq!(log(&rig).await.len(), 4);
    rig.daemon.shutdown().await;
}
