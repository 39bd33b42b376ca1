//! Copies of results go elsewhere, whole or not at all.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use deliverables::hexadecimal;
use relief_api::{Delivery, DeliveryState, UploadList, UploadRuns, path};
use reliefd::config::{Retry, UploadConfig, UploadTo};
use sha2::{Digest, Sha256};

use crate::rig::{GUARD, Rig};
use crate::webhooks::receiver::{Answer, Got, Receiver, any_port, hmac};
use crate::webhooks::write_secret;

/// An upload without delays.
fn upload(to: UploadTo) -> UploadConfig {
    let mut upload = UploadConfig::new("lab", to);
    upload.helper = Some(env!("CARGO_BIN_EXE_reliefd").into());
    upload.retry = Retry {
        first: Duration::from_millis(10),
        longest: Duration::from_millis(10),
        ..Retry::default()
    };
    upload
}

async fn start(upload: UploadConfig) -> Rig {
    let folder = tempfile::tempdir().unwrap();
    Rig::start(folder, |config| config.uploads = vec![upload]).await
}

/// The newest copy once it has come so far.
async fn until(rig: &Rig, is_far: impl Fn(&Delivery) -> bool) -> Delivery {
    let runs = async || -> Vec<Delivery> {
        let log: UploadRuns = rig.client.get(&path::upload_runs("lab")).await;
        log.runs
    };
    let found = async {
        loop {
            if let Some(run) = runs().await.into_iter().find(&is_far) {
                return run;
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    match tokio::time::timeout(GUARD, found).await {
        Ok(run) => run,
        Err(_) => panic!("the upload stays at {:?}", runs().await),
    }
}

async fn copied(rig: &Rig) -> Delivery {
    until(rig, |run| run.state == DeliveryState::Delivered).await
}

fn error(run: &Delivery) -> String {
    run.tried.last().unwrap().error.clone().unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn assert_same(a: &Path, b: &Path) {
    assert!(
        fs::read(a).unwrap() == fs::read(b).unwrap(),
        "{}",
        a.display()
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn a_share_gets_what_it_is_to_get_once_it_is_there() {
    let share = tempfile::tempdir().unwrap();
    let place = share.path().join("scans");
    let mut config = upload(UploadTo::Folder);
    config.folder = Some(place.clone());
    config.files = vec!["*.igs".into(), "report.*".into()];
    let rig = start(config).await;
    let (_, job) = rig.scan_to_result("roof").await;
    let waits = until(&rig, |run| !run.tried.is_empty()).await;
    assert!(error(&waits).contains("is it mounted?"), "{waits:?}");
    fs::create_dir(&place).unwrap();
    copied(&rig).await;
    // Nothing is left of its making.
    assert_eq!(names(&place), [job.result.as_str()]);
    let copy = place.join(&job.result);
    let own = rig.daemon.spool_dir().join(&job.result);
    let wanted: Vec<String> = names(&own)
        .into_iter()
        .filter(|name| {
            name.ends_with(".igs") || name.starts_with("report.") || name == "manifest.json"
        })
        .collect();
    assert!(wanted.len() > 2, "{wanted:?}");
    assert_eq!(names(&copy), wanted);
    for name in &wanted {
        assert_same(&copy.join(name), &own.join(name));
    }
    // Once more does no harm.
    let again: Delivery = rig.client.ask(&path::upload_test("lab")).await;
    assert_eq!(again.state, DeliveryState::Delivered);
    // What is there under its name and is something else stays.
    fs::write(copy.join("manifest.json"), "{}").unwrap();
    let other: Delivery = rig.client.ask(&path::upload_test("lab")).await;
    assert!(error(&other).contains("another result"), "{other:?}");
    assert_eq!(fs::read(copy.join("manifest.json")).unwrap(), b"{}");
    // A file that has been damaged in the spool goes nowhere.
    fs::remove_dir_all(&copy).unwrap();
    fs::write(own.join("roof.igs"), "damaged").unwrap();
    let damaged: Delivery = rig.client.ask(&path::upload_test("lab")).await;
    let told = error(&damaged);
    assert!(
        told.contains("roof.igs is not what manifest.json says"),
        "{told}"
    );
    assert!(!copy.exists());
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_share_that_is_not_mounted_is_told_from_its_place() {
    let share = tempfile::tempdir().unwrap();
    let mut config = upload(UploadTo::Folder);
    config.folder = Some(share.path().to_owned());
    config.must_be_mount = Some(true);
    let rig = start(config).await;
    rig.scan_to_result("roof").await;
    let waits = until(&rig, |run| !run.tried.is_empty()).await;
    assert!(error(&waits).contains("nothing is mounted at"), "{waits:?}");
    assert!(names(share.path()).is_empty());
    let list: UploadList = rig.client.get(path::UPLOADS).await;
    assert_eq!(list.uploads[0].to, share.path().display().to_string());
    assert_eq!(list.uploads[0].waiting, 1);
    rig.daemon.shutdown().await;
}

const KEY: [&str; 2] = ["AKIDRELIEF", "secret/of+the=key"];

/// The file that a request is for, where its signature is the one of the specification (AWS
/// Signature Version 4, in the query), reckoned from the request as it came.
fn signed_for(got: &Got, host: &str) -> String {
    let target = got.request.split(' ').nth(1).unwrap();
    let (file, query) = target.split_once('?').unwrap();
    let mut pairs: Vec<&str> = query.split('&').collect();
    pairs.sort_unstable();
    let value = |name: &str| {
        let pair = pairs.iter().find_map(|pair| pair.strip_prefix(name));
        pair.unwrap().strip_prefix('=').unwrap()
    };
    let signature = value("X-Amz-Signature");
    let date = value("X-Amz-Date");
    let rest: Vec<&str> = pairs
        .iter()
        .copied()
        .filter(|pair| !pair.starts_with("X-Amz-Signature="))
        .collect();
    let checksum = got.header("x-amz-checksum-sha256");
    let canonical = format!(
        "PUT\n{file}\n{}\nhost:{host}\nx-amz-checksum-sha256:{checksum}\n\n\
         host;x-amz-checksum-sha256\nUNSIGNED-PAYLOAD",
        rest.join("&")
    );
    let day = &date[..8];
    let scope = format!("{day}/eu-lab-1/s3/aws4_request");
    let text = format!(
        "AWS4-HMAC-SHA256\n{date}\n{scope}\n{}",
        hexadecimal(&Sha256::digest(canonical))
    );
    let mut key = format!("AWS4{}", KEY[1]).into_bytes();
    for part in [day, "eu-lab-1", "s3", "aws4_request", &text] {
        key = hmac(&key, part.as_bytes());
    }
    assert_eq!(signature, hexadecimal(&key));
    assert_eq!(
        value("X-Amz-Credential"),
        format!("{}/{scope}", KEY[0]).replace('/', "%2F")
    );
    // What arrives is what the checksum says.
    assert_eq!(checksum, STANDARD.encode(Sha256::digest(&got.body)));
    file.to_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn an_object_store_gets_signed_files_and_the_manifest_last() {
    let busy = Answer::Status(503, "<Code>SlowDown</Code>");
    let store = Receiver::new([busy.clone(), busy]);
    let folder = tempfile::tempdir().unwrap();
    let key = folder.path().join("key");
    write_secret(&key, &KEY.join("\n"));
    let mut config = upload(UploadTo::S3);
    config.endpoint = Some(format!("http://{}", store.address));
    config.bucket = Some("scans".into());
    config.region = Some("eu-lab-1".into());
    config.prefix = Some("bench 1/".into());
    config.key_file = Some(key);
    config.files = vec!["*.igs".into()];
    let rig = start(config).await;
    let (_, job) = rig.scan_to_result("roof").await;
    let run = copied(&rig).await;
    assert_eq!(run.attempts, 3);
    assert!(
        run.tried[0].error.as_ref().unwrap().contains("SlowDown"),
        "{run:?}"
    );
    let host = store.address.to_string();
    let folder = format!("/scans/bench%201/{}", job.result);
    let igs = format!("{folder}/roof.igs");
    let all = [&igs, &igs, &igs, &format!("{folder}/manifest.json")];
    for file in all {
        assert_eq!(&signed_for(&store.next(), &host), file);
    }
    store.is_quiet();
    store.will(Answer::Status(403, "<Code>RequestTimeTooSkewed</Code>"));
    let refused: Delivery = rig.client.ask(&path::upload_test("lab")).await;
    let told = error(&refused);
    assert!(
        told.contains("this machine's clock") && told.contains("TooSkewed"),
        "{told}"
    );
    assert!(
        !told.contains(KEY[1]) && !told.contains("Signature"),
        "{told}"
    );
    rig.daemon.shutdown().await;
}

/// OpenSSH's server, where there is one.
struct Sshd(Child);

impl Drop for Sshd {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

const SSHD: &str = "/usr/sbin/sshd";

impl Sshd {
    fn start(folder: &Path, port: u16) -> Self {
        for name in ["host", "user"] {
            let status = Command::new("ssh-keygen")
                .args(["-q", "-t", "ed25519", "-N", "", "-f"])
                .arg(folder.join(name))
                .status();
            assert!(status.unwrap().success());
        }
        let at = |name: &str| folder.join(name).display().to_string();
        fs::copy(folder.join("user.pub"), folder.join("authorized")).unwrap();
        let host = fs::read_to_string(folder.join("host.pub")).unwrap();
        let known = format!("[127.0.0.1]:{port} {host}");
        fs::write(folder.join("known"), known).unwrap();
        // Debian's makes way for one that is not started by the system; root's alone needs it.
        let _ = fs::create_dir_all("/run/sshd");
        let child = Command::new(SSHD)
            .args(["-D", "-e", "-f", "/dev/null", "-h", &at("host")])
            .args(["-o", &format!("AuthorizedKeysFile={}", at("authorized"))])
            .args(["-o", &format!("ListenAddress=127.0.0.1:{port}")])
            .args(["-o", &format!("PidFile={}", at("pid"))])
            .args(["-o", "StrictModes=no", "-o", "UsePAM=no"])
            .args(["-o", "PermitRootLogin=prohibit-password"])
            .args(["-o", "Subsystem=sftp internal-sftp"])
            .stderr(Stdio::null())
            .spawn();
        Self(child.unwrap())
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn another_machine_gets_whole_results_by_sftp() {
    let is_there = ["/usr/bin/sftp", SSHD].map(|program| Path::new(program).exists());
    if is_there.contains(&false) {
        assert!(
            std::env::var_os("RELIEF_NEEDS_SSHD").is_none(),
            "{is_there:?}"
        );
        eprintln!("skipped: there is no server of OpenSSH");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let port = any_port().local_addr().unwrap().port();
    let sshd = Sshd::start(folder.path(), port);
    let place = folder.path().join("in \"the\" hall");
    fs::create_dir(&place).unwrap();
    let user = rustix::process::getuid().as_raw();
    let user = nix::unistd::User::from_uid(user.into()).unwrap().unwrap();
    let mut config = upload(UploadTo::Sftp);
    config.folder = Some(place.clone());
    config.host = Some("127.0.0.1".into());
    config.port = Some(port);
    config.user = Some(user.name);
    config.identity_file = Some(folder.path().join("user"));
    config.known_hosts_file = Some(folder.path().join("known"));
    let rig = start(config).await;
    let (_, job) = rig.scan_to_result("roof").await;
    copied(&rig).await;
    assert_eq!(names(&place), [job.result.as_str()]);
    let (copy, own) = (
        place.join(&job.result),
        rig.daemon.spool_dir().join(&job.result),
    );
    assert_eq!(names(&copy), names(&own));
    for name in names(&own) {
        assert_same(&copy.join(&name), &own.join(&name));
    }
    let again: Delivery = rig.client.ask(&path::upload_test("lab")).await;
    assert_eq!(again.state, DeliveryState::Delivered, "{again:?}");
    // Another machine than the one that is known.
    fs::write(folder.path().join("known"), "").unwrap();
    let unknown: Delivery = rig.client.ask(&path::upload_test("lab")).await;
    assert!(
        error(&unknown).contains("Host key verification failed"),
        "{unknown:?}"
    );
    drop(sshd);
    rig.daemon.shutdown().await;
}
