//! What the clients of a service tell.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, UdpSocket};
use std::os::unix::fs::PermissionsExt;

use reliefd::config::{DeliverablesConfig, HookConfig, UploadConfig, UploadTo, WebhookConfig};
use reliefd::{Config, Daemon};
use serde_json::json;
use sim_scanner::config::SimConfig;
use sim_scanner::preset::Overrides;

use super::*;

/// A client of a service; the service needs the test's threads meanwhile.
async fn ask(at: &Path, socket: &Path, arguments: &[&str]) -> Value {
    let mut command = Command::new(env!("CARGO_BIN_EXE_relief"));
    command.current_dir(at).arg("--json").args(arguments);
    command.arg("--socket").arg(socket);
    let output = tokio::task::spawn_blocking(move || command.output());
    document(&output.await.unwrap().unwrap())
}

/// Deliverables beside the model, so that reports tell of them.
fn further(at: &Path) -> DeliverablesConfig {
    // Room for the house; its own stock is that of a small part.
    let machine = include_str!("../../../../../config/machine.toml")
        .replace("[-40.0, 40.0]", "[-100.0, 150.0]")
        .replace("[-10.0, 22.0]", "[-80.0, 80.0]")
        .replace("[0.0, 300.0]", "[-500.0, 500.0]")
        .replace("[0.0, 200.0]", "[-500.0, 500.0]")
        .replace("[-100.0, 0.0]", "[-500.0, 500.0]")
        .replace("safe_z_mm = 30.0", "safe_z_mm = 90.0");
    fs::write(at.join("machine.toml"), machine).unwrap();
    let text = "[deliverables.surface]\ntolerance_mm = 0.5\nfair_mm = 0.05\n\
         [deliverables.skin]\ntolerance_mm = 0.5\nevery_mm = 5.0\n\
         [deliverables.toolpath]\nmachine = \"machine.toml\"\ntool = \"ball:6\"\n\
         scallop_mm = 0.5\npitch_mm = 1.0\n";
    fs::write(at.join("relief.toml"), text).unwrap();
    Config::load(&at.join("relief.toml")).unwrap().deliverables
}

