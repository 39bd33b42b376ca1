//! Brokers: messages are published and acknowledged, states are kept for whoever asks, whatever
//! becomes of the broker or the service.

mod broker;

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use relief_api::{
    Delivery, DeliveryList, DeliveryState, ScannerState, WebhookEvent, WebhookKind, WebhookList,
    WebhookMessage, path,
};
use reliefd::config::{MqttConfig, Retry};

use crate::rig::{Rig, config};
use crate::webhooks::write_secret;
use broker::{Broker, PASSWORD, USER, mute};

/// A section for this broker, with its password in the folder.
fn section(folder: &Path, broker: &Broker) -> MqttConfig {
    let file = folder.join("password");
    // With the line's end that editors leave.
    write_secret(&file, &format!("{PASSWORD}\n"));
    let mut section = MqttConfig::new("hall", &broker.url());
    section.topic_prefix = Some("lab/relief".into());
    section.username = Some(USER.into());
    section.password_file = Some(file);
    section.ca_file = Some(broker.ca_file());
    section.retry = Retry {
        first: Duration::from_millis(20),
        longest: Duration::from_millis(50),
        ..Retry::default()
    };
    section
}

async fn log(rig: &Rig) -> Vec<Delivery> {
    let list: DeliveryList = rig.client.get(&path::webhook_deliveries("hall")).await;
    list.deliveries
}

