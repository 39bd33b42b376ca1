use std::io::Write as _;
use std::task::Poll;

use relief_api::{Event, Job, JobState, Rerun, Scan, ScanList, ScanState, StartScan, Status, path};
use rustix::fs::FileType;
use serde_json::json;

use crate::client::Events;
use crate::rig::{Rig, ended, job_over, json as read_json};

/// Settings with which regridding takes a hundred times longer than a scan.
fn endless() -> Rerun {
    Rerun {
        settings: [("regrid.draws".to_owned(), json!(100_000))].into(),
        ..Rerun::default()
    }
}

/// A rerun that is being regridded.
async fn running(rig: &Rig, events: &mut Events, scan: &str, rerun: &Rerun) -> Job {
    let job: Job = rig.client.post(&path::scan_rerun(scan), rerun).await;
    let regridding = |event: &Event| match event {
        Event::Progress { job: id, stage, .. } if *id == job.id && stage == "regrid" => Some(()),
        _ => None,
    };
    events.until(regridding).await;
    job
}

/// A scan with its result, and a job that keeps the service from any other.
async fn busy() -> (Rig, Scan, Events, Job) {
    let rig = Rig::new().await;
    let (scan, _) = rig.scan_to_result("a").await;
    let mut events = rig.client.events().await;
    let job = running(&rig, &mut events, &scan.id, &endless()).await;
    (rig, scan, events, job)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_scan_is_taken_while_the_first_is_processed() {
    let (rig, _, mut events, busy) = busy().await;

    let second = rig.start_scan("second").await;
    let second = ended(&mut events, &second.id).await;
    assert_eq!(second.state, ScanState::Complete);
    let status: Status = rig.client.get(path::STATUS).await;
    assert_eq!((status.jobs_running, status.jobs_queued), (1, 1));

    let _: Job = rig.client.ask(&path::job_cancel(busy.id)).await;
    let busy = job_over(&mut events, &rig, busy.id).await;
    assert_eq!(busy.state, JobState::Cancelled);
    let job = job_over(&mut events, &rig, second.jobs[0]).await;
    assert_eq!(job.state, JobState::Done, "{:?}", job.error);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_are_cancelled_while_they_wait_and_while_they_run() {
    let (rig, scan, mut events, busy) = busy().await;
    let waiting: Job = rig
        .client
        .post(&path::scan_rerun(&scan.id), &Rerun::default())
        .await;
    let waiting: Job = rig.client.ask(&path::job_cancel(waiting.id)).await;
    assert_eq!(waiting.state, JobState::Cancelled);
    let _: Job = rig.client.ask(&path::job_cancel(busy.id)).await;
    let busy = job_over(&mut events, &rig, busy.id).await;
    assert_eq!(busy.state, JobState::Cancelled);
    assert!(!rig.daemon.spool_dir().join(&busy.result).exists());

    let again = rig
        .client
        .request("POST", &path::job_cancel(busy.id), None)
        .await;
    assert_eq!(
        (again.status, again.problem().kind.as_str()),
        (409, "wrong-job-state")
    );
    let retried: Job = rig.client.ask(&path::job_retry(waiting.id)).await;
    assert_eq!(retried.state, JobState::Queued);
    let done = job_over(&mut events, &rig, waiting.id).await;
    assert_eq!(done.state, JobState::Done, "{:?}", done.error);
    // Nothing unfinished is left lying about.
    let left: Vec<_> = std::fs::read_dir(rig.daemon.spool_dir())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.starts_with('.'))
        .collect();
    assert!(left.is_empty(), "{left:?}");
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rerun_has_other_settings_and_a_folder_of_its_own() {
    let rig = Rig::new().await;
    let (scan, first) = rig.scan_to_result("roof").await;
    let before = std::fs::read(rig.daemon.spool_dir().join(&first.result).join("roof.igs"));
    let mut events = rig.client.events().await;
    let rerun = Rerun {
        name: "roof coarse".into(),
        settings: [
            ("regrid.pitch_mm".to_owned(), json!(0.8)),
            ("deliverables.entities".to_owned(), json!(128)),
            ("deliverables.step".to_owned(), json!("ap214")),
            ("deliverables.step_units".to_owned(), json!("inch")),
        ]
        .into(),
        ..Rerun::default()
    };
    let job: Job = rig.client.post(&path::scan_rerun(&scan.id), &rerun).await;
    assert_ne!(job.result, scan.id);
    assert_eq!(job.scan, scan.id);
    let job = job_over(&mut events, &rig, job.id).await;
    assert_eq!(job.state, JobState::Done, "{:?}", job.error);
    let folder = rig.daemon.spool_dir().join(&job.result);
    let report = read_json(&folder.join("report.json"));
    assert_eq!(report["range_image"]["pitch_mm"], 0.8);
    assert_eq!(report["settings"]["iges_entities"], 128);
    assert_eq!(report["settings"]["step"], "ap214");
    assert_eq!(report["settings"]["step_units"], "inch");
    let step = std::fs::read_to_string(folder.join("roof coarse.step")).unwrap();
    assert!(step.contains("AUTOMOTIVE_DESIGN") && step.contains("'INCH'"));
    assert_eq!(report["scan"]["id"], scan.id.as_str());
    assert!(folder.join("roof coarse.igs").is_file());
    let after = std::fs::read(rig.daemon.spool_dir().join(&first.result).join("roof.igs"));
    assert_eq!(before.unwrap(), after.unwrap());
    let without = Rerun {
        name: String::new(),
        settings: [
            ("deliverables.step".to_owned(), json!("off")),
            ("deliverables.page".to_owned(), json!(["pdf"])),
        ]
        .into(),
        ..Rerun::default()
    };
    let last: Job = rig.client.post(&path::scan_rerun(&scan.id), &without).await;
    let last = job_over(&mut events, &rig, last.id).await;
    let folder = rig.daemon.spool_dir().join(&last.result);
    assert!(folder.join("roof.igs").is_file() && !folder.join("roof.step").exists());
    let report = read_json(&folder.join("report.json"));
    assert_eq!(report["settings"]["step"], "off");
    assert!(folder.join("report.pdf").is_file() && !folder.join("report.html").exists());
    assert!(!report["warnings"].to_string().contains("STEP"));
    let scan: Scan = rig.client.get(&path::scan(&scan.id)).await;
    assert_eq!(scan.jobs, [first.id, job.id, last.id]);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_cut_short_by_a_stop_is_finished_after_the_restart() {
    let (rig, scan, mut events, busy) = busy().await;
    let job: Job = rig
        .client
        .post(&path::scan_rerun(&scan.id), &Rerun::default())
        .await;
    // The job gets its columns through a pipe, so that it stands still in their midst for
    // as long as the test likes.
    let journal = rig.journal(&scan.id);
    let kept = std::fs::read(&journal).unwrap();
    std::fs::remove_file(&journal).unwrap();
    let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
    rustix::fs::mknodat(rustix::fs::CWD, &journal, FileType::Fifo, mode, 0).unwrap();
    let _: Job = rig.client.ask(&path::job_cancel(busy.id)).await;
    let (pipe, half) = (journal.clone(), kept[..kept.len() / 2].to_vec());
    let feed = move || {
        let mut pipe = std::fs::File::create(pipe).unwrap();
        pipe.write_all(&half).unwrap();
        pipe
    };
    let pipe = tokio::task::spawn_blocking(feed).await.unwrap();
    let reading = |event: &Event| match event {
        Event::Progress { job: id, stage, .. } if *id == job.id && stage == "regrid" => Some(()),
        _ => None,
    };
    events.until(reading).await;
    let Rig { daemon, folder, .. } = rig;
    let mut end = Box::pin(daemon.shutdown());
    let begun = std::future::poll_fn(|cx| Poll::Ready(end.as_mut().poll(cx))).await;
    assert!(begun.is_pending());
    // Only now, when the job has been asked to stop, does it learn that nothing more comes.
    drop(pipe);
    end.await;
    std::fs::remove_file(&journal).unwrap();
    std::fs::write(&journal, kept).unwrap();
    let rig = Rig::start(folder, |_| {}).await;
    let mut events = rig.client.events().await;
    let job = job_over(&mut events, &rig, job.id).await;
    assert_eq!(
        (job.state, job.attempts),
        (JobState::Done, 2),
        "{:?}",
        job.error
    );
    assert!(
        rig.daemon
            .spool_dir()
            .join(&job.result)
            .join("a.igs")
            .is_file()
    );
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_unwritable_spool_fails_the_job_and_a_retry_mends_it() {
    let rig = Rig::new().await;
    let spool = rig.daemon.spool_dir().to_owned();
    // A file in the folder's place refuses even root.
    std::fs::remove_dir(&spool).unwrap();
    std::fs::write(&spool, "").unwrap();
    let mut events = rig.client.events().await;
    let scan = rig.start_scan("a").await;
    let scan = ended(&mut events, &scan.id).await;
    assert_eq!(scan.state, ScanState::Complete);
    let job = job_over(&mut events, &rig, scan.jobs[0]).await;
    assert_eq!(job.state, JobState::Failed);
    let error = job.error.unwrap();
    assert!(
        error.starts_with(&format!(
            "cannot make a folder in the spool {}",
            spool.display()
        )) || error.contains("Not a directory"),
        "{error}"
    );
    let hint = format!(
        "{} is no folder: move away what is there, or set service.spool_dir to another folder",
        spool.display()
    );
    assert_eq!(job.hint, Some(hint));

    std::fs::remove_file(&spool).unwrap();
    std::fs::create_dir(&spool).unwrap();
    let _: Job = rig.client.ask(&path::job_retry(job.id)).await;
    let job = job_over(&mut events, &rig, job.id).await;
    assert_eq!(
        (job.state, job.attempts),
        (JobState::Done, 2),
        "{:?}",
        job.error
    );
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_grid_that_is_absurdly_fine_is_refused_before_the_work() {
    let rig = Rig::new().await;
    let (scan, _) = rig.scan_to_result("a").await;
    let mut events = rig.client.events().await;
    let rerun = Rerun {
        settings: [("regrid.pitch_mm".to_owned(), json!(0.002))].into(),
        ..Rerun::default()
    };
    let job: Job = rig.client.post(&path::scan_rerun(&scan.id), &rerun).await;
    let job = job_over(&mut events, &rig, job.id).await;
    assert_eq!(job.state, JobState::Failed);
    assert_eq!(
        job.error.unwrap(),
        format!(
            "scan {}: a grid of 0.002 mm is too fine for its 3600 samples, which spread over \
             29.5 x 29.5 mm",
            scan.id
        )
    );
    let hint = job.hint.unwrap();
    let least = hint.split("regrid.pitch_mm=").nth(1).unwrap();
    let least: f64 = least.split(' ').next().unwrap().parse().unwrap();
    // 2^24 nodes on 29.5 x 29.5 mm.
    assert!((least - 29.5 / 4096.0).abs() < 1e-4, "{hint}");
    rig.daemon.shutdown().await;
}

fn with_pitch(pitch_mm: f64) -> StartScan {
    StartScan {
        settings: [("regrid.pitch_mm".to_owned(), json!(pitch_mm))].into(),
        ..StartScan::default()
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_with_an_absurdly_fine_grid_is_refused_before_anything_moves() {
    let rig = Rig::new().await;
    rig.scanner.on_start(|| panic!("the scan starts"));
    let mut request = with_pitch(0.001);
    request.plan.x_last_mm = Some(90.0);
    let request = serde_json::to_string(&request).unwrap();
    let reply = rig
        .client
        .request("POST", path::SCANS, Some(&request))
        .await;
    let problem = reply.problem();
    assert_eq!(
        (problem.status, problem.kind.as_str()),
        (400, "impossible-scan")
    );
    assert_eq!(
        problem.detail,
        "a grid of 0.001 mm (regrid.pitch_mm) is too fine for 181 columns of 60 samples over \
         90.0 x 29.5 mm: even a part of 9.0 x 3.0 mm would have 27 million nodes; for one that \
         fills the view set regrid.pitch_mm to 0.013 or more, or leave it out"
    );
    assert_eq!(rig.client.get::<ScanList>(path::SCANS).await.scans, []);
    rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_grid_too_fine_for_the_part_ends_the_live_picture_and_costs_no_column() {
    let rig = Rig::new().await;
    let mut events = rig.client.events().await;
    let scan: Scan = rig.client.post(path::SCANS, &with_pitch(0.001)).await;
    let over = |event: &Event| match event {
        Event::Scan(over) if over.id == scan.id && over.state.is_over() => Some(over.clone()),
        _ => None,
    };
    let (seen, scan) = events.until(over).await;
    assert_eq!(scan.state, ScanState::Complete, "{:?}", scan.reason);
    assert_eq!(rig.scanner.acknowledged().len(), 60);
    let live = |event: &Event| match event {
        Event::Column { live, .. } => Some(live.len()),
        _ => None,
    };
    let live: Vec<usize> = seen.iter().filter_map(live).collect();
    assert_eq!(live, [0; 60]);
    let grid = rig.journal(&scan.id).with_extension("grid");
    assert!(!grid.exists());
    let job = job_over(&mut events, &rig, scan.jobs[0]).await;
    assert_eq!(job.state, JobState::Failed);
    let error = job.error.unwrap();
    assert!(error.contains("a grid of 0.001 mm is too fine"), "{error}");
    // With a sensible grid it is as good as any.
    let rerun = Rerun {
        settings: [("regrid.pitch_mm".to_owned(), json!(0.5))].into(),
        ..Rerun::default()
    };
    let job: Job = rig.client.post(&path::scan_rerun(&scan.id), &rerun).await;
    let job = job_over(&mut events, &rig, job.id).await;
    assert_eq!(job.state, JobState::Done, "{:?}", job.error);
    rig.daemon.shutdown().await;
}