#[tokio::test(flavor = "multi_thread")]
async fn what_the_clients_of_the_service_tell() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let scanner = SimConfig {
        overrides: Overrides {
            columns: Some(60),
            samples: Some(64),
            ..Overrides::default()
        },
        ..SimConfig::default()
    };
    let scanner = scanner.serve_pty(None).unwrap();
    let mut config = Config::default();
    config.service.socket = at.join("s");
    config.service.state_dir = at.join("state");
    config.service.spool_dir = at.join("spool");
    config.scanner.port = scanner.port().to_owned();
    config.deliverables = further(at);
    let mut hook = HookConfig::new("check", &["/bin/sh", "-c", "echo $RELIEF_NAME"]);
    // In the place of reliefd, which is not built for this test.
    let helper = at.join("helper");
    fs::write(&helper, "#!/bin/sh\necho $RELIEF_NAME\n").unwrap();
    fs::set_permissions(&helper, fs::Permissions::from_mode(0o755)).unwrap();
    hook.helper = Some(helper);
    config.hooks = vec![hook];
    let mut upload = UploadConfig::new("archive", UploadTo::Folder);
    upload.folder = Some(at.join("archive"));
    fs::create_dir(at.join("archive")).unwrap();
    config.uploads = vec![upload];
    let daemon = Daemon::start(config).await.unwrap();
    let socket = daemon.socket().to_owned();
    let told = |arguments: &'static [&'static str]| {
        let socket = socket.clone();
        async move {
            let told = ask(at, &socket, arguments).await;
            check(
                &format!("commands.schema.json#/$defs/{}", arguments[0]),
                &told,
            );
            told
        }
    };
    // As many events as the scan's beginning has for sure.
    let watched = tokio::spawn({
        let (at, socket) = (at.to_owned(), socket.clone());
        async move { ask(&at, &socket, &["watch", "--count", "12"]).await }
    });
    let scanned = told(&["scan", "--name", "house", "--operator", "A", "--wait"]).await;
    assert_eq!(scanned["job"]["state"], "done");
    check("commands.schema.json#/$defs/watch", &watched.await.unwrap());
    let status = told(&["status"]).await;
    assert_eq!(status["scanner"]["link"], "ready");
    let laser = told(&["laser"]).await;
    let entries = laser["entries"].as_array().unwrap();
    assert!(entries.iter().any(|entry| entry["laser"] == "on"));
    assert_eq!(entries.last().unwrap()["laser"], "off");
    let fetched = told(&["fetch", "latest", "-o", "out"]).await;
    assert_eq!(fetched.get("acknowledged_at"), None);
    check("manifest.schema.json", &file(at.join("out/manifest.json")));
    let report = file(at.join("out/report.json"));
    check("report.schema.json", &report);
    for key in ["surface", "skin", "toolpath"] {
        assert!(report[key].is_object(), "{key}: {}", report["warnings"]);
        assert!(report["settings"][key].is_object(), "{key}");
    }
    // What is not whole is not acknowledged.
    let spooled = at.join("spool").join(fetched["result"].as_str().unwrap());
    let iges = fs::read(spooled.join("house.igs")).unwrap();
    fs::write(spooled.join("house.igs"), &iges[1..]).unwrap();
    let environment = [("RELIEF_SOCKET", "s")];
    let again = &["fetch", "latest", "-o", "out", "--ack"];
    let broken = run(at, &environment, again).await;
    let words = String::from_utf8_lossy(&broken.stderr);
    assert!(words.contains("is not what the manifest says"), "{words}");
    fs::write(spooled.join("house.igs"), &iges).unwrap();
    assert_eq!(
        told(&["jobs"]).await["jobs"][0].get("acknowledged_at"),
        None
    );
    let fetched = told(&["fetch", "latest", "-o", "out", "--ack"]).await;
    assert_eq!(fetched["acknowledged_by"], "socket");
    let listed = run(at, &environment, &["jobs"]).await;
    let listed = String::from_utf8_lossy(&listed.stdout);
    assert!(
        listed.contains("done, acknowledged by socket at 20"),
        "{listed}"
    );
    assert_eq!(told(&["fleet"]).await["is_used"], false);
    let hooks = async |arguments: &[&str]| {
        let told = ask(at, &socket, &[&["hooks"], arguments].concat()).await;
        check("commands.schema.json#/$defs/hooks", &told);
        told
    };
    let tested = hooks(&["test", "check"]).await;
    assert_eq!(tested["tried"][0]["answer"], "house");
    let runs = hooks(&["log", "check"]).await;
    assert_eq!(runs["runs"].as_array().unwrap().len(), 2);
    assert_eq!(hooks(&[]).await["hooks"][0]["latest"]["state"], "delivered");
    let shown = run(at, &environment, &["hooks", "log", "check"]).await;
    let shown = String::from_utf8_lossy(&shown.stdout);
    assert!(
        shown.contains("done after ") && shown.contains("\n      house"),
        "{shown}"
    );
    let uploads = async |arguments: &[&str]| {
        let told = ask(at, &socket, &[&["uploads"], arguments].concat()).await;
        check("commands.schema.json#/$defs/uploads", &told);
        told
    };
    assert_eq!(uploads(&["test", "archive"]).await["state"], "delivered");
    let log = uploads(&["log", "archive"]).await;
    assert_eq!(log["runs"].as_array().unwrap().len(), 2);
    let place = at.join("archive").display().to_string();
    assert_eq!(uploads(&[]).await["uploads"][0]["to"], place);
    let shown = run(at, &environment, &["uploads"]).await;
    let shown = String::from_utf8_lossy(&shown.stdout);
    assert!(
        shown.contains("UPLOAD") && shown.contains("done"),
        "{shown}"
    );
    // A job that fails, so that its error is there, and that is taken up again.
    let few = &["rerun", "latest", "--set", "regrid.roi_x_mm=[900,901]"];
    let failing = told(few).await;
    assert_eq!(failing["settings"]["regrid.roi_x_mm"], json!([900, 901]));
    let jobs = loop {
        let jobs = told(&["jobs"]).await;
        if jobs["jobs"][0]["state"] == "failed" {
            break jobs;
        }
    };
    assert!(jobs["jobs"][0]["hint"].is_string());
    told(&["retry", "2"]).await;
    let cancelled = ask(
        at,
        &socket,
        &["rerun", "latest", "--set", "regrid.draws=100000"],
    )
    .await;
    assert_eq!(cancelled["id"], 3);
    told(&["cancel", "3"]).await;
    fs::write(at.join("edits.toml"), "[[edit]]\nid = 0\nlength = 90\n").unwrap();
    let edited = told(&["rerun", "latest", "--edit", "edits.toml"]).await;
    assert_eq!(edited["settings"]["deliverables.features"], true);
    let edits = json!([{ "id": 0, "length": 90.0 }]);
    assert_eq!(edited["settings"]["deliverables.edit"], edits);
    // So that it is still under way when it is aborted.
    scanner.control().step_columns(Some(5));
    let second = told(&["scan", "--name", "second"]).await;
    assert!(second.get("job").is_none());
    told(&["abort"]).await;
    told(&["scans"]).await;
    daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_told_of_several_scanners() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let sims = [1, 2].map(|seed| {
        let sim = SimConfig {
            overrides: Overrides {
                columns: Some(60),
                samples: Some(64),
                ..Overrides::default()
            },
            seed,
            ..SimConfig::default()
        };
        sim.serve_pty(None).unwrap()
    });
    let mut config = Config::default();
    config.service.socket = at.join("s");
    config.service.state_dir = at.join("state");
    config.service.spool_dir = at.join("spool");
    for (name, sim) in ["left", "right"].into_iter().zip(&sims) {
        // So that each scan is under way when the other begins.
        sim.control().step_columns(Some(5));
        let mut scanner = config.scanner.clone();
        scanner.port = sim.port().to_owned();
        config.scanners.insert(name.into(), scanner);
    }
    let daemon = Daemon::start(config).await.unwrap();
    let told = async |arguments: &[&str]| {
        let told = ask(at, daemon.socket(), arguments).await;
        let reference = format!("commands.schema.json#/$defs/{}", arguments[0]);
        check(&reference, &told);
        told
    };
    let socket = daemon.socket().to_str().unwrap();
    let refused = run(at, &[], &["scan", "--socket", socket]).await;
    assert_eq!(refused.status.code(), Some(1));
    let words = String::from_utf8_lossy(&refused.stderr);
    assert!(words.contains("none is named: left, right"), "{words}");
    for name in ["left", "right"] {
        let scanned = told(&["scan", "--scanner", name]).await;
        assert_eq!(scanned["scan"]["scanner"], name);
    }
    let status = told(&["status"]).await;
    for (index, name) in ["left", "right"].into_iter().enumerate() {
        assert_eq!(status["scanners"][index]["name"], name);
        assert_eq!(status["scanners"][index]["scan"]["scanner"], name);
    }
    assert_eq!(status["scan"], status["scanners"][0]["scan"]);
    let shown = run(at, &[], &["status", "--socket", socket]).await;
    let shown = String::from_utf8_lossy(&shown.stdout);
    assert!(shown.contains("scanner   left, ") && shown.contains("scanner   right, "));
    let aborted = told(&["abort", "--all"]).await;
    assert_eq!(aborted["scanner"], "left");
    assert_eq!(aborted["others"][0]["scanner"], "right");
    for name in ["left", "right"] {
        let laser = told(&["laser", "--scanner", name]).await;
        let entries = laser["entries"].as_array().unwrap();
        assert!(entries.iter().all(|entry| entry["scanner"] == name));
        assert_eq!(entries.last().unwrap()["laser"], "off");
    }
    told(&["scans"]).await;
    let both = run(
        at,
        &[],
        &["abort", "--all", "--scanner", "left", "--socket", socket],
    )
    .await;
    assert_eq!(both.status.code(), Some(2));
    daemon.shutdown().await;
}

