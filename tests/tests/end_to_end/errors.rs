//! What goes wrong before and around a scan: each says what, where, and what to do.

use std::path::Path;

use anyhow::Result;
use relief_api::{Event, JobState, Problem, Scan, ScannerLink, path};
use relief_tests::rig::{self, Foreign, Refused, Rig, small_house};
use reliefd::{Config, Daemon};
use scanner_protocol::Faults;

/// What the service says to a scan that cannot be.
async fn refused(rig: &Rig) -> Result<Problem> {
    let reply = rig.scan(&super::named("house")).await;
    Ok(reply
        .expect_err("no scan is possible")
        .downcast::<Refused>()?
        .0)
}

fn hint_tells(problem: &Problem, words: &str) -> bool {
    let hint = problem.hint.as_ref();
    hint.is_some_and(|hint| hint.contains(words))
}

#[tokio::test(flavor = "multi_thread")]
async fn no_such_port() -> Result<()> {
    let port = Path::new("/dev/relief-tests-no-such-port");
    let rig = Rig::at_port(port).await?;
    let problem = refused(&rig).await?;
    assert_eq!(
        (problem.status, problem.kind.as_str()),
        (503, "no-such-port")
    );
    assert_eq!(
        problem.detail,
        "there is no port /dev/relief-tests-no-such-port: is the scanner plugged in and \
         switched on? `relief doctor` lists the ports there are"
    );
    assert!(hint_tells(&problem, "scanner.port"));
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn port_busy() -> Result<()> {
    let owner = Rig::start(&small_house()).await?;
    owner.scan_to_result(&super::named("house")).await?;
    let second = Rig::at_port(owner.port()).await?;
    let problem = refused(&second).await?;
    assert_eq!((problem.status, problem.kind.as_str()), (503, "port-busy"));
    let start = format!("the port {} is in use by ", owner.port().display());
    let holder = problem.detail.strip_prefix(&start);
    let process = format!("(process {})", std::process::id());
    assert!(
        holder.is_some_and(|name| name.ends_with(&process)),
        "{problem}"
    );
    assert!(hint_tells(&problem, "end the other program"));
    // The owner never noticed.
    owner.scan_to_result(&super::named("again")).await?;
    second.end().await?;
    owner.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn wrong_device_on_the_port() -> Result<()> {
    let receiver =
        Foreign::saying("$GPGGA,120000.00,4807.038,N,01131.000,E,1,08,0.9,545.4,M*47\r\n")?;
    let rig = Rig::at_port(receiver.port()).await?;
    let problem = refused(&rig).await?;
    assert_eq!(
        (problem.status, problem.kind.as_str()),
        (502, "wrong-device")
    );
    let start = format!(
        "{} answers, but not as a scanner: it says \"$GPGGA",
        receiver.port().display()
    );
    assert!(problem.detail.starts_with(&start), "{problem}");
    assert!(hint_tells(&problem, "scanner.port"));
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_silent_port() -> Result<()> {
    let rig = Rig::start_with(&small_house(), |config| {
        // The whole scan at the end goes by this, too.
        config.scanner.request_timeout_ms = Some(200);
        config.scanner.request_attempts = Some(3);
    })
    .await?;
    let mut events = rig.client().events().await?;
    let ready = |event: &Event| match event {
        Event::Status(status) if status.scanner.link == ScannerLink::Ready => Some(()),
        Event::Scanner(scanner) if scanner.link == ScannerLink::Ready => Some(()),
        _ => None,
    };
    events.until(ready).await?;
    let control = rig.control()?;
    control.stall();
    // The service knows who was there; it finds out when it wants something.
    let trouble = |event: &Event| match event {
        Event::Scanner(scanner) if scanner.link == ScannerLink::Trouble => scanner.problem.clone(),
        _ => None,
    };
    let (_, problem) = events.until(trouble).await?;
    let port = rig.port().display().to_string();
    assert!(problem.contains(&port), "{problem}");
    assert!(
        problem.contains("lost the connection") || problem.contains("from the scanner within"),
        "{problem}"
    );
    control.resume();
    events.until(ready).await?;
    let ended = rig.scan_to_result(&super::named("house")).await?;
    assert_eq!(ended.scan.columns, 60);
    rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fault_of_the_device_ends_the_scan_and_is_named() -> Result<()> {
    let rig = Rig::start_with(&small_house(), |config| config.scanner.resume = false).await?;
    let control = rig.control()?;
    control.step_columns(Some(12));
    let mut events = rig.client().events().await?;
    let scan = rig.scan(&super::named("house")).await?;
    events.columns(&scan.id, 12).await?;
    control.raise_faults(Faults::TABLE_STALL);
    let over = events.scan_over(&scan.id).await?;
    assert_eq!(over.state, relief_api::ScanState::Failed);
    let reason = over.reason.unwrap_or_default();
    let named = format!("the scanner reports: {}", Faults::TABLE_STALL);
    assert!(reason.starts_with(&named), "{reason}");
    assert!(!control.snapshot().laser_on);
    assert_eq!(over.columns, 12, "what was measured is kept");
    rig.end().await
}

#[test]
fn a_wrong_configuration_is_refused_with_its_line_and_the_nearest_name() {
    let check = |text: &str, expected: &str| {
        let error = Config::parse(text, Path::new("reliefd.toml")).expect_err(text);
        assert_eq!(error.to_string(), expected);
    };
    check(
        "[service]\nspool_dir = \"/srv/spool\"\n\n[scanner]\nprot = \"/dev/ttyUSB0\"\n",
        "reliefd.toml, line 5, column 1: in [scanner] unknown key `prot`; did you mean `port`?",
    );
    check(
        "[regrid]\nestimator = \"least-medain\"\n",
        "reliefd.toml, line 2, column 13: unknown value `least-medain`; did you mean \
         `least-median`?",
    );
    check(
        "# comment\n[scaner]\n",
        "reliefd.toml, line 2, column 2: unknown key `scaner`; did you mean `scanner`?",
    );
    check(
        "[scanner]\nbaud = 300\n",
        "reliefd.toml, line 2, column 8: 300 is out of range: 1200 to 12000000 bits per second \
         are possible",
    );
    let missing = Config::load(Path::new("/no/such/reliefd.toml")).expect_err("not there");
    let text = missing.to_string();
    assert!(
        text.starts_with("cannot read the configuration /no/such/reliefd.toml: No such file"),
        "{text}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn a_spool_that_is_none_keeps_the_service_from_starting() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let port = Path::new("/dev/relief-tests-no-such-port");
    let config = rig::config(folder.path(), port);
    std::fs::write(&config.service.spool_dir, "a file")?;
    let spool = config.service.spool_dir.display().to_string();
    let error = Daemon::start(config).await.expect_err("a file is no spool");
    assert_eq!(
        error.to_string(),
        format!(
            "cannot make the folder in the spool {spool}: File exists (os error 17); {spool} is \
             no folder: move away what is there, or set service.spool_dir to another folder"
        )
    );
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_spool_that_goes_away_fails_the_job_and_a_retry_mends_it() -> Result<()> {
    let rig = Rig::start(&small_house()).await?;
    let spool = rig.spool().to_owned();
    std::fs::remove_dir(&spool)?;
    std::fs::write(&spool, "a file in the spool's place")?;
    let mut events = rig.client().events().await?;
    let scan = rig.scan(&super::named("house")).await?;
    let scan: Scan = events.scan_complete(&scan.id).await?;
    // It may have failed before the scan's end is told.
    let job = rig.job_over(&mut events, scan.jobs[0]).await?;
    assert_eq!(job.state, JobState::Failed);
    let error = job.error.unwrap_or_default();
    let start = format!("in the spool {}: Not a directory", spool.display());
    assert!(error.contains(&start), "{error}");
    assert!(job.hint.is_some_and(|hint| hint.contains("is no folder")));

    std::fs::remove_file(&spool)?;
    std::fs::create_dir(&spool)?;
    let _: relief_api::Job = rig.client().ask(&path::job_retry(job.id)).await?;
    let done = rig.job_done(&mut events, job.id).await?;
    assert_eq!(done.attempts, 2);
    assert_eq!(rig.spooled()?, [scan.id.as_str()]);
    rig.end().await
}
