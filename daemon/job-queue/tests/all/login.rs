//! Who may connect, and what is said to who may not.

use std::fs;
use std::sync::Arc;
use std::time::{Duration, Instant};

use job_queue::jetstream::{JetStreamQueue, Login, Options, Secret};
use job_queue::{JobQueue, QueueError};
use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, DnType, IsCa, KeyPair};

use crate::bench::{done, order, take};
use crate::server::{self, LIMIT, RUNTIME, connect, free_port, options};
use nats_child::Server;

pub(crate) fn works(options: &Options) {
    let queue = connect(options);
    queue.offer(&order(1)).unwrap();
    take(&queue, "w").settle(&done()).unwrap();
}

/// Why it does not connect.
pub(crate) fn refusal(options: &Options) -> QueueError {
    let queue = JetStreamQueue::new(options.clone(), RUNTIME.handle().clone()).unwrap();
    let begun = Instant::now();
    loop {
        let error = queue.wait_connected(Duration::ZERO).unwrap_err();
        if !error.to_string().contains("not connected yet") {
            let offered = queue.offer(&order(1)).unwrap_err();
            assert_eq!(offered.to_string(), error.to_string());
            return error;
        }
        assert!(begun.elapsed() < LIMIT);
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_token_is_asked_for() {
    let Some(server) = server::configured("authorization { token: \"hunter2\" }") else {
        return;
    };
    let mut options = options(&server.url());
    options.login = Login::Token(Secret::new("hunter2"));
    works(&options);
    for login in [Login::Token(Secret::new("hunter3")), Login::None] {
        options.login = login;
        let refused = refusal(&options);
        assert!(matches!(refused, QueueError::Refused(_)), "{refused}");
        let told = refused.to_string();
        assert!(
            told.contains("does not accept the login") && told.contains("compare the token"),
            "{told}"
        );
        assert!(!told.contains("hunter3"), "{told}");
    }
}

#[test]
fn an_nkey_is_asked_for() {
    let user = nkeys::KeyPair::new_user();
    let lines = format!(
        "authorization {{ users [ {{ nkey: {} }} ] }}",
        user.public_key()
    );
    let Some(server) = server::configured(&lines) else {
        return;
    };
    let mut options = options(&server.url());
    options.login = Login::Nkey(Secret::new(user.seed().unwrap()));
    works(&options);
    let other = nkeys::KeyPair::new_user().seed().unwrap();
    options.login = Login::Nkey(Secret::new(other));
    assert!(matches!(refusal(&options), QueueError::Refused(_)));
}

/// A server with a certificate of a laboratory's authority, which asks for one of the client.
fn with_tls() -> Option<(Arc<Server>, Options)> {
    nats_child::is_wanted().then_some(())?;
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let mut params = CertificateParams::new([]).unwrap();
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    params.distinguished_name.push(DnType::CommonName, "lab");
    let lab = CertifiedIssuer::self_signed(params, KeyPair::generate().unwrap()).unwrap();
    fs::write(place("ca.pem"), lab.pem()).unwrap();
    for name in ["localhost", "client"] {
        let key = KeyPair::generate().unwrap();
        let params = CertificateParams::new([name.to_owned()]).unwrap();
        let certificate = params.signed_by(&key, &lab).unwrap();
        fs::write(place(&format!("{name}.pem")), certificate.pem()).unwrap();
        fs::write(place(&format!("{name}.key")), key.serialize_pem()).unwrap();
    }
    let port = free_port();
    let mut options = options(&format!("tls://localhost:{port}"));
    options.ca_file = Some(place("ca.pem"));
    options.certificate = Some((place("client.pem"), place("client.key")));
    let lines = "tls { cert_file: \"FOLDER/localhost.pem\", key_file: \"FOLDER/localhost.key\", \
                 ca_file: \"FOLDER/ca.pem\", verify: true }";
    Some((server::in_folder(folder, port, lines), options))
}

#[test]
fn tls_knows_both_sides() {
    let Some((_server, mut options)) = with_tls() else {
        return;
    };
    works(&options);
    let certificate = options.certificate.take();
    let refused = refusal(&options);
    assert!(
        refused.to_string().contains("NATS at tls://localhost"),
        "{refused}"
    );
    options.certificate = certificate;
    // Whoever is not of the laboratory is not believed.
    let stranger = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ca.pem");
    fs::write(&file, stranger.cert.pem()).unwrap();
    options.ca_file = Some(file);
    let refused = refusal(&options).to_string();
    assert!(refused.contains("certificate"), "{refused}");
}

#[test]
fn nothing_goes_without_tls_where_it_is_required() {
    let Some(server) = server::start() else {
        return;
    };
    let mut options = options(&server.url());
    options.tls_required = true;
    assert!(matches!(refusal(&options), QueueError::Away(_)));
}

#[test]
fn a_server_may_come_later() {
    let port = free_port();
    let mut options = options(&format!("nats://127.0.0.1:{port}"));
    options.name = "early".to_owned();
    let queue = JetStreamQueue::new(options, RUNTIME.handle().clone()).unwrap();
    let begun = Instant::now();
    let away = queue.offer(&order(1)).unwrap_err();
    assert!(matches!(away, QueueError::Away(_)), "{away}");
    assert!(
        begun.elapsed() < Duration::from_secs(2),
        "it is said at once"
    );
    if !nats_child::is_wanted() {
        return;
    }
    let _server = server::on(port, "");
    queue.wait_connected(LIMIT).unwrap();
    queue.offer(&order(1)).unwrap();
    take(&queue, "w").settle(&done()).unwrap();
}
