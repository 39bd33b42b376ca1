use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex, PoisonError};

use relief_api::{ScannerLink, ScannerStatus, ScannerSummary};

use super::*;

const SHORT: Duration = Duration::from_millis(5);

/// Many times the interval: enough for a meal that should not come to come.
const A_WHILE: Duration = Duration::from_millis(100);

/// Far longer than anything takes that should happen.
const LIMIT: Duration = Duration::from_secs(60);

/// Runs the watchdog on a runtime with one thread; what it tells comes out of the channel.
fn fed(
    look: impl Fn() -> Result<String, Stuck> + Clone + Send + 'static,
) -> (tokio::runtime::Runtime, Receiver<String>) {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .unwrap();
    let (told, heard) = channel();
    let told: Mutex<Sender<String>> = Mutex::new(told);
    runtime.spawn(run(SHORT, look, move |states| {
        let text: Vec<String> = states.iter().map(ToString::to_string).collect();
        let told = told.lock().unwrap_or_else(PoisonError::into_inner);
        // The test may be over.
        let _ = told.send(text.join(" "));
    }));
    (runtime, heard)
}

fn well() -> Result<String, Stuck> {
    Ok("idle".into())
}

/// Whether anything is told within a while, once what was under way has come.
fn is_silent(heard: &Receiver<String>) -> bool {
    std::thread::sleep(A_WHILE);
    while heard.try_recv().is_ok() {}
    heard.recv_timeout(A_WHILE).is_err()
}

#[test]
fn who_is_well_is_fed() {
    let (_runtime, heard) = fed(well);
    for _ in 0..3 {
        assert_eq!(heard.recv_timeout(LIMIT).unwrap(), "WATCHDOG=1 STATUS=idle");
    }
}

#[test]
fn a_hung_runtime_gets_no_food() {
    let (runtime, heard) = fed(well);
    heard.recv_timeout(LIMIT).unwrap();
    let (release, hold) = channel::<()>();
    let (began, begun) = channel();
    // Its only thread waits here.
    runtime.spawn(async move {
        began.send(()).unwrap();
        let _ = hold.recv();
    });
    begun.recv_timeout(LIMIT).unwrap();
    assert!(is_silent(&heard));
    drop(release);
    heard.recv_timeout(LIMIT).unwrap();
}

#[test]
fn a_lock_that_is_never_given_back_gets_no_food() {
    let lock = Arc::new(Mutex::new(()));
    let looked_at = Arc::clone(&lock);
    let (_runtime, heard) = fed(move || {
        let _held = looked_at.lock().unwrap_or_else(PoisonError::into_inner);
        well()
    });
    heard.recv_timeout(LIMIT).unwrap();
    let held = lock.lock().unwrap();
    while heard.try_recv().is_ok() {}
    // Of a look that ended just before, what it saw is still to be told, however late.
    let told = (0..2).filter(|_| heard.recv_timeout(A_WHILE).is_ok());
    assert!(told.count() <= 1);
    drop(held);
    heard.recv_timeout(LIMIT).unwrap();
}

#[test]
fn a_loop_that_is_stuck_gets_no_food_and_is_named() {
    let (_runtime, heard) = fed(|| {
        Err(Stuck::Panicked {
            name: "worker-1".into(),
        })
    });
    for _ in 0..3 {
        let told = heard.recv_timeout(LIMIT).unwrap();
        assert_eq!(told, "STATUS=worker-1 ended by a panic");
    }
}

#[test]
fn what_is_told_is_one_line() {
    let mut status = Status {
        version: String::new(),
        started_at: String::new(),
        scanners: Vec::new(),
        scanner: ScannerStatus {
            name: "scanner".into(),
            link: ScannerLink::Trouble,
            endpoint: String::new(),
            model: None,
            serial: None,
            firmware: None,
            problem: Some("it says \"a\nMAINPID=1\"".into()),
            calibration: None,
        },
        scan: None,
        storage: None,
        laser: None,
        jobs_queued: 2,
        jobs_running: 1,
        spool: String::new(),
    };
    assert_eq!(
        line(&status),
        "no scan; scanner in trouble: it says \"a MAINPID=1\"; jobs: 1 running, 2 waiting"
    );
    status.jobs_running = 0;
    status.jobs_queued = 0;
    status.scanner.problem = None;
    assert_eq!(line(&status), "no scan; scanner trouble");
    let scan = r#"{"id": "s", "name": "n", "state": "paused", "reason": "the cable was pulled",
        "started_at": "", "columns": 3, "columns_planned": 9}"#;
    status.scan = Some(serde_json::from_str(scan).unwrap());
    assert_eq!(
        line(&status),
        "scan s: 3 of 9 columns, paused: the cable was pulled"
    );
    let summary = |name: &str, problem: Option<&str>, scan: Option<Scan>| ScannerSummary {
        status: ScannerStatus {
            name: name.into(),
            problem: problem.map(str::to_owned),
            ..status.scanner.clone()
        },
        laser: None,
        scan,
    };
    let scanners = vec![
        summary("left", None, status.scan.clone()),
        summary("right", Some("it\nburns"), None),
    ];
    status.scanners = scanners;
    assert_eq!(
        line(&status),
        "left: scan s: 3 of 9 columns, paused: the cable was pulled; right: no scan; scanner in \
         trouble: it burns"
    );
}

#[test]
fn meals_come_several_times_in_the_watchdogs_time() {
    assert_eq!(
        interval(Some(Duration::from_secs(4))),
        Duration::from_secs(1)
    );
    assert_eq!(interval(Some(Duration::from_secs(3600))), UNWATCHED);
    assert_eq!(interval(None), UNWATCHED);
}