/// A command with an environment of its own, run while the service answers.
async fn run(at: &Path, environment: &[(&str, &str)], arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_relief"));
    command.current_dir(at).args(arguments);
    for name in ["RELIEF_SOCKET", "RELIEF_TOKEN", "RELIEF_TOKEN_FILE"] {
        command.env_remove(name);
    }
    command.envs(environment.iter().copied());
    let output = tokio::task::spawn_blocking(move || command.output());
    output.await.unwrap().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn tokens_are_made_used_and_revoked() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let mut config = Config::default();
    config.service.socket = at.join("s");
    config.service.listen = Some("127.0.0.1:0".parse().unwrap());
    config.service.state_dir = at.join("state");
    config.service.spool_dir = at.join("spool");
    config.scanner.port = at.join("none");
    let daemon = Daemon::start(config).await.unwrap();
    let url = format!("http://{}", daemon.listen().unwrap());
    let token = async |arguments: &[&str]| {
        let told = ask(at, daemon.socket(), &[&["token"], arguments].concat()).await;
        check("commands.schema.json#/$defs/token", &told);
        told
    };
    let shown = token(&["create", "shown"]).await;
    let shown = shown["token"].as_str().unwrap();
    let kept = token(&["create", "kept", "--out", "kept.token"]).await;
    assert_eq!(kept["file"], "kept.token");
    assert!(kept.get("token").is_none());
    let listed = token(&["list"]).await;
    assert_eq!(listed["tokens"][0]["name"], "shown");
    assert_eq!(listed["tokens"][1]["name"], "kept");

    let status = &["status", "--url", &url][..];
    let with_file = &[status, &["--token-file", "kept.token"]].concat();
    for (environment, arguments) in [
        (&[("RELIEF_TOKEN", shown)][..], status),
        (&[("RELIEF_TOKEN_FILE", "kept.token")], status),
        (&[], with_file),
    ] {
        let output = run(at, environment, arguments).await;
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{told}");
    }
    let refused = async |environment: &[(&str, &str)], arguments: &[&str], why: &str| {
        let output = run(at, environment, arguments).await;
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{told}");
        assert!(told.contains(why), "{told}");
        assert_eq!(told.lines().count(), 1, "{told}");
        assert!(!told.contains("relief_"), "{told}");
    };
    refused(&[], status, "relief token create").await;
    refused(&[("RELIEF_TOKEN", "relief_x")], status, "does not hold").await;
    refused(
        &[("RELIEF_TOKEN", "")],
        status,
        "RELIEF_TOKEN holds no token",
    )
    .await;
    let listing = ["token", "list", "--url", &url];
    refused(&[("RELIEF_TOKEN", shown)], &listing, "socket only").await;
    // A file that is there is not written over, and no token is made for it.
    let socket = daemon.socket().to_str().unwrap();
    let again = [
        "token",
        "create",
        "other",
        "--out",
        "kept.token",
        "--socket",
        socket,
    ];
    refused(&[], &again, "cannot make kept.token").await;
    let twice = [
        "token", "create", "kept", "--out", "new", "--socket", socket,
    ];
    refused(&[], &twice, "there is a token kept already").await;
    assert!(!at.join("new").exists());

    token(&["revoke", "kept"]).await;
    refused(&[], with_file, "does not hold").await;
    daemon.shutdown().await;
}

