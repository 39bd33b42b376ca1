//! Who may ask: the socket's group, and bearers of tokens on a loopback address.

use std::net::SocketAddr;
use std::os::unix::fs::{MetadataExt, PermissionsExt};

use nix::unistd::{Group, getgid};
use relief_api::{CreateToken, NewToken, Token, TokenList, path};
use reliefd::Daemon;
use tokio::net::TcpStream;

use crate::client::{Reply, exchange};
use crate::fake::FakeScanner;
use crate::rig::{Rig, config};

async fn on_loopback() -> (Rig, SocketAddr) {
    let rig = Rig::start(tempfile::tempdir().unwrap(), |config| {
        config.service.listen = Some("127.0.0.1:0".parse().unwrap());
    })
    .await;
    let address = rig.daemon.listen().unwrap();
    (rig, address)
}

async fn make(rig: &Rig, name: &str) -> NewToken {
    let request = CreateToken { name: name.into() };
    rig.client.post(path::TOKENS, &request).await
}

/// Asks with these header fields, of which the first is the host.
async fn ask(address: SocketAddr, fields: &str, method: &str, path: &str) -> Reply {
    let stream = TcpStream::connect(address).await.unwrap();
    exchange(stream, fields, method, path, None).await
}

#[tokio::test(flavor = "multi_thread")]
async fn loopback_is_for_bearers_of_a_token() {
    let (rig, address) = on_loopback().await;
    let host = address.to_string();
    let refused = ask(address, &host, "GET", path::STATUS).await;
    assert_eq!(refused.header("www-authenticate"), Some("Bearer"));
    let problem = refused.problem();
    assert_eq!((problem.status, problem.kind.as_str()), (401, "no-token"));
    assert!(problem.hint.unwrap().contains("relief token create"));

    let desk = make(&rig, "desk").await;
    let bearer = |token: &str| format!("{host}\r\nAuthorization: Bearer {token}");
    for (fields, status) in [
        (bearer(&desk.token), 200),
        (bearer(&desk.token).replace("Bearer", "bEARER"), 200),
        (bearer(&desk.token[..70]), 401),
        (bearer(""), 401),
        (bearer("relief_"), 401),
        (bearer(&desk.token).replace("Bearer", "Basic"), 401),
        (format!("{host}\r\nAuthorization: {}", desk.token), 401),
        (
            format!("{}\r\nAuthorization: Bearer x", bearer(&desk.token)),
            400,
        ),
    ] {
        let reply = ask(address, &fields, "GET", path::STATUS).await;
        assert_eq!(reply.status, status, "{fields}");
    }
    // Nothing behind the listener is open: not what is not there, nor other methods.
    for (method, path) in [
        ("GET", "/v2"),
        ("POST", path::ABORT),
        ("OPTIONS", path::STATUS),
        ("GET", path::EVENTS),
        ("GET", "/v1/spool/a/b"),
        ("DELETE", path::SCANS),
    ] {
        let reply = ask(address, &host, method, path).await;
        assert_eq!(reply.status, 401, "{method} {path}");
    }

    let robot = make(&rig, "robot").await;
    let revoked: Token = rig.client.ask(&path::token_revoke("desk")).await;
    assert_eq!(revoked.name, "desk");
    for (token, status) in [(&desk, 401), (&robot, 200)] {
        let reply = ask(address, &bearer(&token.token), "GET", path::STATUS).await;
        assert_eq!(reply.status, status, "{}", token.name);
    }
    let list: TokenList = rig.client.get(path::TOKENS).await;
    let names: Vec<&str> = list.tokens.iter().map(|t| t.name.as_str()).collect();
    assert_eq!(names, ["robot"]);

    // Restarted, the service knows its bearers.
    rig.daemon.shutdown().await;
    let rig = Rig::start(rig.folder, |config| {
        config.service.listen = Some("127.0.0.1:0".parse().unwrap());
    })
    .await;
    let address = rig.daemon.listen().unwrap();
    let reply = ask(address, &bearer(&robot.token), "GET", path::STATUS).await;
    assert_eq!(reply.status, 200);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bearer_can_neither_make_nor_revoke_tokens() {
    let (rig, address) = on_loopback().await;
    let token = make(&rig, "desk").await;
    let fields = format!("{address}\r\nAuthorization: Bearer {}", token.token);
    for (method, path) in [
        ("GET", path::TOKENS.to_owned()),
        ("POST", path::TOKENS.to_owned()),
        ("POST", path::token_revoke("desk")),
    ] {
        let problem = ask(address, &fields, method, &path).await.problem();
        assert_eq!(
            (problem.status, problem.kind.as_str()),
            (403, "only-on-the-socket"),
            "{method} {path}"
        );
    }
    let list: TokenList = rig.client.get(path::TOKENS).await;
    assert_eq!(list.tokens.len(), 1);
    for (name, status, kind) in [
        ("desk", 409, "token-name-taken"),
        ("a b", 400, "wrong-token-name"),
    ] {
        let body = format!(r#"{{"name":"{name}"}}"#);
        let reply = rig.client.request("POST", path::TOKENS, Some(&body)).await;
        let problem = reply.problem();
        assert_eq!((problem.status, problem.kind.as_str()), (status, kind));
    }
    let reply = rig
        .client
        .request("POST", &path::token_revoke("x"), None)
        .await;
    assert_eq!(reply.problem().kind, "no-such-token");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn web_pages_are_refused_even_with_a_token() {
    let (rig, address) = on_loopback().await;
    let token = make(&rig, "desk").await;
    let bearing = format!("\r\nAuthorization: Bearer {}", token.token);
    for (fields, why) in [
        (format!("{address}"), None),
        ("localhost".to_owned(), None),
        (format!("{address}\r\nOrigin: http://{address}"), None),
        (
            "rebound.example.org".to_owned(),
            Some("rebound.example.org"),
        ),
        (
            format!("{address}\r\nOrigin: http://evil.example.org"),
            Some("evil.example.org"),
        ),
        (format!("{address}\r\nOrigin: null"), Some("null")),
        (
            format!("{address}\r\nSec-Fetch-Site: cross-site"),
            Some("cross-site"),
        ),
    ] {
        let reply = ask(address, &format!("{fields}{bearing}"), "GET", path::STATUS).await;
        // A page could only read a reply that allows it to.
        assert_eq!(reply.header("access-control-allow-origin"), None);
        match why {
            None => assert_eq!(reply.status, 200, "{fields}"),
            Some(why) => {
                let problem = reply.problem();
                assert_eq!(
                    (problem.status, problem.kind.as_str()),
                    (403, "not-local"),
                    "{fields}"
                );
                assert!(problem.detail.contains(why), "{problem}");
            }
        }
    }
    let fields = format!("localhost\r\nOrigin: http://evil.example.org{bearing}");
    let reply = ask(address, &fields, "POST", path::ABORT).await;
    assert_eq!(reply.problem().kind, "not-local");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_socket_is_for_its_group() {
    let own = Group::from_gid(getgid()).unwrap().unwrap();
    let rig = Rig::start(tempfile::tempdir().unwrap(), |config| {
        config.service.socket_group = Some(own.name.clone());
    })
    .await;
    let metadata = std::fs::metadata(rig.daemon.socket()).unwrap();
    assert_eq!(metadata.gid(), own.gid.as_raw());
    assert_eq!(metadata.permissions().mode() & 0o777, 0o660);
    let rig = rig
        .restart_with(|config| config.service.socket_mode = 0o600)
        .await;
    let metadata = std::fs::metadata(rig.daemon.socket()).unwrap();
    assert_eq!(metadata.permissions().mode() & 0o777, 0o600);
    rig.daemon.shutdown().await;

    let folder = tempfile::tempdir().unwrap();
    let mut config = config(folder.path());
    config.service.socket_group = Some("no-such-group-here".into());
    let error = Daemon::start_with(config.clone(), FakeScanner::new())
        .await
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "there is no group no-such-group-here (service.socket_group): make it (groupadd \
         --system no-such-group-here), or name one that is there"
    );
    assert!(
        !config.service.socket.exists(),
        "nobody is let in meanwhile"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn damaged_tokens_keep_the_service_from_starting() {
    let folder = tempfile::tempdir().unwrap();
    let config = config(folder.path());
    std::fs::create_dir_all(&config.service.state_dir).unwrap();
    std::fs::write(config.service.state_dir.join("tokens.json"), "{").unwrap();
    let error = Daemon::start_with(config, FakeScanner::new())
        .await
        .unwrap_err()
        .to_string();
    assert!(error.contains("tokens.json are damaged: EOF"), "{error}");
}
