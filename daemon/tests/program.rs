//! The program `reliefd` as systemd meets it: notifications, watchdog, sockets handed over.

#![allow(clippy::unwrap_used, clippy::panic)] // A test may give up.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::fd::OwnedFd;
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::{UnixDatagram, UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

/// Far longer than anything takes that should happen.
const LIMIT: Duration = Duration::from_secs(60);

/// A service in a folder of its own, with this test in systemd's place.
struct Started {
    child: Child,
    /// Until the test waits for the service's end.
    systemd: Option<UnixDatagram>,
    folder: tempfile::TempDir,
}

impl Drop for Started {
    fn drop(&mut self) {
        // It has ended, unless the test failed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn configuration(folder: &Path) -> PathBuf {
    let place = |name: &str| folder.join(name).display().to_string();
    let text = format!(
        "[service]\nsocket = {:?}\nstate_dir = {:?}\nspool_dir = {:?}\n[scanner]\nport = {:?}\n",
        place("reliefd.sock"),
        place("state"),
        place("spool"),
        place("no-scanner"),
    );
    let file = folder.join("reliefd.toml");
    fs::write(&file, text).unwrap();
    file
}

impl Started {
    /// Starts the service with this socket in its hands.
    fn on(socket: impl FnOnce(&Path) -> OwnedFd) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let notify = folder.path().join("notify");
        let systemd = UnixDatagram::bind(&notify).unwrap();
        systemd.set_read_timeout(Some(LIMIT)).unwrap();
        // As systemd does: the first socket is descriptor 3, and the variables name the process.
        let child = Command::new("/bin/sh")
            .arg("-c")
            .arg("LISTEN_PID=$$ LISTEN_FDS=1 exec \"$0\" --config \"$1\" 3<&0 0</dev/null")
            .arg(env!("CARGO_BIN_EXE_reliefd"))
            .arg(configuration(folder.path()))
            .env("NOTIFY_SOCKET", &notify)
            .env("WATCHDOG_USEC", "200000")
            .env_remove("JOURNAL_STREAM")
            .stdin(Stdio::from(socket(folder.path())))
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        Self {
            child,
            systemd: Some(systemd),
            folder,
        }
    }

    fn systemd(&self) -> &UnixDatagram {
        self.systemd.as_ref().unwrap()
    }

    /// Waits until systemd is told this.
    fn heard(&self, wanted: &str) -> String {
        let start = Instant::now();
        let mut buffer = [0; 4096];
        while start.elapsed() < LIMIT {
            let count = self.systemd().recv(&mut buffer).unwrap();
            let told = String::from_utf8_lossy(&buffer[..count]).into_owned();
            if told.lines().any(|line| line == wanted) {
                return told;
            }
        }
        panic!("systemd is not told {wanted}");
    }

    fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).unwrap();
    }

    /// Its exit code, and what it said.
    fn end(&mut self) -> (Option<i32>, String) {
        // Nobody reads it any more, and a service that sends to a full socket would wait for ever.
        drop(self.systemd.take());
        let mut said = String::new();
        let mut stderr = self.child.stderr.take().unwrap();
        stderr.read_to_string(&mut said).unwrap();
        (self.child.wait().unwrap().code(), said)
    }
}