/// Takes one connection after the other, and answers all that is posted with this.
fn receiver(answer: &'static str) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/relief", listener.local_addr().unwrap());
    // Until the process ends, as nobody asks any more.
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = BufReader::new(stream.unwrap());
            let mut length = 0;
            loop {
                let mut line = String::new();
                stream.read_line(&mut line).unwrap();
                if let Some(value) = line.to_lowercase().strip_prefix("content-length: ") {
                    length = value.trim().parse().unwrap();
                }
                if line.trim().is_empty() {
                    break;
                }
            }
            stream.read_exact(&mut vec![0; length]).unwrap();
            stream.get_mut().write_all(answer.as_bytes()).unwrap();
        }
    });
    url
}

#[tokio::test(flavor = "multi_thread")]
async fn webhooks_are_listed_tested_and_looked_into() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let secret = at.join("secret");
    fs::write(&secret, "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
    fs::set_permissions(&secret, fs::Permissions::from_mode(0o600)).unwrap();
    let mut config = Config::default();
    config.service.socket = at.join("s");
    config.service.state_dir = at.join("state");
    config.service.spool_dir = at.join("spool");
    config.scanner.port = at.join("none");
    let none = Daemon::start(config.clone()).await.unwrap();
    let told = run(at, &[("RELIEF_SOCKET", "s")], &["webhooks"]).await;
    let told = String::from_utf8_lossy(&told.stdout).into_owned();
    assert!(told.starts_with("nobody is told"), "{told}");
    none.shutdown().await;

    let takes = receiver("HTTP/1.1 204 x\r\n\r\n");
    let refuses = receiver("HTTP/1.1 401 x\r\nContent-Length: 8\r\n\r\nwho are?");
    config.webhooks = vec![
        WebhookConfig::new("lab", &takes, &secret),
        WebhookConfig::new("bad", &refuses, &secret),
    ];
    let daemon = Daemon::start(config).await.unwrap();
    let webhooks = async |arguments: &[&str]| {
        let told = ask(at, daemon.socket(), &[&["webhooks"], arguments].concat()).await;
        check("commands.schema.json#/$defs/webhooks", &told);
        told
    };
    let listed = webhooks(&[]).await;
    // What follows the host may be for the receiver alone.
    let shown = takes.replace("/relief", "/...");
    assert_eq!(listed["webhooks"][0]["url"], shown.as_str());
    assert_eq!(webhooks(&["test", "lab"]).await["state"], "delivered");
    assert_eq!(
        webhooks(&["test", "bad"]).await["tried"][0]["answer"],
        "who are?"
    );
    assert_eq!(
        webhooks(&["log", "bad"]).await["deliveries"][0]["event"],
        "test"
    );
    assert_eq!(
        webhooks(&[]).await["webhooks"][1]["latest"]["state"],
        "given_up"
    );

    let shown = async |arguments: &[&str]| {
        let output = run(at, &[("RELIEF_SOCKET", "s")], arguments).await;
        let of = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), of(&output.stdout), of(&output.stderr))
    };
    let (code, out, _) = shown(&["webhooks", "test", "lab"]).await;
    assert_eq!((code, out.as_str()), (Some(0), "lab: taken (204)\n"));
    let (code, out, told) = shown(&["webhooks", "test", "bad"]).await;
    assert_eq!((code, out.as_str()), (Some(1), ""));
    assert!(told.starts_with("relief: bad was not told: "), "{told}");
    assert!(told.ends_with("it said: who are?\n"), "{told}");
    let (code, _, told) = shown(&["webhooks", "test", "lob"]).await;
    assert_eq!(code, Some(1));
    assert!(
        told.contains("there is no receiver lob; there are lab, bad"),
        "{told}"
    );
    let (_, out, _) = shown(&["webhooks"]).await;
    assert!(out.contains("scan-ended job-done job-failed"), "{out}");
    assert!(out.contains("test not taken: "), "{out}");
    let (_, out, _) = shown(&["webhooks", "log", "lab"]).await;
    assert!(
        out.contains("test") && out.contains("ms): taken (204)"),
        "{out}"
    );
    daemon.shutdown().await;
}

