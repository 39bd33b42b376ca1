//! The service as systemd runs it: sandbox, journal, sockets, configuration.

use std::fs::{self, read_link};
use std::io::{Read, Write};
use std::net::TcpStream;

use anyhow::{Context, Result, ensure};

use crate::bench::{Bench, PORT, ready, relief};
use crate::system::{
    SERVICE, SOCKET, id_of, is_active, journal as entries, number, process_status, property,
    systemctl, try_run,
};

const CONFIGURATION: &str = "/etc/relief/reliefd.toml";
const WRONG_CONFIGURATION: &str = "78";

pub(super) fn sandbox(_: &mut Bench) -> Result<()> {
    is_sandboxed()
}

fn is_sandboxed() -> Result<()> {
    let pid = number("MainPID")?;
    let user = id_of("/etc/passwd", "relief")?.to_string();
    let users = process_status(pid, "Uid")?;
    ensure!(users.split_whitespace().all(|id| id == user), "{users}");
    for (field, wanted) in [
        ("NoNewPrivs", "1"),
        ("Seccomp", "2"),
        ("CapEff", "0000000000000000"),
        ("CapBnd", "0000000000000000"),
    ] {
        let found = process_status(pid, field)?;
        ensure!(found == wanted, "{field} is {found}");
    }
    let network = |process: &str| read_link(format!("/proc/{process}/ns/net"));
    ensure!(
        network(&pid.to_string())? != network("self")?,
        "it has a network"
    );
    // What it sees of the machine.
    let root = format!("/proc/{pid}/root");
    ensure!(
        fs::read_dir(format!("{root}/root"))?.next().is_none(),
        "it sees /root"
    );
    let mounts = fs::read_to_string(format!("/proc/{pid}/mounts"))?;
    let writable = |place: &str| {
        mounts.lines().rev().any(|line| {
            let mut fields = line.split(' ').skip(1);
            fields.next() == Some(place)
                && fields
                    .nth(1)
                    .is_some_and(|o| o.split(',').any(|option| option == "rw"))
        })
    };
    ensure!(!writable("/"), "it may write everywhere");
    for place in ["/var/lib/relief", "/var/spool/relief", "/run/relief"] {
        ensure!(writable(place), "{place} is not writable");
    }
    Ok(())
}

pub(super) fn journal(bench: &mut Bench) -> Result<()> {
    let field = format!("RELIEF_SCAN={}", bench.first()?);
    let entries = entries(&["--unit", SERVICE, &field])?;
    let complete = entries
        .iter()
        .find(|entry| {
            entry["MESSAGE"]
                .as_str()
                .is_some_and(|m| m.starts_with("scan complete"))
        })
        .with_context(|| format!("no entry on the end of the scan in {entries:?}"))?;
    // What `journalctl` shows names the scan too.
    let message = format!("scan complete scan={}", bench.first()?);
    let user = id_of("/etc/passwd", "relief")?.to_string();
    for (field, wanted) in [
        ("MESSAGE", message.as_str()),
        ("RELIEF_SCAN", bench.first()?),
        ("PRIORITY", "6"),
        ("SYSLOG_IDENTIFIER", "reliefd"),
        ("_SYSTEMD_UNIT", SERVICE),
        ("_UID", &user),
        ("_TRANSPORT", "journal"),
    ] {
        ensure!(complete[field] == wanted, "{field} is {}", complete[field]);
    }
    for field in ["TARGET", "CODE_FILE", "CODE_LINE"] {
        ensure!(complete[field].is_string(), "no {field} in {complete}");
    }
    let of_its_job = entries.iter().any(|entry| entry["RELIEF_JOB"] == "1");
    ensure!(of_its_job, "no entry on its job");
    Ok(())
}

pub(super) fn activation(bench: &mut Bench) -> Result<()> {
    systemctl(&["stop", SERVICE])?;
    ensure!(!is_active(SERVICE)? && is_active(SOCKET)?);
    // Waits until the service is there, and is not refused.
    relief(&["status"])?;
    ensure!(is_active(SERVICE)?, "it does not run");
    bench.first_is_kept()
}

