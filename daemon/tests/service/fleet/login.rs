//! How a bench and a worker show servers who they are.

use std::fs::{Permissions, set_permissions, write};
use std::os::unix::fs::PermissionsExt;

use rcgen::{CertificateParams, KeyPair};
use relief_api::{Fleet, JobState, path};

use super::*;
use crate::webhooks::tls::authority;

const TOKEN: &str = "a token of a test";
const LINES: &str = "authorization { token: \"a token of a test\" }\n\
    tls { cert_file: \"FOLDER/server.pem\", key_file: \"FOLDER/server.key\", \
    ca_file: \"FOLDER/ca.pem\", verify: true }";

/// A server that asks for a certificate of the lab and for the token.
fn locked() -> Option<Nats> {
    Nats::secured(LINES, |folder| {
        let lab = authority();
        write(folder.join("ca.pem"), lab.pem()).unwrap();
        for (name, of) in [("server", "127.0.0.1"), ("client", "bench-1")] {
            let key = KeyPair::generate().unwrap();
            let params = CertificateParams::new([of.to_owned()]).unwrap();
            let certificate = params.signed_by(&key, &lab).unwrap();
            let place = |kind: &str| folder.join(format!("{name}.{kind}"));
            write(place("pem"), certificate.pem()).unwrap();
            write(place("key"), key.serialize_pem()).unwrap();
            set_permissions(place("key"), Permissions::from_mode(0o600)).unwrap();
        }
        write(folder.join("token"), TOKEN).unwrap();
        set_permissions(folder.join("token"), Permissions::from_mode(0o600)).unwrap();
    })
}

/// All that the server asks for.
fn known(nats: &Nats, config: &mut NatsConfig) {
    config.token_file = Some(nats.file("token"));
    config.ca_file = Some(nats.file("ca.pem"));
    config.certificate_file = Some(nats.file("client.pem"));
    config.key_file = Some(nats.file("client.key"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_asks_for_certificates_and_a_token_is_given_both() {
    let Some(nats) = locked() else { return };
    let own = acquires(&nats);
    let all = |config: &mut Config| {
        own(config);
        known(&nats, &mut config.nats);
    };
    let rig = Rig::start(tempfile::tempdir().unwrap(), &all).await;
    let worker = Hired::with(&nats, "hand-1", |config| known(&nats, config));
    let mut events = rig.client.events().await;
    rig.start_scan("part").await;
    assert_eq!(job_over(&mut events, &rig, 1).await.state, JobState::Done);
    assert_eq!(worker.dismiss(), 1);
    // Without the token it is not let in, and says so.
    let rig = rig
        .restart_with(|config| {
            all(config);
            config.nats.token_file = None;
        })
        .await;
    let told = until("what is wrong", async || {
        let fleet: Fleet = rig.client.get(path::FLEET).await;
        fleet.problem.filter(|problem| !problem.contains("yet"))
    })
    .await;
    assert!(told.to_lowercase().contains("authorization"), "{told}");
    assert!(!told.contains(TOKEN), "{told}");
    rig.daemon.shutdown().await;
}
