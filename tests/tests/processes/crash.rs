//! The service dies at once, without a chance to do anything, and is started again.

use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use relief_api::{
    Event, Job, JobState, LaserEntry, LaserLog, LaserState, Rerun, Scan, ScanState, StartScan, path,
};
use relief_tests::rig::{self, Client, GUARD, journal_columns, leisurely_house, small_house};
use reliefd::{Config, Daemon};
use scan_record::{EndCause, Ending, JournalReader};
use sim_scanner::device::Event as Happened;

use crate::role::{Role, SERVICE};
use crate::runtime;

/// One scanner at each port; of several the second has the name `b`.
fn configured(folder: &Path, ports: &[&Path]) -> Config {
    let mut config = rig::config(folder, ports.first().unwrap_or(&Path::new("none")));
    if ports.len() > 1 {
        for (name, port) in ["a", "b"].into_iter().zip(ports) {
            let mut scanner = config.scanner.clone();
            scanner.port = (*port).to_owned();
            config.scanners.insert(name.to_owned(), scanner);
        }
    }
    config
}

/// The service in its own process, until its input ends.
pub(crate) fn be_the_service(folder: &Path, ports: &[&Path]) -> Result<()> {
    runtime()?.block_on(async {
        let daemon = Daemon::start(configured(folder, ports)).await?;
        println!("ready");
        tokio::task::spawn_blocking(|| std::io::stdin().read_to_end(&mut Vec::new())).await??;
        daemon.shutdown().await;
        Ok(())
    })
}

fn start(folder: &Path, port: &Path) -> Result<(Role, Client)> {
    start_before(folder, &[port])
}

fn start_before(folder: &Path, ports: &[&Path]) -> Result<(Role, Client)> {
    let arguments: Vec<String> = std::iter::once(&folder)
        .chain(ports)
        .map(|path| path.display().to_string())
        .collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let mut service = Role::start(SERVICE, &arguments)?;
    let said = service.line()?;
    ensure!(said == "ready", "the service says {said}");
    Ok((
        service,
        Client::new(&configured(folder, ports).service.socket),
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

/// Waited for before the service is killed: what it has shown need not have reached the scanner.
fn many_are_safe(event: &Happened) -> bool {
    matches!(event, Happened::Acknowledged(below) if *below >= 32)
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
    control.wait_for(GUARD, many_are_safe)?;
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
        let mut events = client.events().await?;
        let scan: Scan = client.get(&path::scan(&id)).await?;
        let interruption = scan.interruption.clone().context("no word of the end")?;
        ensure!(
            interruption.columns >= safe && interruption.times == 1,
            "{interruption:?} of {safe} columns"
        );
        // It goes on by itself, to the same columns as if nothing had happened.
        if !scan.state.is_over() {
            events.scan_complete(&id).await?;
        }
        let scan: Scan = client.get(&path::scan(&id)).await?;
        ensure!(scan.state == ScanState::Complete, "{scan:?}");
        ensure!(scan.jobs.len() == 1, "{scan:?}");
        let kept = client.download(&path::scan_journal(&id)).await?;
        let first = folder.path().join("first.scan");
        std::fs::write(&first, kept)?;
        let mut reader = JournalReader::open(&first)?;
        while reader.next_column()?.is_some() {}
        let ending = reader.ending().context("an ending")?;
        ensure!(*ending == Ending::Closed(EndCause::Complete), "{ending}");
        let log: LaserLog = client.get(path::LASER).await?;
        use LaserState::{Off, On, Unknown};
        // As it was when the service died, found so and taken up, gone on with, complete; in
        // between the scanner may have been asked, and then it is said once more of the pause that
        // nobody knows.
        let told = log
            .entries
            .iter()
            .filter(|entry| entry.laser != Off || !entry.cause.contains("the scanner says"));
        let mut states: Vec<LaserState> = told.map(|entry| entry.laser).collect();
        states.dedup();
        ensure!(states.ends_with(&[On, Unknown, On, Off]), "{log:?}");
        for cause in ["dead-man", "taken up"] {
            let unknown =
                |entry: &LaserEntry| entry.laser == Unknown && entry.cause.contains(cause);
            ensure!(log.entries.iter().any(unknown), "{log:?}");
        }

        let next: Scan = client.post(path::SCANS, &named("next")).await?;
        let next = events.scan_complete(&next.id).await?;
        ensure!(next.interruption.is_none(), "{next:?}");
        let second = folder.path().join("second.scan");
        std::fs::write(
            &second,
            client.download(&path::scan_journal(&next.id)).await?,
        )?;
        ensure!(journal_columns(&first)? == journal_columns(&second)?);
        Ok(())
    })?;
    service.end()
}

pub(crate) fn a_part_moved_while_the_service_was_dead_waits_for_a_person() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let scanner = leisurely_house().serve_pty(None)?;
    let (service, client) = start(folder.path(), scanner.port())?;
    let runtime = runtime()?;
    let id = runtime.block_on(async {
        let mut events = client.events().await?;
        let scan: Scan = client.post(path::SCANS, &named("moved")).await?;
        // The part is in view.
        events.columns(&scan.id, 900).await?;
        Ok::<_, anyhow::Error>(scan.id)
    })?;
    service.kill()?;
    let moved = sim_scanner::Vec3::new(0.0, 0.0, 1.5);
    scanner.control().move_part(moved);

    let (service, client) = start(folder.path(), scanner.port())?;
    let reason = runtime.block_on(waits_for_a_person(&client, &id))?;
    ensure!(reason.contains("has moved"), "{reason}");
    // Whoever had to be asked has to be asked by the next as well.
    service.kill()?;
    let (service, client) = start(folder.path(), scanner.port())?;
    scanner.control().move_part(-moved);
    runtime.block_on(async {
        let mut events = client.events().await?;
        let reason = waits_for_a_person(&client, &id).await?;
        ensure!(
            reason.contains("service ended") && reason.contains("has moved"),
            "{reason}"
        );
        let told: Scan = client.ask(&path::scan_resume(&id)).await?;
        ensure!(told.id == id);
        events.scan_complete(&id).await?;
        Ok(())
    })?;
    service.end()
}

