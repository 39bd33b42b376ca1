//! Webhooks: receivers are told, signed, again and again, and nobody waits for them.

mod failures;
pub(crate) mod receiver;
pub(crate) mod tls;

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::sync::{Arc, Barrier};
use std::time::Duration;

use relief_api::{
    Delivery, DeliveryList, DeliveryState, Job, Scan, ScanState, ScannerLink, WebhookEvent,
    WebhookList, path,
};
use reliefd::config::{Retry, WebhookConfig};
use scanner_driver::protocol::Faults;
use scanner_driver::{Pause, ScannerError};

use crate::client::Client;
use crate::rig::{Rig, config, ended};
use receiver::{Answer, Receiver};

const SECRET: &str = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw";
const OTHER_SECRET: &str = "whsec_AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA=";

pub(crate) fn write_secret(file: &Path, secret: &str) {
    fs::write(file, secret).unwrap();
    fs::set_permissions(file, fs::Permissions::from_mode(0o600)).unwrap();
}

/// A webhook with a secret in the folder, which tries again at once.
pub(crate) fn webhook(folder: &Path, name: &str, url: &str) -> WebhookConfig {
    let file = folder.join("secret");
    write_secret(&file, SECRET);
    let mut webhook = WebhookConfig::new(name, url, file);
    webhook.retry = Retry {
        first: Duration::from_millis(20),
        longest: Duration::from_millis(50),
        ..Retry::default()
    };
    webhook
}

async fn start(change: impl FnOnce(&Path) -> Vec<WebhookConfig>) -> Rig {
    let folder = tempfile::tempdir().unwrap();
    let webhooks = change(folder.path());
    Rig::start(folder, |config| config.webhooks = webhooks).await
}

/// A service with one webhook, which is told to this receiver.
async fn telling(receiver: &Receiver) -> Rig {
    start(|folder| vec![webhook(folder, "lab", &receiver.url())]).await
}

async fn log(rig: &Rig) -> Vec<Delivery> {
    let list: DeliveryList = rig.client.get(&path::webhook_deliveries("lab")).await;
    list.deliveries
}

