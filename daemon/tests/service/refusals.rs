use relief_api::{Event, Problem, Scan, ScannerLink, StartScan, Status, path};
use reliefd::Daemon;
use scanner_driver::ScannerError;
use serde_json::json;

use crate::client::Client;
use crate::fake::FakeScanner;
use crate::rig::{Rig, config, ended};

async fn refused(client: &Client, method: &str, path: &str, body: Option<&str>) -> Problem {
    client.request(method, path, body).await.problem()
}

fn is_ready(event: &Event) -> Option<()> {
    match event {
        Event::Scanner(scanner) if scanner.link == ScannerLink::Ready => Some(()),
        _ => None,
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn wrong_requests_are_refused_with_a_way_out() {
    let rig = Rig::new().await;
    let body = |settings: serde_json::Value| json!({ "settings": settings }).to_string();
    for (request, status, kind, text) in [
        (
            body(json!({"regrid.neigbours": 9})),
            400,
            "wrong-setting",
            "setting `regrid.neigbours`: unknown key `neigbours`; did you mean `neighbours`?",
        ),
        (
            body(json!({"regid.pitch_mm": 1})),
            400,
            "wrong-setting",
            "there is no section [regid]",
        ),
        (
            body(json!({"regrid.pitch_mm": -1})),
            400,
            "wrong-setting",
            "-1 is out of range: a positive number is needed",
        ),
        (
            body(json!({"segment.clusters": 0})),
            400,
            "wrong-setting",
            "clusters is 0, but must be 1 to 1000",
        ),
        (
            json!({"plan": {"x_first_mm": -3.0}}).to_string(),
            400,
            "impossible-scan",
            "-3 mm is beyond the scanner's table, which goes from 0.000 to 100.000 mm",
        ),
        (
            json!({"plan": {"angle_first_deg": 3.0}}).to_string(),
            400,
            "impossible-scan",
            "profile sensor",
        ),
        (
            json!({"nam": "x"}).to_string(),
            400,
            "wrong-body",
            "unknown field `nam`",
        ),
        ("{".to_owned(), 400, "wrong-body", "EOF while parsing"),
        (
            json!({ "note": "x".repeat(300_000) }).to_string(),
            413,
            "wrong-body",
            "length limit",
        ),
    ] {
        let problem = refused(&rig.client, "POST", path::SCANS, Some(&request)).await;
        assert_eq!(
            (problem.status, problem.kind.as_str()),
            (status, kind),
            "{problem}"
        );
        assert!(problem.detail.contains(text), "{}", problem.detail);
    }
    for (method, path, status, kind) in [
        ("GET", "/v1/scans/nothing", 404, "no-such-scan"),
        ("GET", "/v1/jobs/77", 404, "no-such-job"),
        ("GET", "/v1/jobs/x", 404, "no-such-job"),
        ("POST", "/v1/jobs/77/retry", 404, "no-such-job"),
        ("POST", "/v1/abort", 409, "nothing-to-abort"),
        ("GET", "/v2/status", 404, "no-such-path"),
        ("DELETE", "/v1/scans", 405, "method-not-allowed"),
        ("GET", "/v1/spool/..%2Fstate", 404, "not-in-spool"),
        (
            "GET",
            "/v1/spool/..%2Fstate/reliefd.redb",
            404,
            "not-in-spool",
        ),
        ("GET", "/v1/spool/%2E%2E/reliefd.redb", 404, "not-in-spool"),
        ("GET", "/v1/scans/..%2F..%2Fx/journal", 404, "no-such-scan"),
    ] {
        let problem = refused(&rig.client, method, path, None).await;
        assert_eq!(
            (problem.status, problem.kind.as_str()),
            (status, kind),
            "{path}"
        );
    }
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn one_scan_at_a_time() {
    let rig = Rig::new().await;
    rig.scanner.allow(3);
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("one").await;
    let problem = refused(&rig.client, "POST", path::SCANS, None).await;
    assert_eq!(
        (problem.status, problem.kind.as_str()),
        (409, "scanner-busy")
    );
    assert_eq!(
        problem.detail,
        format!("the scanner is taking the scan {}", scan.id)
    );
    let problem = refused(&rig.client, "POST", &path::scan_rerun(&scan.id), None).await;
    assert_eq!(problem.kind, "scan-not-over");
    rig.scanner.allow_all();
    ended(&mut events, &scan.id).await;
    let problem = refused(&rig.client, "POST", &path::scan_abort(&scan.id), None).await;
    assert_eq!(problem.kind, "scan-is-over");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn trouble_with_the_scanner_is_told_in_its_own_words() {
    let rig = Rig::new().await;
    let mut events = rig.client.events().await;
    let status: Status = rig.client.get(path::STATUS).await;
    if status.scanner.link != ScannerLink::Ready {
        // So that what the first look at it has seen is not noted after the trouble.
        events.until(is_ready).await;
    }
    let port = || "/dev/ttyUSB7".to_owned();
    for (trouble, status, kind, text, key) in [
        (
            ScannerError::NoSuchPort { port: port() },
            503,
            "no-such-port",
            "there is no port /dev/ttyUSB7",
            "scanner.port",
        ),
        (
            ScannerError::PortBusy {
                port: port(),
                holder: Some("minicom (4711)".into()),
            },
            503,
            "port-busy",
            "in use by minicom (4711)",
            "scanner.port",
        ),
        (
            ScannerError::WrongDevice {
                port: port(),
                heard: "$GPGGA".into(),
            },
            502,
            "wrong-device",
            "not as a scanner: $GPGGA",
            "scanner.port",
        ),
        (
            ScannerError::NotOnUsb {
                wanted: "1209:0001".into(),
                present: "no USB device at all".into(),
            },
            503,
            "no-such-usb-device",
            "There is: no USB device at all",
            "scanner.vendor_id",
        ),
        (
            ScannerError::ManyOnUsb {
                wanted: "1209:0001".into(),
                serials: "A, B".into(),
            },
            503,
            "several-usb-devices",
            "with the serial numbers A, B",
            "scanner.serial_number",
        ),
        (
            ScannerError::WrongScanner {
                place: "/dev/ttyUSB0".into(),
                found: "A".into(),
                wanted: "B".into(),
            },
            502,
            "wrong-scanner",
            "has the serial number A, and not B",
            "scanner.serial_number",
        ),
        (
            ScannerError::UsbBusy {
                device: "1209:0001".into(),
                holder: Some("the kernel's driver usbtest".into()),
            },
            503,
            "usb-device-busy",
            "in use by the kernel's driver usbtest",
            "udev rule",
        ),
        (
            ScannerError::NotAScannerOnUsb {
                device: "1209:0001".into(),
                why: "it has no interface of class ff/53/01, but 03/00/00".into(),
            },
            502,
            "wrong-device",
            "is no scanner of ours: it has no interface",
            "scanner.vendor_id",
        ),
    ] {
        rig.scanner.fail_with(Some(trouble));
        let problem = refused(&rig.client, "POST", path::SCANS, None).await;
        assert_eq!((problem.status, problem.kind.as_str()), (status, kind));
        assert!(problem.detail.contains(text), "{}", problem.detail);
        assert!(problem.hint.unwrap().contains(key));
        let status: Status = rig.client.get(path::STATUS).await;
        assert_eq!(status.scanner.link, ScannerLink::Trouble);
        assert!(status.scanner.problem.unwrap().contains(text));
    }
    rig.scanner.fail_with(None);
    let scan: Scan = rig.client.post(path::SCANS, &StartScan::default()).await;
    assert!(scan.id.ends_with("-scan"));
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_cannot_start_says_why() {
    let rig = Rig::new().await;
    let start = async |change: &dyn Fn(&mut reliefd::Config)| {
        let mut config = config(rig.folder.path());
        change(&mut config);
        let error = Daemon::start_with(config, FakeScanner::new())
            .await
            .unwrap_err();
        error.to_string()
    };
    let state = rig.folder.path().join("state");
    assert_eq!(
        start(&|_| {}).await,
        format!(
            "{} is in use by another reliefd: stop that one, or give this one another state_dir",
            state.join("reliefd.redb").display()
        )
    );
    let socket = start(&|config| config.service.state_dir = rig.folder.path().join("other")).await;
    assert!(socket.starts_with("another reliefd answers on"), "{socket}");
    let file = rig.folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    let spool = start(&|config| {
        config.service.state_dir = rig.folder.path().join("third");
        config.service.spool_dir.clone_from(&file);
    })
    .await;
    assert!(
        spool.starts_with(&format!(
            "cannot make the folder in the spool {}",
            file.display()
        )),
        "{spool}"
    );
    let state = start(&|config| config.service.state_dir.clone_from(&file)).await;
    assert!(state.contains("(service.state_dir)"), "{state}");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_socket_left_by_a_dead_service_is_taken_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("reliefd.sock");
    drop(std::os::unix::net::UnixListener::bind(&path).unwrap());
    assert!(path.exists());
    let rig = Rig::start(folder, |_| {}).await;
    let status: Status = rig.client.get(path::STATUS).await;
    assert_eq!(status.jobs_queued, 0);
    let mode =
        std::os::unix::fs::PermissionsExt::mode(&std::fs::metadata(&path).unwrap().permissions());
    assert_eq!(mode & 0o777, 0o660);
    rig.daemon.shutdown().await;
    assert!(!path.exists());
}

#[tokio::test(flavor = "multi_thread")]
async fn another_scanner_on_the_port_is_not_used() {
    let serial = |serial: &'static str| {
        move |config: &mut reliefd::Config| config.scanner.serial_number = Some(serial.into())
    };
    let rig = Rig::start(tempfile::tempdir().unwrap(), serial("F-2")).await;
    let problem = refused(&rig.client, "POST", path::SCANS, None).await;
    assert_eq!(
        (
            problem.status,
            problem.kind.as_str(),
            problem.detail.as_str()
        ),
        (
            502,
            "wrong-scanner",
            "the scanner on /dev/ttyUSB0 has the serial number F-1, and not F-2"
        )
    );
    assert!(!rig.scanner.laser_is_on());
    let status: Status = rig.client.get(path::STATUS).await;
    assert_eq!(status.scanner.problem, Some(problem.detail));
    let rig = rig.restart_with(serial("F-1")).await;
    rig.scan_to_result("a").await;
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scanner_swapped_while_nothing_is_scanned_is_told_of_at_once() {
    let rig = Rig::start(tempfile::tempdir().unwrap(), |config| {
        config.scanner.serial_number = Some("F-1".into());
    })
    .await;
    let mut events = rig.client.events().await;
    let status: Status = rig.client.get(path::STATUS).await;
    if status.scanner.link != ScannerLink::Ready {
        events.until(is_ready).await;
    }
    rig.scanner.swap("F-9");
    let trouble = |event: &Event| match event {
        Event::Scanner(scanner) => scanner.problem.clone(),
        _ => None,
    };
    let (_, problem) = events.until(trouble).await;
    assert_eq!(
        problem,
        "the scanner on /dev/ttyUSB0 has the serial number F-9, and not F-1"
    );
    let status: Status = rig.client.get(path::STATUS).await;
    assert_eq!(status.scanner.problem, Some(problem));
    assert_eq!(status.scanner.link, ScannerLink::Trouble);
    rig.scanner.swap("F-1");
    events.until(is_ready).await;
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn another_scanner_is_shown_where_any_will_do() {
    let rig = Rig::new().await;
    let mut events = rig.client.events().await;
    let shows = |serial: &'static str| {
        move |event: &Event| match event {
            Event::Scanner(scanner) => (scanner.serial.as_deref() == Some(serial)).then_some(()),
            Event::Status(status) => {
                (status.scanner.serial.as_deref() == Some(serial)).then_some(())
            }
            _ => None,
        }
    };
    events.until(shows("F-1")).await;
    rig.scanner.swap("F-9");
    events.until(shows("F-9")).await;
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_for_a_scanner_on_usb_waits_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(folder.path());
    // Numbers that no maker has.
    config.scanner.transport = reliefd::config::Transport::Usb;
    config.scanner.vendor_id = 0xffff;
    config.scanner.product_id = 0xffff;
    config.scanner.serial_number = Some("7".into());
    let daemon = Daemon::start(config).await.unwrap();
    let client = Client::new(daemon.socket());
    let problem = refused(&client, "POST", path::SCANS, None).await;
    assert_eq!(
        (problem.status, problem.kind.as_str()),
        (503, "no-such-usb-device")
    );
    assert!(
        problem
            .detail
            .contains("no scanner ffff:ffff, serial 7 on USB"),
        "{}",
        problem.detail
    );
    let status: Status = client.get(path::STATUS).await;
    assert_eq!(status.scanner.endpoint, "USB ffff:ffff, serial 7");
    daemon.shutdown().await;
}