#[test]
fn it_tells_systemd_how_it_does_and_leaves_its_socket_alone() {
    let mut started = Started::on(|folder| {
        UnixListener::bind(folder.join("reliefd.sock"))
            .unwrap()
            .into()
    });
    started.heard("READY=1");
    for _ in 0..3 {
        let told = started.heard("WATCHDOG=1");
        assert!(told.contains("STATUS=no scan; scanner"), "{told}");
    }

    let socket = started.folder.path().join("reliefd.sock");
    let mut client = UnixStream::connect(&socket).unwrap();
    client
        .write_all(b"GET /v1/status HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        .unwrap();
    let mut answer = String::new();
    client.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");

    started.signal(Signal::HUP);
    let told = started.heard("RELOADING=1");
    assert!(told.contains("MONOTONIC_USEC="), "{told}");
    started.heard("READY=1");

    started.signal(Signal::TERM);
    started.heard("STOPPING=1");
    let (code, said) = started.end();
    assert_eq!(code, Some(0), "{said}");
    assert!(fs::metadata(&socket).unwrap().file_type().is_socket());
}

#[test]
fn a_stopped_process_does_not_feed_the_watchdog() {
    let started = Started::on(|folder| {
        UnixListener::bind(folder.join("reliefd.sock"))
            .unwrap()
            .into()
    });
    started.heard("READY=1");
    started.heard("WATCHDOG=1");
    started.signal(Signal::STOP);
    started.systemd().set_read_timeout(Some(LIMIT)).unwrap();
    // What was sent before it stopped.
    started.systemd().set_nonblocking(true).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    while started.systemd().recv(&mut [0; 4096]).is_ok() {}
    std::thread::sleep(Duration::from_millis(600));
    assert!(started.systemd().recv(&mut [0; 4096]).is_err());
    started.systemd().set_nonblocking(false).unwrap();
    started.signal(Signal::CONT);
    started.heard("WATCHDOG=1");
}

#[test]
fn a_socket_for_other_machines_is_refused() {
    let mut started = Started::on(|_| std::net::TcpListener::bind("0.0.0.0:0").unwrap().into());
    let (code, said) = started.end();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("loopback addresses only"), "{said}");
}

#[test]
fn a_wrong_configuration_is_told_by_an_exit_code_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("reliefd.toml");
    fs::write(&file, "[scanner]\nbaudd = 9600\n").unwrap();
    for arguments in [&[][..], &["--check-config"]] {
        let output = Command::new(env!("CARGO_BIN_EXE_reliefd"))
            .arg("--config")
            .arg(&file)
            .args(arguments)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(78), "{said}");
        assert!(said.contains("did you mean `baud`"), "{said}");
    }
}

#[test]
fn a_look_at_the_configuration_tells_of_each_of_several_scanners() {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config");
    let told = |name: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_reliefd"))
            .current_dir(&config)
            .args(["--check-config", "--config", name])
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(0));
        String::from_utf8(output.stdout).unwrap()
    };
    assert_eq!(told("serial.toml"), "serial.toml: sound\n");
    assert_eq!(
        told("two-scanners.toml"),
        "two-scanners.toml: sound\nscanner left: /dev/relief/scanner-000123\n\
         scanner right: USB 1209:0001, serial 000124\n"
    );
}

/// Whether a process runs; one that has ended stays until somebody has waited for it.
fn runs(pid: &str) -> bool {
    let status = fs::read_to_string(format!("/proc/{pid}/stat"));
    status.is_ok_and(|status| !status.contains(") Z "))
}

#[test]
fn a_hook_ends_with_the_service() {
    let confined = r#"{"parent": %d, "cpu_s": 60, "memory_bytes": 4000000000, "file_bytes": 1,
        "processes": 60000, "folders": null, "command": ["/bin/sleep", "600"]}"#;
    // A shell in the service's place.
    let mut service = Command::new("/bin/sh")
        .args([
            "-c",
            "\"$0\" hook-child \"$(printf \"$1\" $$)\" & echo $!; wait",
        ])
        .args([env!("CARGO_BIN_EXE_reliefd"), confined])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut pid = String::new();
    let mut told = BufReader::new(service.stdout.take().unwrap());
    told.read_line(&mut pid).unwrap();
    let pid = pid.trim();
    let begun = Instant::now();
    let name = || fs::read_to_string(format!("/proc/{pid}/comm")).unwrap_or_default();
    while name() != "sleep\n" {
        assert!(begun.elapsed() < LIMIT, "the hook does not begin");
        std::thread::sleep(Duration::from_millis(5));
    }
    service.kill().unwrap();
    service.wait().unwrap();
    while runs(pid) {
        assert!(begun.elapsed() < LIMIT, "the hook has outlived the service");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_hook_that_cannot_be_confined_is_not_begun() {
    let other = r#"{"parent": 1, "cpu_s": 60, "memory_bytes": 4000000000, "file_bytes": 1,
        "processes": 60000, "folders": null, "command": ["/bin/echo", "begun"]}"#;
    for (arguments, why) in [
        (&["hook-child"][..], "this is how the service runs hooks"),
        (&["hook-child", "{}"], "this is how the service runs hooks"),
        (&["hook-child", other], "the service has ended"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_reliefd"));
        let output = command.args(arguments).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(125), "{told}");
        assert!(told.contains(why), "{told}");
        assert!(output.stdout.is_empty());
    }
}
