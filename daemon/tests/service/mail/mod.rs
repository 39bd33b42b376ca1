//! Mails: people are written to, over TLS, again until the server takes them.

mod server;

use std::path::Path;
use std::time::Duration;

use rcgen::{CertifiedIssuer, KeyPair};
use relief_api::{
    Delivery, DeliveryList, DeliveryState, WebhookEvent, WebhookKind, WebhookList, path,
};
use reliefd::config::{MailConfig, MailSecurity, Retry};

use crate::rig::Rig;
use crate::webhooks::tls::{authority, server_config};
use crate::webhooks::write_secret;
use server::Server;

const PASSWORD: &str = "hunter2";

/// A section for this server, with what it needs in the folder.
fn section(
    folder: &Path,
    name: &str,
    server: &Server,
    lab: &CertifiedIssuer<'static, KeyPair>,
) -> MailConfig {
    let (password, ca) = (folder.join("password"), folder.join("ca.pem"));
    write_secret(&password, PASSWORD);
    std::fs::write(&ca, lab.pem()).unwrap();
    let to = ["Ada <ada@lab.example>", "night@lab.example"];
    let mut section = MailConfig::new(name, "localhost", "Bench <bench@lab.example>", &to);
    section.port = Some(server.port);
    section.username = Some("bench".into());
    section.password_file = Some(password);
    section.ca_file = Some(ca);
    section.retry = Retry {
        first: Duration::from_millis(20),
        longest: Duration::from_millis(50),
        ..Retry::default()
    };
    section
}

#[tokio::test(flavor = "multi_thread")]
async fn people_are_written_to_until_the_server_takes_it() {
    let lab = authority();
    let server = Server::new(Some(server_config(&lab, "localhost")));
    server.refuse("451 greylisted, come back");
    let folder = tempfile::tempdir().unwrap();
    let mut lab = section(folder.path(), "lab", &server, &lab);
    lab.events = vec![WebhookEvent::JobDone];
    let rig = Rig::start(folder, |config| {
        config.mail = vec![lab];
        config.service.public_url = Some("https://bench.lab.example/".into());
    })
    .await;
    let (_, job) = rig.scan_to_result("roof").await;
    let mail = server.next();
    assert!(mail.is_secure);
    assert_eq!(mail.login, Some(("bench".into(), PASSWORD.into())));
    assert!(
        mail.from.starts_with("FROM:<bench@lab.example>"),
        "{mail:?}"
    );
    let to = mail.to.join(" ");
    assert!(
        to.contains("<ada@lab.example>") && to.contains("<night@lab.example>"),
        "{to}"
    );
    assert_eq!(mail.field("Subject"), "[Relief] roof: result ready");
    assert!(mail.field("From").contains("Bench"), "{mail:?}");
    // Long lines are folded on their way.
    let body = mail.body().replace("=\n", "").replace("=3D", "=");
    let directory = rig.daemon.spool_dir().join(&job.result);
    for part in [
        "The result of roof is ready.".to_owned(),
        format!("Its files are in {}", directory.display()),
        format!("relief fetch {}", job.result),
        format!("https://bench.lab.example/#/result/{}", job.result),
    ] {
        assert!(body.contains(&part), "{part}: {body}");
    }
    assert!(!mail.text.contains(PASSWORD), "{mail:?}");
    server.is_quiet();
    let list: DeliveryList = rig.client.get(&path::webhook_deliveries("lab")).await;
    let [delivery] = list.deliveries.as_slice() else {
        panic!("{list:?}");
    };
    assert_eq!(
        (delivery.state, delivery.attempts),
        (DeliveryState::Delivered, 2)
    );
    let error = delivery.tried[0].error.as_deref().unwrap();
    assert!(error.contains("takes no mail at present (451)"), "{error}");
    assert!(error.contains("greylisted"), "{error}");
    assert!(mail.field("Message-ID").contains(&delivery.id), "{mail:?}");
    let list: WebhookList = rig.client.get(path::WEBHOOKS).await;
    assert_eq!(list.webhooks[0].kind, WebhookKind::Mail);
    assert_eq!(list.webhooks[0].url, format!("localhost:{}", server.port));
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_mail_server_refuses_is_told() {
    let (lab, stranger) = (authority(), authority());
    let server = Server::new(Some(server_config(&lab, "localhost")));
    let plain = Server::new(None);
    let folder = tempfile::tempdir().unwrap();
    let right = section(folder.path(), "right", &server, &lab);
    let other = tempfile::tempdir().unwrap();
    let untrusted = section(other.path(), "untrusted", &server, &stranger);
    let mut name = section(folder.path(), "name", &server, &lab);
    name.server = "127.0.0.1".into();
    let downgraded = section(folder.path(), "downgraded", &plain, &lab);
    let mut wrong = section(folder.path(), "wrong", &server, &lab);
    wrong.password_file = Some(folder.path().join("wrong"));
    write_secret(&folder.path().join("wrong"), "guess");
    let mut here = section(folder.path(), "here", &plain, &lab);
    here.security = MailSecurity::None;
    here.ca_file = None;
    let all = vec![right, untrusted, name, downgraded, wrong, here];
    let rig = Rig::start(folder, |config| config.mail = all).await;
    let test = async |name: &str| -> Delivery { rig.client.ask(&path::webhook_test(name)).await };
    let right = test("right").await;
    assert_eq!(right.state, DeliveryState::Delivered, "{right:?}");
    assert_eq!(server.next().field("Subject"), "[Relief] test of right");
    let here = test("here").await;
    assert_eq!(here.state, DeliveryState::Delivered, "{here:?}");
    assert!(!plain.next().is_secure);
    server.refuse("550 no such user");
    for (name, told) in [
        (
            "right",
            "does not take mail from or to these addresses (550)",
        ),
        ("untrusted", "is of no authority that is trusted here"),
        ("name", "is for another name"),
        ("downgraded", "offers no STARTTLS"),
        ("wrong", "does not let the service in (535)"),
    ] {
        let tested = test(name).await;
        assert_eq!(tested.state, DeliveryState::GivenUp, "{name}");
        let error = tested.tried[0].error.as_deref().unwrap();
        assert!(error.contains(told), "{name}: {error}");
        assert!(!error.contains("guess"), "{error}");
    }
    // Nothing went in plain text to whoever offers no TLS.
    plain.is_quiet();
    server.is_quiet();
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_comes_to_no_end_holds_up_nobody() {
    let lab = authority();
    let server = Server::new(Some(server_config(&lab, "localhost")));
    server.refuse("");
    let folder = tempfile::tempdir().unwrap();
    let mut lab = section(folder.path(), "lab", &server, &lab);
    lab.timeout_ms = 3_000;
    let rig = Rig::start(folder, |config| config.mail = vec![lab]).await;
    let test = async || -> Delivery { rig.client.ask(&path::webhook_test("lab")).await };
    let endless = test().await;
    assert_eq!(endless.state, DeliveryState::GivenUp);
    assert_eq!(
        endless.tried[0].error,
        Some(format!(
            "localhost:{} had not taken the mail within 3000 ms (timeout_ms)",
            server.port
        ))
    );
    // The next is taken while that still goes on; on a machine with much to do, one after it.
    let mut next = test().await;
    for _ in 0..20 {
        if next.state == DeliveryState::Delivered {
            break;
        }
        next = test().await;
    }
    assert_eq!(next.state, DeliveryState::Delivered, "{next:?}");
    rig.daemon.shutdown().await;
}
