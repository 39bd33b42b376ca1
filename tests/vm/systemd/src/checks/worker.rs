//! A worker as the package runs it: jobs of the bench go to it by way of a NATS server, which knows
//! both by a token.

use std::fs;
use std::os::unix::fs::{PermissionsExt, chown};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

use super::service::anew;
use crate::bench::{Bench, ready, relief, text};
use crate::system::{id_of, is_active, process_status, systemctl, try_run, wait};

const CONFIGURATION: &str = "/etc/relief/reliefd.toml";
const WORKER: &str = "relief-worker.service";
const ADDRESS: &str = "127.0.0.1";
/// Not the one on which Debian's own unit listens.
const PORT: &str = "4333";
/// Room for this on the machine's small disk is promised to the bench.
const QUOTA_MB: u32 = 64;
const TOKEN: &str = "a token of the checks";
/// For the service to read, and for systemd to hand to the worker.
const TOKEN_FILES: [&str; 2] = ["/etc/relief/nats.token", "/etc/relief/worker.token"];
const OPENED: &str = "/etc/systemd/system/reliefd.service.d";
const TOLD: &str = "/etc/systemd/system/relief-worker.service.d";

/// Killed when dropped.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub(super) fn elsewhere(bench: &mut Bench) -> Result<()> {
    let server = Command::new("nats-server")
        .args([
            "-a",
            ADDRESS,
            "-p",
            PORT,
            "--auth",
            TOKEN,
            "-js",
            "-sd",
            "/tmp/nats",
        ])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .map(Server)
        .context("cannot start nats-server")?;
    let before = fs::read_to_string(CONFIGURATION)?;
    for file in TOKEN_FILES {
        fs::write(file, TOKEN)?;
        fs::set_permissions(file, fs::Permissions::from_mode(0o600))?;
    }
    let [of_service, of_worker] = TOKEN_FILES;
    chown(of_service, Some(id_of("/etc/passwd", "relief")?), None)?;
    let servers = format!(
        "[nats]\nservers = [\"nats://{ADDRESS}:{PORT}\"]\ntoken_file = {of_service:?}\nquota_mb = {QUOTA_MB}\n"
    );
    let now = before
        .replace(
            "# roles = [\"acquire\", \"work\", \"serve\"]",
            "roles = [\"acquire\", \"serve\"]",
        )
        .replace("[nats]\n", &servers);
    ensure!(
        now.contains(of_service) && now.contains("\nroles ="),
        "{now}"
    );
    fs::write(CONFIGURATION, now)?;
    fs::create_dir_all(OPENED)?;
    fs::copy("/packages/network.conf", format!("{OPENED}/network.conf"))?;
    fs::create_dir_all(TOLD)?;
    fs::write(
        format!("{TOLD}/here.conf"),
        format!(
            "[Service]\n\
             Environment=RELIEF_WORKER=\"--connect nats://{ADDRESS}:{PORT} --token-file %d/token\"\n\
             LoadCredential=token:{of_worker}\n"
        ),
    )?;
    anew()?;
    ready()?;
    systemctl(&["start", WORKER])?;
    wait("the worker is there", || {
        if !is_active(WORKER)? {
            // Its last words may be on their way to the journal.
            std::thread::sleep(Duration::from_secs(2));
            let words = ["status", WORKER, "--lines", "9", "--no-pager", "--full"];
            let (_, log, _) = try_run("systemctl", &words)?;
            bail!("the worker has ended: {log}");
        }
        let fleet = relief(&["fleet"])?;
        Ok(fleet["workers"]
            .as_array()
            .is_some_and(|all| !all.is_empty()))
    })?;
    let pid: u32 = systemctl(&["show", WORKER, "--value", "--property", "MainPID"])?.parse()?;
    let user = process_status(pid, "Uid")?;
    ensure!(
        !user.split_whitespace().any(|id| id == "0"),
        "it runs as {user}"
    );
    ensure!(
        process_status(pid, "CapEff")? == "0000000000000000",
        "it may do more than it should"
    );

    let id = text(&relief(&["scan", "--name", "house"])?["scan"]["id"])?;
    let job = || -> Result<Value> {
        let jobs = relief(&["jobs"])?;
        let all = jobs["jobs"].as_array();
        let found = all.and_then(|all| all.iter().find(|job| job["scan"] == *id));
        Ok(found.cloned().unwrap_or_default())
    };
    let done = wait("a worker does the job", || Ok(job()?["state"] == "done"));
    done.with_context(|| format!("{:?}, {:?}", job(), relief(&["fleet"])))?;
    ensure!(
        job()?["worker"].is_string(),
        "no worker had it: {:?}",
        job()
    );
    bench.picture_of(&id)?;
    let (well, said, error) = try_run("systemctl", &["stop", WORKER])?;
    ensure!(well, "{said}{error}");
    let result = systemctl(&["show", WORKER, "--value", "--property", "Result"])?;
    ensure!(result == "success", "its end was {result}");

    for folder in [OPENED, TOLD] {
        fs::remove_dir_all(folder)?;
    }
    for file in TOKEN_FILES {
        fs::remove_file(file)?;
    }
    fs::write(CONFIGURATION, before)?;
    anew()?;
    drop(server);
    ready().map(drop)
}