/// Waits until the newest message but so many has come to this.
async fn settled(rig: &Rig, back: usize, wanted: impl Fn(&Delivery) -> bool) -> Delivery {
    // Far longer than anything takes that should happen.
    for _ in 0..12_000 {
        if let Some(delivery) = log(rig).await.into_iter().nth(back)
            && wanted(&delivery)
        {
            return delivery;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    panic!("it has come to nothing: {:#?}", log(rig).await)
}

async fn until_delivered(rig: &Rig) -> Delivery {
    settled(rig, 0, |d| d.state == DeliveryState::Delivered).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_and_its_job_are_told_and_signed() {
    let receiver = Receiver::new([]);
    let rig = start(|folder| {
        let url = format!("{}?key=7", receiver.url());
        vec![webhook(folder, "lab", &url)]
    })
    .await;
    let (scan, job) = rig.scan_to_result("roof").await;
    let first = receiver.next();
    assert_eq!(first.request, "POST /relief?key=7 HTTP/1.1");
    assert_eq!(first.header("content-type"), "application/json");
    assert!(first.header("user-agent").starts_with("reliefd/"));
    assert!(first.is_signed_with(SECRET) && !first.is_signed_with(OTHER_SECRET));
    let told = first.message();
    assert_eq!(told.event, WebhookEvent::ScanEnded);
    assert_eq!(told.data.scanner.as_deref(), Some("scanner"));
    assert_eq!(
        told.data.scan.as_ref(),
        Some(&scan_as_it_is(&rig, &scan).await)
    );
    assert_eq!((told.data.job, told.data.status), (None, None));

    let second = receiver.next();
    assert!(second.is_signed_with(SECRET));
    assert_ne!(first.id(), second.id());
    let told = second.message();
    assert_eq!(told.event, WebhookEvent::JobDone);
    let now: Job = rig.client.get(&path::job(job.id)).await;
    assert_eq!(told.data.job, Some(now));
    assert_eq!(told.data.scan.unwrap().id, scan.id);
    receiver.is_quiet();

    until_delivered(&rig).await;
    let reply = rig.client.request("GET", path::WEBHOOKS, None).await;
    let text = String::from_utf8(reply.body).unwrap();
    assert!(
        !text.contains("whsec_") && !text.contains("key=7") && !text.contains("/relief"),
        "{text}"
    );
    let list: WebhookList = serde_json::from_str(&text).unwrap();
    let [lab] = list.webhooks.as_slice() else {
        panic!("{text}");
    };
    let shown = format!("http://{}/...", receiver.address);
    assert_eq!((lab.name.as_str(), &lab.url), ("lab", &shown));
    assert_eq!((lab.waiting, lab.dropped), (0, 0));
    assert_eq!(lab.latest.as_ref().unwrap().id, second.id());
    let log = log(&rig).await;
    assert_eq!([&log[0].id, &log[1].id], [second.id(), first.id()]);
    for delivery in &log {
        assert_eq!((delivery.attempts, delivery.tried.len()), (1, 1));
        assert_eq!(delivery.tried[0].status, Some(204));
        assert_eq!(delivery.tried[0].error, None);
        assert_eq!(delivery.about.as_ref(), Some(&scan.id));
    }
    rig.daemon.shutdown().await;
}

/// The scan as the API gives it.
async fn scan_as_it_is(rig: &Rig, scan: &Scan) -> Scan {
    rig.client.get(&path::scan(&scan.id)).await
}

#[tokio::test(flavor = "multi_thread")]
async fn trouble_is_told_to_those_who_want_to_hear_of_it() {
    let (all, jobs) = (Receiver::new([]), Receiver::new([]));
    let rig = start(|folder| {
        let mut hears_all = webhook(folder, "lab", &all.url());
        hears_all.events = WebhookEvent::CHOICES.to_vec();
        let mut hears_jobs = webhook(folder, "jobs", &jobs.url());
        hears_jobs.events = vec![WebhookEvent::JobDone, WebhookEvent::JobFailed];
        vec![hears_all, hears_jobs]
    })
    .await;
    let told = |event: WebhookEvent| {
        let message = all.next().message();
        assert_eq!(message.event, event, "{message:?}");
        message.data
    };
    // A pause that ends by itself is nobody's business; one that waits for a person is.
    let pause = |needs_person: bool| Pause {
        cause: ScannerError::Fault(Faults::INTERLOCK),
        needs_person,
        columns: 5,
    };
    for needs_person in [false, true] {
        let mut events = rig.client.events().await;
        rig.scanner.pause_after(5, pause(needs_person));
        let scan = rig.start_scan("paused").await;
        let paused = |event: &relief_api::Event| match event {
            relief_api::Event::Scan(scan) if scan.state == ScanState::Paused => Some(()),
            _ => None,
        };
        events.until(paused).await;
        let trouble = told(WebhookEvent::ScannerTrouble).status.unwrap();
        assert_eq!(trouble.link, ScannerLink::Trouble);
        assert!(trouble.problem.unwrap().contains("interlock open"));
        let stopped = told(WebhookEvent::Interlock).status.unwrap();
        assert!(stopped.problem.unwrap().contains("interlock open"));
        if needs_person {
            let paused = told(WebhookEvent::ScanPaused).scan.unwrap();
            assert_eq!((&paused.id, paused.state), (&scan.id, ScanState::Paused));
            assert!(paused.reason.unwrap().contains("relief resume"));
        }
        let _: Scan = rig.client.ask(&path::scan_resume(&scan.id)).await;
        ended(&mut events, &scan.id).await;
        assert_eq!(
            told(WebhookEvent::ScanEnded).scan.unwrap().state,
            ScanState::Complete
        );
        assert_eq!(told(WebhookEvent::JobDone).scan.unwrap().id, scan.id);
        assert_eq!(jobs.next().message().event, WebhookEvent::JobDone);
    }
    // Nor is one that somebody has asked for: who has done so knows.
    let mut events = rig.client.events().await;
    rig.scanner.allow(5);
    let scan = rig.start_scan("on request").await;
    let five = |event: &relief_api::Event| {
        matches!(event, relief_api::Event::Column { columns: 5, .. }).then_some(())
    };
    events.until(five).await;
    let _: Scan = rig.client.ask(&path::scan_pause(&scan.id)).await;
    let paused = |event: &relief_api::Event| match event {
        relief_api::Event::Scan(scan) => (scan.state == ScanState::Paused).then_some(()),
        _ => None,
    };
    events.until(paused).await;
    rig.scanner.allow_all();
    let _: Scan = rig.client.ask(&path::scan_resume(&scan.id)).await;
    ended(&mut events, &scan.id).await;
    assert_eq!(told(WebhookEvent::ScanEnded).scan.unwrap().id, scan.id);
    assert_eq!(told(WebhookEvent::JobDone).scan.unwrap().id, scan.id);
    assert_eq!(jobs.next().message().event, WebhookEvent::JobDone);
    let mut events = rig.client.events().await;
    rig.scanner.fault_after(3);
    let scan = rig.start_scan("broken").await;
    ended(&mut events, &scan.id).await;
    let scan = told(WebhookEvent::ScanEnded).scan.unwrap();
    assert_eq!((scan.state, scan.columns), (ScanState::Failed, 3));
    let status = told(WebhookEvent::ScannerTrouble).status.unwrap();
    assert!(status.problem.unwrap().contains("table stalled"));
    // That is no interlock.
    all.is_quiet();
    jobs.is_quiet();

    let few = serde_json::json!({"settings": {"regrid.roi_x_mm": [900, 901]}});
    let _: Job = rig.client.post(&path::scan_rerun(&scan.id), &few).await;
    let failed = jobs.next().message();
    assert_eq!(failed.event, WebhookEvent::JobFailed);
    assert!(failed.data.job.unwrap().error.is_some());
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_not_delivered_is_after_a_restart() {
    let receiver = Receiver::new([Answer::Status(503, "")]);
    let patient = |folder: &Path| {
        let mut webhook = webhook(folder, "lab", &receiver.url());
        // Nobody waits for that here.
        webhook.retry = Retry::default();
        webhook.events = vec![WebhookEvent::JobDone];
        vec![webhook]
    };
    let rig = start(patient).await;
    rig.scan_to_result("roof").await;
    let before = receiver.next();
    let waits = settled(&rig, 0, |delivery| delivery.attempts == 1).await;
    assert_eq!(waits.state, DeliveryState::Waiting);
    assert!(waits.next_attempt_at.as_ref() > Some(&waits.tried[0].at));
    let webhooks = patient(rig.folder.path());
    let rig = rig.restart_with(|config| config.webhooks = webhooks).await;
    let after = receiver.next();
    assert_eq!((after.id(), &after.body), (before.id(), &before.body));
    assert!(after.is_signed_with(SECRET));
    let delivered = until_delivered(&rig).await;
    assert_eq!(
        (delivered.id.as_str(), delivered.attempts),
        (before.id(), 2)
    );
    assert_eq!(delivered.tried[0], waits.tried[0]);

    // What a webhook was to hear that is not there any more, nobody hears.
    receiver.will(Answer::Status(503, ""));
    rig.scan_to_result("again").await;
    receiver.next();
    let rig = rig.restart().await;
    let list: WebhookList = rig.client.get(path::WEBHOOKS).await;
    assert_eq!(list, WebhookList::default());
    let webhooks = patient(rig.folder.path());
    let rig = rig.restart_with(|config| config.webhooks = webhooks).await;
    assert_eq!(log(&rig).await, []);
    receiver.is_quiet();
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_test_tells_what_came_back() {
    let receiver = Receiver::new([]);
    let rig = telling(&receiver).await;
    let test = path::webhook_test("lab");
    let right: Delivery = rig.client.ask(&test).await;
    let got = receiver.next();
    assert!(got.is_signed_with(SECRET));
    let message = got.message();
    assert_eq!(message.event, WebhookEvent::Test);
    assert_eq!(message.data.webhook.as_deref(), Some("lab"));
    assert_eq!(
        (right.id.as_str(), right.state),
        (got.id(), DeliveryState::Delivered)
    );
    assert_eq!(right.tried[0].status, Some(204));

    receiver.will(Answer::Status(401, "{\"error\":\r\n\"bad signature\"}"));
    let wrong: Delivery = rig.client.ask(&test).await;
    assert_eq!((wrong.state, wrong.attempts), (DeliveryState::GivenUp, 1));
    let tried = &wrong.tried[0];
    assert_eq!(tried.status, Some(401));
    assert_eq!(
        tried.answer.as_deref(),
        Some("{\"error\": \"bad signature\"}")
    );
    let error = tried.error.as_deref().unwrap();
    assert!(error.contains("has it the same secret"), "{error}");
    receiver.next();
    // It is not tried again, and in the log.
    receiver.is_quiet();
    assert_eq!(log(&rig).await, [wrong, right]);

    let ask = async |method: &str, path: String| {
        let reply = rig.client.request(method, &path, None).await;
        reply.problem()
    };
    let problem = ask("POST", path::webhook_test("bal")).await;
    assert_eq!(
        (problem.status, problem.kind.as_str()),
        (404, "no-such-webhook")
    );
    assert_eq!(problem.detail, "there is no receiver bal; there is lab");
    let problem = ask("GET", path::webhook_deliveries("bal")).await;
    assert_eq!(problem.status, 404);

    // One at a time, as each may keep a thread.
    let held = Arc::new(Barrier::new(2));
    receiver.will(Answer::Held(Arc::clone(&held)));
    let hanging = tokio::spawn({
        let (client, test) = (Client::new(rig.daemon.socket()), test.clone());
        async move { client.request("POST", &test, None).await.status }
    });
    receiver.next();
    let refused = rig.client.request("POST", &test, None).await;
    held.wait();
    let problem = refused.problem();
    assert_eq!(hanging.await.unwrap(), 200);
    assert_eq!(
        (problem.status, problem.kind.as_str()),
        (409, "webhook-busy")
    );
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_reload_takes_over_webhooks_and_their_secrets() {
    let (first, second) = (Receiver::new([]), Receiver::new([Answer::Close; 0]));
    let rig = telling(&first).await;
    let reload = |webhooks: Vec<WebhookConfig>| {
        let mut config = config(rig.folder.path());
        config.webhooks = webhooks;
        rig.daemon.reload(&config)
    };
    let folder = rig.folder.path();
    let mut lab = webhook(folder, "lab", &first.url());
    let other = webhook(folder, "other", &second.url());
    let outcome = reload(vec![lab.clone(), other.clone()]);
    assert_eq!(outcome.applied, ["webhooks"]);
    assert_eq!(outcome.needs_restart, [] as [&str; 0]);
    rig.scan_to_result("roof").await;
    for receiver in [&first, &second] {
        for event in [WebhookEvent::ScanEnded, WebhookEvent::JobDone] {
            assert_eq!(receiver.next().message().event, event);
        }
    }
    // The same keys, and another secret in the file.
    write_secret(&folder.join("secret"), OTHER_SECRET);
    lab.secret_file = folder.join("secret");
    assert_eq!(reload(vec![lab, other]).applied, [] as [&str; 0]);
    let test = path::webhook_test("lab");
    let _: Delivery = rig.client.ask(&test).await;
    assert!(first.next().is_signed_with(OTHER_SECRET));
    // A secret that is gone changes nothing.
    let mut gone = webhook(folder, "lab", &second.url());
    gone.secret_file = folder.join("gone");
    reload(vec![gone]);
    let _: Delivery = rig.client.ask(&test).await;
    assert!(first.next().is_signed_with(OTHER_SECRET));
    reload(Vec::new());
    let reply = rig.client.request("POST", &test, None).await;
    assert_eq!(
        reply.problem().detail,
        "there is no receiver lab; there are none"
    );
    rig.scan_to_result("unheard").await;
    first.is_quiet();
    second.is_quiet();
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_service_does_not_start_without_a_secret() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(folder.path());
    let mut webhook = webhook(folder.path(), "lab", "http://127.0.0.1:9/");
    webhook.secret_file = folder.path().join("none");
    config.webhooks = vec![webhook];
    let scanner = crate::fake::FakeScanner::new();
    let error = reliefd::Daemon::start_with(config, scanner)
        .await
        .unwrap_err();
    let told = error.to_string();
    assert!(
        told.starts_with("webhook lab: cannot read the secret in"),
        "{told}"
    );
}
