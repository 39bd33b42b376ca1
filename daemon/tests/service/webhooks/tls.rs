//! Receivers behind https: whom the service trusts.

use std::fs;
use std::sync::Arc;

use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, IsCa, KeyPair};
use relief_api::{Delivery, DeliveryState, path};
use rustls::pki_types::PrivatePkcs8KeyDer;
use rustls::{ServerConfig, ServerConnection, StreamOwned, crypto::ring};

use super::receiver::{Answer, Receiver, Wrap, any_port};
use super::{SECRET, start, webhook};

/// The authority of a lab.
pub(crate) fn authority() -> CertifiedIssuer<'static, KeyPair> {
    let mut params = CertificateParams::new([]).unwrap();
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    CertifiedIssuer::self_signed(params, KeyPair::generate().unwrap()).unwrap()
}

/// A server whose certificate is for this name.
pub(crate) fn server_config(
    authority: &CertifiedIssuer<'static, KeyPair>,
    name: &str,
) -> Arc<ServerConfig> {
    let key = KeyPair::generate().unwrap();
    let params = CertificateParams::new([name.to_owned()]).unwrap();
    let certificate = params.signed_by(&key, authority).unwrap();
    let key = PrivatePkcs8KeyDer::from(key.serialize_der());
    let config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_no_client_auth()
        .with_single_cert(vec![certificate.der().clone()], key.into())
        .unwrap();
    Arc::new(config)
}

/// A receiver behind https whose certificate is for this name.
fn receiver(authority: &CertifiedIssuer<'static, KeyPair>, name: &str) -> Receiver {
    let config = server_config(authority, name);
    let wrap: Wrap = Box::new(move |stream| {
        let connection = ServerConnection::new(Arc::clone(&config)).unwrap();
        Box::new(StreamOwned::new(connection, stream))
    });
    Receiver::speaking(any_port(), [], wrap)
}

#[tokio::test(flavor = "multi_thread")]
async fn certificates_are_checked() {
    let (lab, stranger) = (authority(), authority());
    let right = receiver(&lab, "127.0.0.1");
    let wrong_name = receiver(&lab, "lab.example");
    let plain = Receiver::new([Answer::Close]);
    let https = |receiver: &Receiver| receiver.url().replacen("http:", "https:", 1);
    let rig = start(|folder| {
        let of = |name: &str, url: &str, trusted: Option<&CertifiedIssuer<'static, KeyPair>>| {
            let mut webhook = webhook(folder, name, url);
            webhook.ca_file = trusted.map(|authority| {
                let file = folder.join(format!("{name}.pem"));
                fs::write(&file, authority.pem()).unwrap();
                file
            });
            webhook
        };
        vec![
            of("right", &https(&right), Some(&lab)),
            of("stranger", &https(&right), Some(&stranger)),
            of("machine", &https(&right), None),
            of("name", &https(&wrong_name), Some(&lab)),
            of("plain", &https(&plain), Some(&lab)),
        ]
    })
    .await;
    let test = async |name: &str| -> Delivery { rig.client.ask(&path::webhook_test(name)).await };
    assert_eq!(test("right").await.state, DeliveryState::Delivered);
    assert!(right.next().is_signed_with(SECRET));
    for (name, told) in [
        (
            "stranger",
            "is of no authority that is trusted here: set ca_file",
        ),
        (
            "machine",
            "is of no authority that is trusted here: set ca_file",
        ),
        ("name", "is for another name"),
        ("plain", "127.0.0.1"),
    ] {
        let tested = test(name).await;
        assert_eq!(tested.state, DeliveryState::GivenUp, "{name}");
        let error = tested.tried[0].error.as_deref().unwrap();
        assert!(error.contains(told), "{name}: {error}");
    }
    right.is_quiet();
    wrong_name.is_quiet();
    rig.daemon.shutdown().await;
}