/// Waits until it is kept that the scan waits for a person; why.
async fn waits_for_a_person(client: &Client, id: &str) -> Result<String> {
    let mut events = client.events().await?;
    let waits = |scan: &Scan| scan.state == ScanState::Paused && scan.needs_person;
    let told = |event: &Event| match event {
        // Told once it is kept; what a status shows need not be yet.
        Event::Scan(scan) if scan.id == id && waits(scan) => Some(scan.clone()),
        _ => None,
    };
    let scan: Scan = client.get(&path::scan(id)).await?;
    let scan = match waits(&scan) {
        true => scan,
        false => events.until(told).await?.1,
    };
    Ok(scan.reason.unwrap_or_default())
}

pub(crate) fn two_scans_survive_the_death_of_the_service() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let scanners = [
        leisurely_house().serve_pty(None)?,
        leisurely_house().serve_pty(None)?,
    ];
    let ports = scanners.each_ref().map(|scanner| scanner.port());
    let (service, client) = start_before(folder.path(), &ports)?;
    let runtime = runtime()?;
    let ids = runtime.block_on(async {
        let mut events = client.events().await?;
        let mut ids = Vec::new();
        for name in ["a", "b"] {
            let mut request = named("cut short");
            request.scanner = name.into();
            let scan: Scan = client.post(path::SCANS, &request).await?;
            ids.push(scan.id);
        }
        for id in &ids {
            events.columns(id, 40).await?;
        }
        Ok::<_, anyhow::Error>(ids)
    })?;
    let mut controls = scanners.each_ref().map(|scanner| scanner.control());
    for control in &mut controls {
        control.wait_for(GUARD, many_are_safe)?;
    }
    service.kill()?;
    let mut safe = Vec::new();
    for control in &mut controls {
        control.wait_for(GUARD, |event| *event == Happened::DeadMan)?;
        ensure!(!control.snapshot().laser_on, "a laser is on");
        safe.push(acknowledged(&control.events()));
    }
    let (service, client) = start_before(folder.path(), &ports)?;
    runtime.block_on(async {
        for ((id, name), safe) in ids.iter().zip(["a", "b"]).zip(safe) {
            let mut events = client.events().await?;
            let mut scan: Scan = client.get(&path::scan(id)).await?;
            let kept = scan.interruption.as_ref().map_or(0, |cut| cut.columns);
            ensure!(
                safe >= 32 && kept >= safe,
                "{kept} of {safe} columns are kept"
            );
            if !scan.state.is_over() {
                scan = events.scan_complete(id).await?;
            }
            ensure!(
                (scan.state, scan.scanner.as_str()) == (ScanState::Complete, name),
                "{scan:?}"
            );
            let log: LaserLog = client.get(&path::scanner_laser(name)).await?;
            let told = |entry: &LaserEntry| {
                entry.laser == LaserState::Unknown && entry.cause.contains("dead-man")
            };
            ensure!(log.entries.iter().any(told), "{log:?}");
        }
        Ok(())
    })?;
    service.end()
}