/// Waits until the newest message has come to this.
async fn settled(rig: &Rig, wanted: impl Fn(&Delivery) -> bool) -> Delivery {
    for _ in 0..12_000 {
        if let Some(delivery) = log(rig).await.into_iter().next()
            && wanted(&delivery)
        {
            return delivery;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    panic!("it has come to nothing: {:#?}", log(rig).await)
}

fn message(payload: &str) -> WebhookMessage {
    serde_json::from_str(payload).unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn messages_and_states_are_published() {
    let Some(mut broker) = Broker::new() else {
        return;
    };
    broker.start();
    let listener = broker.listen(None);
    let folder = tempfile::tempdir().unwrap();
    let hall = section(folder.path(), &broker);
    let rig = Rig::start(folder, |config| config.mqtt = vec![hall]).await;
    assert_eq!(listener.on("lab/relief/status").payload, "online");
    let state = listener.on("lab/relief/scanners/scanner/state");
    let state: ScannerState = serde_json::from_str(&state.payload).unwrap();
    assert_eq!((state.name.as_str(), state.scan), ("scanner", None));
    let (scan, job) = rig.scan_to_result("roof").await;
    let told = message(&listener.on("lab/relief/scan-ended").payload);
    assert_eq!(told.event, WebhookEvent::ScanEnded);
    assert_eq!(told.data.scan.unwrap().id, scan.id);
    let told = message(&listener.on("lab/relief/job-done").payload);
    assert_eq!(told.data.job.unwrap().id, job.id);
    let tested: Delivery = rig.client.ask(&path::webhook_test("hall")).await;
    assert_eq!(tested.state, DeliveryState::Delivered, "{tested:?}");
    let told = message(&listener.on("lab/relief/test").payload);
    assert_eq!(told.data.webhook.as_deref(), Some("hall"));
    // Listeners hear of a message before the service hears that the broker has it.
    let is_waiting = |delivery: &Delivery| delivery.state == DeliveryState::Waiting;
    for _ in 0..3_000 {
        if !log(&rig).await.iter().any(is_waiting) {
            break;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    for delivery in log(&rig).await {
        assert_eq!(delivery.state, DeliveryState::Delivered);
        assert_eq!((delivery.attempts, &delivery.tried[0].error), (1, &None));
    }
    let list: WebhookList = rig.client.get(path::WEBHOOKS).await;
    let [hall] = list.webhooks.as_slice() else {
        panic!("{list:?}");
    };
    assert_eq!((hall.name.as_str(), hall.kind), ("hall", WebhookKind::Mqtt));
    assert_eq!(hall.url, format!("{}/lab/relief", broker.url()));
    // Whoever comes later finds how things stand, and no messages.
    let late = broker.listen(None);
    let status = late.on("status");
    assert!(status.retained && status.payload == "online", "{status:?}");
    assert!(late.on("/state").retained);
    // A reload makes another connection, which takes the place of the one before.
    let mut reloaded = config(rig.folder.path());
    reloaded.mqtt = vec![section(rig.folder.path(), &broker)];
    let _ = rig.daemon.reload(&reloaded);
    late.until("lab/relief/status", |payload| payload == "online");
    let tested: Delivery = rig.client.ask(&path::webhook_test("hall")).await;
    assert_eq!(tested.state, DeliveryState::Delivered, "{tested:?}");
    rig.daemon.shutdown().await;
    late.until("lab/relief/status", |payload| payload == "offline");
    // And that is what the broker keeps.
    assert_eq!(broker.listen(None).on("status").payload, "offline");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_not_acknowledged_is_not_delivered() {
    let (port, sent) = mute();
    let mut hall = MqttConfig::new("hall", &format!("mqtt://127.0.0.1:{port}"));
    hall.topic_prefix = Some("lab".into());
    hall.timeout_ms = 3_000;
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::start(folder, |config| config.mqtt = vec![hall]).await;
    let tested: Delivery = rig.client.ask(&path::webhook_test("hall")).await;
    assert_eq!(tested.state, DeliveryState::GivenUp);
    assert_eq!(
        tested.tried[0].error,
        Some(format!(
            "127.0.0.1:{port} did not answer within 3000 ms (timeout_ms)"
        ))
    );
    rig.daemon.shutdown().await;
    // It was published all the same, and the farewell after it.
    let mut all = Vec::new();
    let holds = |all: &[u8], words: &[u8]| all.windows(words.len()).any(|part| part == words);
    while !holds(&all, b"offline") {
        all.extend(sent.recv_timeout(Duration::from_secs(60)).unwrap());
    }
    assert!(holds(&all, b"lab/test"));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_broker_refuses_is_told() {
    let Some(mut broker) = Broker::new() else {
        return;
    };
    broker.start();
    let folder = tempfile::tempdir().unwrap();
    let right = section(folder.path(), &broker);
    let mut stranger = MqttConfig {
        name: "stranger".into(),
        password_file: Some(folder.path().join("wrong")),
        ..right.clone()
    };
    write_secret(&folder.path().join("wrong"), "guess");
    let mut machine = MqttConfig {
        name: "machine".into(),
        ca_file: None,
        ..right.clone()
    };
    let mut name = MqttConfig {
        name: "name".into(),
        url: format!("mqtts://127.0.0.1:{}", broker.port),
        ..right
    };
    for own in [&mut stranger, &mut machine, &mut name] {
        own.topic_prefix = Some(format!("relief/{}", own.name));
    }
    let all = vec![stranger, machine, name];
    let rig = Rig::start(folder, |config| config.mqtt = all).await;
    for (name, told) in [
        ("stranger", "see to username and password_file"),
        ("machine", "is of no authority that is trusted here"),
        ("name", "is for another name"),
    ] {
        let tested: Delivery = rig.client.ask(&path::webhook_test(name)).await;
        assert_eq!(tested.state, DeliveryState::GivenUp, "{name}");
        let error = tested.tried[0].error.as_deref().unwrap();
        assert!(error.contains(told), "{name}: {error}");
        assert!(!error.contains("guess"), "{error}");
    }
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn messages_wait_for_a_broker_that_is_away() {
    let Some(mut broker) = Broker::new() else {
        return;
    };
    broker.start();
    broker.subscribe("archive");
    let folder = tempfile::tempdir().unwrap();
    let mut hall = section(folder.path(), &broker);
    hall.events = vec![WebhookEvent::JobDone];
    let rig = Rig::start(folder, |config| config.mqtt = vec![hall]).await;
    // The connection is there, and then lost.
    let first: Delivery = rig.client.ask(&path::webhook_test("hall")).await;
    assert_eq!(first.state, DeliveryState::Delivered, "{first:?}");
    broker.stop();
    let (_, job) = rig.scan_to_result("roof").await;
    let waits = settled(&rig, |delivery| delivery.attempts >= 2).await;
    assert_eq!(waits.state, DeliveryState::Waiting);
    let error = waits.tried.last().unwrap().error.clone().unwrap();
    assert!(error.contains("refuses the connection"), "{error}");
    broker.start();
    settled(&rig, |d| d.state == DeliveryState::Delivered).await;
    let archive = broker.listen(Some("archive"));
    let told = message(&archive.on("lab/relief/job-done").payload);
    assert_eq!(told.data.job.unwrap().id, job.id);
    // A broker that was away is told again how the scanner is.
    let late = broker.listen(None);
    late.until("lab/relief/status", |payload| payload == "online");
    rig.daemon.shutdown().await;
}

#[test]
fn the_broker_tells_of_a_service_that_was_killed() {
    let Some(mut broker) = Broker::new() else {
        return;
    };
    broker.start();
    let listener = broker.listen(None);
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    write_secret(&place("password"), PASSWORD.trim_end_matches('\n'));
    let text = format!(
        "[service]\nsocket = {:?}\nstate_dir = {:?}\nspool_dir = {:?}\n[scanner]\nport = {:?}\n\
         [[mqtt]]\nname = \"hall\"\nurl = {:?}\nusername = {USER:?}\npassword_file = {:?}\n\
         ca_file = {:?}\n",
        place("reliefd.sock"),
        place("state"),
        place("spool"),
        place("no-scanner"),
        broker.url(),
        place("password"),
        broker.ca_file(),
    );
    fs::write(place("reliefd.toml"), text).unwrap();
    let mut service = Command::new(env!("CARGO_BIN_EXE_reliefd"))
        .arg("--config")
        .arg(place("reliefd.toml"))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let online = listener.on("/status");
    assert_eq!(online.payload, "online");
    assert!(online.topic.starts_with("relief/"), "{online:?}");
    let state = listener.until("/scanners/scanner/state", |payload| {
        payload.contains(r#""link":"trouble""#)
    });
    assert!(!state.retained);
    service.kill().unwrap();
    service.wait().unwrap();
    let offline = listener.on("/status");
    assert_eq!(
        (offline.topic, offline.payload),
        (online.topic, "offline".into())
    );
    let late = broker.listen(None);
    let kept = late.on("/status");
    assert!(kept.retained && kept.payload == "offline", "{kept:?}");
}
