//! A server in operator mode, which knows its users by tokens that their accounts have signed.

use base64::Engine;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use job_queue::jetstream::{Login, Secret};
use nkeys::KeyPair;
use serde_json::{Value, json};

use crate::login::{refusal, works};
use crate::server::{configured, options};

/// What `issuer` says of `subject` (a JWT as NATS has it, version 2).
fn signed(issuer: &KeyPair, subject: &KeyPair, name: &str, nats: &Value) -> String {
    let encode = |value: &Value| URL_SAFE_NO_PAD.encode(value.to_string());
    let head = encode(&json!({ "typ": "JWT", "alg": "ed25519-nkey" }));
    let claims = encode(&json!({
        "jti": name, "iat": 1_700_000_000, "iss": issuer.public_key(), "sub": subject.public_key(),
        "name": name, "nats": nats,
    }));
    let text = format!("{head}.{claims}");
    let signature = URL_SAFE_NO_PAD.encode(issuer.sign(text.as_bytes()).unwrap());
    format!("{text}.{signature}")
}

/// The text of a file of credentials.
fn credentials(account: &KeyPair, user: &KeyPair) -> Login {
    let any = json!({ "type": "user", "version": 2, "pub": {}, "sub": {}, "subs": -1, "data": -1,
        "payload": -1 });
    let token = signed(account, user, "bench-1", &any);
    let seed = user.seed().unwrap();
    Login::Credentials(Secret::new(format!(
        "-----BEGIN NATS USER JWT-----\n{token}\n------END NATS USER JWT------\n\n\
         -----BEGIN USER NKEY SEED-----\n{seed}\n------END USER NKEY SEED------\n"
    )))
}

#[test]
fn credentials_are_asked_for() {
    let operator = KeyPair::new_operator();
    let (system, account) = (KeyPair::new_account(), KeyPair::new_account());
    let user = KeyPair::new_user();
    let itself = json!({ "type": "operator", "version": 2 });
    let limits = json!({ "subs": -1, "data": -1, "payload": -1, "imports": -1, "exports": -1,
        "wildcards": true, "conn": -1, "leaf": -1, "mem_storage": -1, "disk_storage": -1,
        "streams": -1, "consumer": -1 });
    let any = json!({ "type": "account", "version": 2, "limits": limits,
        "default_permissions": { "pub": {}, "sub": {} } });
    // The account for the server itself may have no store.
    let mut own = any.clone();
    for limit in ["mem_storage", "disk_storage", "streams", "consumer"] {
        own["limits"][limit] = json!(0);
    }
    let lines = format!(
        "operator: \"{}\"\nresolver: MEMORY\nsystem_account: {system}\n\
         resolver_preload: {{ {system}: \"{}\", {hall}: \"{}\" }}",
        signed(&operator, &operator, "lab", &itself),
        signed(&operator, &system, "system", &own),
        signed(&operator, &account, "hall", &any),
        system = system.public_key(),
        hall = account.public_key(),
    );
    let Some(server) = configured(&lines) else {
        return;
    };
    let mut options = options(&server.url());
    options.login = credentials(&account, &user);
    works(&options);
    // Of an account that the operator has not signed.
    options.login = credentials(&KeyPair::new_account(), &KeyPair::new_user());
    let told = refusal(&options).to_string().to_lowercase();
    assert!(told.contains("authorization"), "{told}");
}