/// Whether a datagram to a multicast group comes back to whoever has joined it.
fn multicast_works() -> bool {
    let group = "239.255.72.69".parse().unwrap();
    let echo = || -> std::io::Result<bool> {
        let socket = UdpSocket::bind("0.0.0.0:0")?;
        socket.join_multicast_v4(&group, &"0.0.0.0".parse().unwrap())?;
        socket.set_read_timeout(Some(std::time::Duration::from_secs(2)))?;
        socket.send_to(b"relief", (group, socket.local_addr()?.port()))?;
        Ok(socket.recv(&mut [0; 16])? == 6)
    };
    echo().unwrap_or(false)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_announces_itself_is_found_until_it_ends() {
    if !multicast_works() {
        eprintln!("skipped: no multicast here");
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let mut config = Config::default();
    config.service.socket = at.join("s");
    config.service.state_dir = at.join("state");
    config.service.spool_dir = at.join("spool");
    config.scanner.port = at.join("none");
    config.http.hosts = vec!["bench.lab.example".into()];
    config.discovery.announce = true;
    // Away from whatever else the machine announces.
    let free = UdpSocket::bind("0.0.0.0:0").unwrap();
    config.discovery.mdns_port = free.local_addr().unwrap().port();
    drop(free);
    let port = config.discovery.mdns_port.to_string();
    let daemon = Daemon::start(config).await.unwrap();
    let look = async || {
        let arguments = ["discover", "--seconds", "1", "--mdns-port", &port];
        let json = run(at, &[], &[&["--json"], &arguments[..]].concat()).await;
        let told = document(&json);
        check("commands.schema.json#/$defs/discover", &told);
        told["services"].clone()
    };
    // It first makes sure that nobody else has its name.
    let found = loop {
        let found = look().await;
        if found != json!([]) {
            break found;
        }
    };
    assert_eq!(found.as_array().unwrap().len(), 1, "{found}");
    assert_eq!(found[0]["name"], "Relief on bench");
    assert_eq!(found[0]["url"], "https://bench.lab.example/");
    assert_eq!(found[0]["scanners"], json!(["scanner"]));
    daemon.shutdown().await;
    assert_eq!(look().await, json!([]));
}
