//! The service dies at once, without a chance to do anything, and is started again.

use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use relief_api::{Event, Job, JobState, Rerun, Scan, ScanState, StartScan, path};
use relief_tests::rig::{self, Client, GUARD, journal_columns, leisurely_house, small_house};
use reliefd::Daemon;
use scan_record::{Ending, JournalReader};
use sim_scanner::device::Event as Happened;

use crate::role::{Role, SERVICE};
use crate::runtime;

/// The service in its own process, until its input ends.
pub(crate) fn be_the_service(folder: &Path, port: &Path) -> Result<()> {
    runtime()?.block_on(async {
        let daemon = Daemon::start(rig::config(folder, port)).await?;
        println!("ready");
        tokio::task::spawn_blocking(|| std::io::stdin().read_to_end(&mut Vec::new())).await??;
        daemon.shutdown().await;
        Ok(())
    })
}

fn start(folder: &Path, port: &Path) -> Result<(Role, Client)> {
    let arguments = [folder.to_string_lossy(), port.to_string_lossy()];
    let mut service = Role::start(SERVICE, &[&arguments[0], &arguments[1]])?;
    let said = service.line()?;
    ensure!(said == "ready", "the service says {said}");
    Ok((
        service,
        Client::new(&rig::config(folder, port).service.socket),
    ))
}

fn named(name: &str) -> StartScan {
    StartScan {
        name: name.into(),
        ..StartScan::default()
    }
}

/// Columns that the scanner knows to be safe.
fn acknowledged(events: &[Happened]) -> u32 {
    let below = events.iter().filter_map(|event| match event {
        Happened::Acknowledged(below) => Some(*below),
        _ => None,
    });
    below.max().unwrap_or_default()
}

pub(crate) fn what_was_acknowledged_survives_the_death_of_the_service() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let scanner = leisurely_house().serve_pty(None)?;
    let mut control = scanner.control();
    let (service, client) = start(folder.path(), scanner.port())?;
    let runtime = runtime()?;
    let id = runtime.block_on(async {
        let mut events = client.events().await?;
        let scan: Scan = client.post(path::SCANS, &named("cut short")).await?;
        events.columns(&scan.id, 40).await?;
        Ok::<_, anyhow::Error>(scan.id)
    })?;
    control.wait_until(GUARD, |device| device.laser_on)?;
    // A busy machine may have let the dead-man time pass before.
    control.skip_events();
    service.kill()?;

    // Nobody tells the scanner; it finds out by itself.
    control.wait_for(GUARD, |event| *event == Happened::DeadMan)?;
    let device = control.snapshot();
    ensure!(!device.laser_on, "the laser is on, and nobody is there");
    let safe = acknowledged(&control.events());
    ensure!(safe >= 32, "{safe} columns were acknowledged");

    let (service, client) = start(folder.path(), scanner.port())?;
    runtime.block_on(async {
        let scan: Scan = client.get(&path::scan(&id)).await?;
        ensure!(scan.state == ScanState::Interrupted, "{scan:?}");
        let reason = scan.reason.unwrap_or_default();
        ensure!(
            reason.contains("the service ended during the scan"),
            "{reason}"
        );
        ensure!(
            scan.columns >= safe,
            "{} of {safe} columns are kept",
            scan.columns
        );
        let journal = folder.path().join("downloaded.scan");
        std::fs::write(&journal, client.download(&path::scan_journal(&id)).await?)?;
        ensure!(journal_columns(&journal)?.len() == scan.columns as usize);
        let mut reader = JournalReader::open(&journal)?;
        while reader.next_column()?.is_some() {}
        let ending = reader.ending().context("an ending")?;
        ensure!(matches!(ending, Ending::Damaged { .. }), "{ending}");

        // And the scanner can be used again.
        let mut events = client.events().await?;
        let mut next = named("next");
        next.plan.columns = Some(60);
        let next: Scan = client.post(path::SCANS, &next).await?;
        let next = events.scan_complete(&next.id).await?;
        ensure!(next.columns == 60, "{next:?}");
        Ok(())
    })?;
    service.end()
}

pub(crate) fn a_job_survives_the_death_of_the_service() -> Result<()> {
    let runtime = runtime()?;
    let folder = tempfile::tempdir()?;
    let scanner = small_house().serve_pty(None)?;
    let (service, client) = start(folder.path(), scanner.port())?;
    let (scan, job) = runtime.block_on(async {
        let mut events = client.events().await?;
        let scan: Scan = client.post(path::SCANS, &named("house")).await?;
        let scan = events.scan_complete(&scan.id).await?;
        // The second of these is slow enough to be found at work.
        let mut rerun = Rerun::default();
        rerun.settings.insert("regrid.draws".into(), 4_000.into());
        rerun.settings.insert("regrid.neighbours".into(), 64.into());
        let job: Job = client.post(&path::scan_rerun(&scan.id), &rerun).await?;
        events.stage(job.id, "regrid").await?;
        Ok::<_, anyhow::Error>((scan, job))
    })?;
    service.kill()?;
    let spool = folder.path().join("spool");
    ensure!(
        !spool.join(&job.result).exists(),
        "half a result in the spool"
    );
    ensure!(spool.join(format!(".incoming-{}", job.result)).exists());

    let (service, client) = start(folder.path(), scanner.port())?;
    runtime.block_on(async {
        let mut events = client.events().await?;
        let mut published = 0;
        let mut done: Job = client.get(&path::job(job.id)).await?;
        ensure!(!done.state.is_over(), "{done:?}");
        events
            .until(|event| match event {
                Event::Job(told) if told.id == job.id && told.state.is_over() => {
                    done = told.clone();
                    None
                }
                Event::Published { job: of, .. } if *of == job.id => {
                    published += 1;
                    Some(())
                }
                _ => None,
            })
            .await?;
        ensure!(
            (done.state, done.attempts, published) == (JobState::Done, 2, 1),
            "{done:?}"
        );
        let mut names = Vec::new();
        for entry in std::fs::read_dir(&spool)? {
            names.push(entry?.file_name().to_string_lossy().into_owned());
        }
        names.sort();
        let mut expected = vec![scan.id, job.result];
        expected.sort();
        ensure!(names == expected, "{names:?} instead of {expected:?}");
        Ok(())
    })?;
    service.end()
}