pub(super) fn loopback(_: &mut Bench) -> Result<()> {
    const PLACE: &str = "/etc/systemd/system/reliefd.socket.d";
    fs::create_dir_all(PLACE)?;
    fs::copy("/packages/loopback.conf", format!("{PLACE}/loopback.conf"))?;
    anew()?;
    let mut answer = String::new();
    let mut client = TcpStream::connect("127.0.0.1:7437").context("nobody listens")?;
    client.write_all(b"GET /v1/status HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")?;
    client.read_to_string(&mut answer)?;
    // Whether that is an answer or a refusal is for other tests.
    ensure!(answer.starts_with("HTTP/1.1 "), "{answer}");
    is_sandboxed()?;
    fs::remove_dir_all(PLACE)?;
    anew()?;
    ensure!(
        TcpStream::connect("127.0.0.1:7437").is_err(),
        "somebody still listens"
    );
    Ok(())
}

/// A process of the unit itself may open what it needs and nothing else, however open the nodes
/// are.
pub(super) fn devices(_: &mut Bench) -> Result<()> {
    const PLACE: &str = "/etc/systemd/system/reliefd.service.d";
    const OPENED: &str = "/run/relief/opened";
    // The kernel's log, memory, a disk and the way to file systems of one's own: for everybody, as
    // far as their modes say.
    let foreign = [
        ("/dev/foreign-log", "c", "1", "11"),
        ("/dev/foreign-memory", "c", "1", "1"),
        ("/dev/foreign-disk", "b", "7", "0"),
        ("/dev/foreign-fuse", "c", "10", "229"),
    ];
    for (node, kind, major, minor) in foreign {
        let (made, _, said) = try_run("mknod", &["-m", "666", node, kind, major, minor])?;
        ensure!(made, "{node}: {said}");
    }
    let nodes: Vec<&str> = foreign.iter().map(|(node, ..)| *node).collect();
    fs::create_dir_all(PLACE)?;
    fs::write(
        format!("{PLACE}/opened.conf"),
        format!(
            "[Service]\nExecStartPre=/bin/sh -c 'for node in /dev/null {PORT} {}; do \
             dd if=$$node of=/dev/null count=0 iflag=nonblock 2>/dev/null && echo $$node; done \
             >{OPENED}; true'\n",
            nodes.join(" ")
        ),
    )?;
    anew()?;
    let opened = fs::read_to_string(OPENED)?;
    ensure!(
        opened == format!("/dev/null\n{PORT}\n"),
        "it opens {opened}"
    );
    fs::remove_file(OPENED)?;
    fs::remove_dir_all(PLACE)?;
    for node in nodes {
        fs::remove_file(node)?;
    }
    anew()?;
    ready().map(drop)
}

/// With the units as they are now.
pub(super) fn anew() -> Result<()> {
    systemctl(&["daemon-reload"])?;
    systemctl(&["stop", SOCKET, SERVICE])?;
    systemctl(&["start", SERVICE])?;
    Ok(())
}

pub(super) fn configuration(_: &mut Bench) -> Result<()> {
    let sound = fs::read_to_string(CONFIGURATION)?;
    let (pid, restarts) = (number("MainPID")?, number("NRestarts")?);
    systemctl(&["reload", SERVICE])?;
    ready()?;
    ensure!(
        number("MainPID")? == pid,
        "reading it again started another process"
    );
    fs::write(CONFIGURATION, format!("{sound}\nbaudd = 1\n"))?;
    let (well, _, _) = try_run("systemctl", &["restart", SERVICE])?;
    ensure!(!well, "it starts with an unsound configuration");
    ensure!(property("ExecMainStatus")? == WRONG_CONFIGURATION);
    // Longer than it takes to try again.
    std::thread::sleep(std::time::Duration::from_secs(5));
    ensure!(
        property("ActiveState")? == "failed",
        "{}",
        property("ActiveState")?
    );
    ensure!(number("NRestarts")? <= restarts, "it was tried again");
    fs::write(CONFIGURATION, sound)?;
    systemctl(&["reset-failed", SERVICE])?;
    systemctl(&["restart", SOCKET, SERVICE])?;
    ready()?;
    Ok(())
}
