//! The laser's state, its log, and that it is off however the service ends.

use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command};
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use relief_api::{LaserEntry, LaserLog, LaserState, Scan, ScanState, StartScan, Status, path};
use sim_scanner::config::SimConfig;
use sim_scanner::control::Control;
use sim_scanner::device::{DeviceSettings, Event as Happened};
use sim_scanner::preset::Overrides;

use crate::client::Client;
use crate::rig::{Rig, ended};

/// A dead-man time that does not pass by itself on a busy machine.
const LONG_MS: u32 = 10_000;

/// One that a test waits for.
const SHORT_MS: u32 = 3_000;

/// Nothing here takes as long, unless it hangs.
const GUARD: Duration = Duration::from_secs(60);

async fn log(client: &Client) -> Vec<LaserEntry> {
    client.get::<LaserLog>(path::LASER).await.entries
}

/// States and causes of a scan's entries.
fn of<'a>(log: &'a [LaserEntry], scan: &Scan) -> Vec<(LaserState, &'a str)> {
    log.iter()
        .filter(|entry| entry.scan.as_ref() == Some(&scan.id))
        .map(|entry| (entry.laser, entry.cause.as_str()))
        .collect()
}

/// Waits until the service knows that the laser is in this state.
async fn known_as(client: &Client, wanted: LaserState) {
    let known = async {
        loop {
            let status: Status = client.get(path::STATUS).await;
            if status.laser.is_some_and(|laser| laser.laser == wanted) {
                return;
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::time::timeout(GUARD, known)
        .await
        .expect("the scanner is asked");
}

#[tokio::test(flavor = "multi_thread")]
async fn every_change_is_logged_with_its_cause() {
    let rig = Rig::new().await;
    let (complete, _) = rig.scan_to_result("complete").await;

    let mut events = rig.client.events().await;
    rig.scanner.allow(3);
    let aborted = rig.start_scan("aborted").await;
    known_as(&rig.client, LaserState::On).await;
    let _: Scan = rig.client.ask(path::ABORT).await;
    let aborted = ended(&mut events, &aborted.id).await;
    assert_eq!(aborted.state, ScanState::Aborted);

    rig.scanner.allow_all();
    rig.scanner.fault_after(5);
    let failed = rig.start_scan("failed").await;
    let failed = ended(&mut events, &failed.id).await;
    assert_eq!(failed.state, ScanState::Failed);
    known_as(&rig.client, LaserState::Off).await;

    let entries = log(&rig.client).await;
    let begins = (LaserState::On, "a scan begins");
    assert_eq!(
        of(&entries, &complete),
        [begins, (LaserState::Off, "the scan is complete")]
    );
    assert_eq!(
        of(&entries, &aborted),
        [begins, (LaserState::Off, "aborted on request")]
    );
    // Whoever asked first, the service that stopped a scanner in trouble or the look after it.
    let after = of(&entries, &failed);
    assert_eq!(after[0], begins);
    assert!(after.len() <= 2 && entries.last().unwrap().laser == LaserState::Off);
    assert!(entries.is_sorted_by(|a, b| a.at <= b.at));

    // The same on disk, a line each, and after a restart.
    let text = std::fs::read_to_string(rig.folder.path().join("state/laser.jsonl")).unwrap();
    let lines = text.lines().map(|line| serde_json::from_str(line).unwrap());
    assert_eq!(lines.collect::<Vec<LaserEntry>>(), entries);
    let rig = rig.restart().await;
    assert_eq!(log(&rig.client).await[..entries.len()], entries);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_laser_that_is_on_without_a_scan_is_seen() {
    let rig = Rig::new().await;
    known_as(&rig.client, LaserState::Off).await;
    rig.scanner.switch_laser(true);
    known_as(&rig.client, LaserState::On).await;
    let entries = log(&rig.client).await;
    assert_eq!(
        entries.last().unwrap().cause,
        "the scanner says that it is on"
    );
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_without_a_place_to_keep_it_ends_with_the_laser_off() {
    let rig = Rig::new().await;
    let kept = rig.folder.path().join("state/scans");
    std::fs::remove_dir_all(&kept).unwrap();
    std::fs::write(&kept, "in the way").unwrap();
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("nowhere").await;
    let scan = ended(&mut events, &scan.id).await;
    assert_eq!(scan.state, ScanState::Failed);
    rig.scanner.laser_goes_off();
    known_as(&rig.client, LaserState::Off).await;
    rig.daemon.shutdown().await;
}

/// The program, in the midst of a scan.
struct Running {
    child: Child,
    control: Control,
    folder: tempfile::TempDir,
    // Last, so that the service goes before its scanner.
    _scanner: sim_scanner::endpoint::pty::PtyServer,
}

async fn scanning(dead_man_ms: u32) -> Running {
    let scanner = SimConfig {
        overrides: Overrides {
            columns: Some(2_000),
            samples: Some(64),
            ..Overrides::default()
        },
        device: DeviceSettings {
            table_speed_mm_s: f64::INFINITY,
            // Minutes for the scan: longer than any of this takes.
            line_rate_hz: Some(10.0),
            ..DeviceSettings::default()
        },
        ..SimConfig::default()
    };
    let scanner = scanner.serve_pty(None).unwrap();
    let control = scanner.control();
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let config = format!(
        "[service]\nsocket = \"{at}/s\"\nstate_dir = \"{at}/state\"\nspool_dir = \"{at}/spool\"\n\
         [scanner]\nport = \"{}\"\ndead_man_ms = {dead_man_ms}\n",
        scanner.port().display(),
        at = at.display()
    );
    std::fs::write(at.join("c.toml"), config).unwrap();
    let child = start(at);
    let client = up(at).await;
    let _: Scan = client.post(path::SCANS, &StartScan::default()).await;
    control.wait_until(GUARD, |device| device.laser_on).unwrap();
    known_as(&client, LaserState::On).await;
    let kept = async {
        loop {
            let status: Status = client.get(path::STATUS).await;
            if status.scan.is_some_and(|scan| scan.columns > 0) {
                return;
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    let kept = tokio::time::timeout(GUARD, kept).await;
    kept.expect("a column is kept");
    Running {
        child,
        control,
        folder,
        _scanner: scanner,
    }
}

fn start(folder: &Path) -> Child {
    // What a shell runs in its background inherits that these are ignored; a service does not.
    Command::new("env")
        .arg("--default-signal=QUIT,INT")
        .arg(env!("CARGO_BIN_EXE_reliefd"))
        .arg("--config")
        .arg(folder.join("c.toml"))
        // Where a core dump is removed with all else.
        .current_dir(folder)
        .stderr(std::fs::File::create(folder.join("log")).unwrap())
        .spawn()
        .unwrap()
}

/// Waits until the service answers.
async fn up(folder: &Path) -> Client {
    let socket = folder.join("s");
    let up = async {
        while tokio::net::UnixStream::connect(&socket).await.is_err() {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    if tokio::time::timeout(GUARD, up).await.is_err() {
        panic!(
            "the service does not start: {}",
            std::fs::read_to_string(folder.join("log")).unwrap()
        );
    }
    Client::new(&socket)
}

impl Drop for Running {
    fn drop(&mut self) {
        // After a test that failed; else it has ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Running {
    fn signal(&self, signal: Signal) {
        let id = i32::try_from(self.child.id()).unwrap();
        kill(Pid::from_raw(id), signal).unwrap();
    }

    fn laser_goes_off(&mut self) {
        self.control
            .wait_until(GUARD, |device| !device.laser_on)
            .unwrap();
    }

    fn dead_man_was_there(&self) -> bool {
        self.control.events().contains(&Happened::DeadMan)
    }

    fn logged(&self) -> Vec<LaserEntry> {
        let text = std::fs::read_to_string(self.folder.path().join("state/laser.jsonl")).unwrap();
        text.lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect()
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn asked_to_end_the_service_turns_the_laser_off_itself() {
    for signal in [Signal::SIGTERM, Signal::SIGINT] {
        let mut running = scanning(LONG_MS).await;
        running.signal(signal);
        let status = running.child.wait().unwrap();
        assert!(status.success(), "{signal}: {status}");
        assert!(!running.control.snapshot().laser_on, "{signal}");
        assert!(!running.dead_man_was_there(), "{signal}");
        let last = running.logged().pop().unwrap();
        assert_eq!(last.laser, LaserState::Off, "{signal}");
        assert_eq!(last.cause, "the service was stopped", "{signal}");
    }
}

/// SIGABRT is what the watchdog of systemd sends, and how a program aborts itself.
#[tokio::test(flavor = "multi_thread")]
async fn killed_in_any_way_the_service_leaves_the_laser_to_the_dead_man() {
    for signal in [Signal::SIGABRT, Signal::SIGKILL, Signal::SIGQUIT] {
        let mut running = scanning(SHORT_MS).await;
        running.signal(signal);
        let status = running.child.wait().unwrap();
        assert_eq!(status.signal(), Some(signal as i32));
        running.laser_goes_off();
        assert_eq!(running.logged().pop().unwrap().laser, LaserState::On);

        // The next start says what nobody saw, and goes on.
        let at = running.folder.path().to_owned();
        running.child = start(&at);
        let client = up(&at).await;
        known_as(&client, LaserState::On).await;
        let logged = running.logged();
        // In between the scanner may have been asked, and more be said of the pause.
        let unknown = |cause: &str| {
            let is_it = |entry: &LaserEntry| {
                entry.laser == LaserState::Unknown && entry.cause.contains(cause)
            };
            logged.iter().position(is_it)
        };
        let (Some(dead), Some(taken_up)) = (unknown("dead-man"), unknown("taken up")) else {
            panic!("{logged:?}");
        };
        assert!(dead < taken_up, "{logged:?}");
        let (taken_up, on) = (&logged[taken_up], logged.last().unwrap());
        assert!(on.scan.is_some() && on.scan == taken_up.scan, "{logged:?}");
        running.signal(Signal::SIGTERM);
        assert!(running.child.wait().unwrap().success());
        assert_eq!(running.logged().pop().unwrap().laser, LaserState::Off);
        assert!(!running.control.snapshot().laser_on);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_hangs_leaves_the_laser_to_the_dead_man() {
    let mut running = scanning(SHORT_MS).await;
    running.signal(Signal::SIGSTOP);
    running.laser_goes_off();
    assert!(running.dead_man_was_there());
    running.signal(Signal::SIGCONT);
    running.signal(Signal::SIGTERM);
    assert!(running.child.wait().unwrap().success());
    assert!(!running.control.snapshot().laser_on);
}

#[tokio::test(flavor = "multi_thread")]
async fn without_its_socket_the_service_still_ends_with_the_laser_off() {
    let mut running = scanning(LONG_MS).await;
    std::fs::remove_file(running.folder.path().join("s")).unwrap();
    running.signal(Signal::SIGTERM);
    assert!(running.child.wait().unwrap().success());
    assert!(!running.control.snapshot().laser_on);
    assert!(!running.dead_man_was_there());
}