/// A job slow enough to be found at work.
fn slow(draws: u32) -> Rerun {
    let mut rerun = Rerun::default();
    rerun.settings.insert("regrid.draws".into(), draws.into());
    rerun.settings.insert("regrid.neighbours".into(), 64.into());
    rerun
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
        let job: Job = client
            .post(&path::scan_rerun(&scan.id), &slow(4_000))
            .await?;
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

pub(crate) fn a_job_that_always_ends_the_service_is_given_up() -> Result<()> {
    let runtime = runtime()?;
    let folder = tempfile::tempdir()?;
    let scanner = small_house().serve_pty(None)?;
    let (mut service, mut client) = start(folder.path(), scanner.port())?;
    let (scan, job) = runtime.block_on(async {
        let mut events = client.events().await?;
        let scan: Scan = client.post(path::SCANS, &named("house")).await?;
        let scan = events.scan_complete(&scan.id).await?;
        let first = scan.jobs.first().copied().context("no job")?;
        events
            .until(|event| match event {
                Event::Published { job, .. } if *job == first => Some(()),
                _ => None,
            })
            .await?;
        // Far longer than the rest of the test.
        let mut endless = slow(100_000);
        endless
            .settings
            .insert("regrid.pitch_mm".into(), 0.2.into());
        let job: Job = client.post(&path::scan_rerun(&scan.id), &endless).await?;
        Ok::<_, anyhow::Error>((scan, job))
    })?;
    let at_work = |client: &Client| {
        runtime.block_on(async {
            loop {
                let job: Job = client.get(&path::job(job.id)).await?;
                ensure!(!job.state.is_over(), "{job:?}");
                if job.state == JobState::Running {
                    return Ok(job);
                }
                tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            }
        })
    };
    for start_number in 1..=3 {
        let running = at_work(&client)?;
        ensure!(
            (running.attempts, running.cut_short) == (start_number, start_number),
            "{running:?}"
        );
        service.kill()?;
        (service, client) = start(folder.path(), scanner.port())?;
    }
    runtime.block_on(async {
        let given_up: Job = client.get(&path::job(job.id)).await?;
        ensure!(
            (given_up.state, given_up.attempts, given_up.cut_short) == (JobState::Failed, 3, 3),
            "{given_up:?}"
        );
        let error = given_up.error.unwrap_or_default();
        ensure!(error.contains("ended 3 times in a row"), "{error}");
        let hint = given_up.hint.unwrap_or_default();
        ensure!(hint.contains(&format!("relief retry {}", job.id)), "{hint}");
        let incoming = format!("spool/.incoming-{}", job.result);
        ensure!(!folder.path().join(incoming).exists());

        // Whatever else there is to do is done.
        let mut events = client.events().await?;
        let other: Job = client
            .post(&path::scan_rerun(&scan.id), &Rerun::default())
            .await?;
        let done = events
            .job_becomes(other.id, |state| state == JobState::Done)
            .await?;
        ensure!(done.cut_short == 0, "{done:?}");
        let again: Job = client.ask(&path::job_retry(job.id)).await?;
        ensure!(
            (again.state, again.cut_short) == (JobState::Queued, 0),
            "{again:?}"
        );
        Ok(())
    })?;
    // An orderly end in the midst of it is none that counts.
    let running = at_work(&client)?;
    ensure!(
        (running.attempts, running.cut_short) == (4, 1),
        "{running:?}"
    );
    service.end()?;
    let (service, client) = start(folder.path(), scanner.port())?;
    let running = at_work(&client)?;
    ensure!(
        (running.attempts, running.cut_short) == (5, 1),
        "{running:?}"
    );
    service.end()
}
