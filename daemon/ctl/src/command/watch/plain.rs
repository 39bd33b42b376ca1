//! Events as lines of text, or as elements of a JSON array.

use std::io::Write;

use relief_api::{Event, ScannerStatus};

use crate::failure::Failure;
use crate::output;
use crate::service::Client;

/// Tells the events of the service until it ends, or so many of them.
pub(super) async fn run(client: &Client, count: Option<u64>, json: bool) -> Result<(), Failure> {
    let mut events = client.events().await?;
    let mut told = 0;
    let ended = loop {
        if count.is_some_and(|count| told >= count) {
            break Ok(());
        }
        let event = tokio::select! {
            event = events.next() => event?,
            _ = tokio::signal::ctrl_c() => break Ok(()),
        };
        match event {
            Some(event) if json => element(&event, told == 0)?,
            Some(event) => output::text(&line(&event))?,
            None => break Err(Failure::Failed("the service has ended".into())),
        }
        told += 1;
    };
    if json {
        output::text(if told == 0 { "[]" } else { "\n]" })?;
    }
    ended
}

/// One element of the array that the whole watch prints, on a line of its own.
fn element(event: &Event, first: bool) -> Result<(), Failure> {
    let rendered = serde_json::to_string(event).map_err(std::io::Error::other);
    let mut out = std::io::stdout().lock();
    rendered
        .and_then(|text| write!(out, "{}{text}", if first { "[\n" } else { ",\n" }))
        .and_then(|()| out.flush())
        .map_err(Failure::Output)
}

/// An event in a line.
pub(super) fn line(event: &Event) -> String {
    match event {
        Event::Status(status) => {
            let several = status.scanners.iter().map(|one| &one.status);
            let scanners: Vec<String> = if status.scanners.is_empty() {
                vec![at(&status.scanner)]
            } else {
                several.map(at).collect()
            };
            format!(
                "reliefd {}, {}, {} running and {} waiting jobs",
                status.version,
                scanners.join(", "),
                status.jobs_running,
                status.jobs_queued
            )
        }
        Event::Scan(scan) => {
            let reason = scan
                .reason
                .as_ref()
                .map_or(String::new(), |reason| format!(": {reason}"));
            format!(
                "scan {} ({}){}: {}{reason}",
                scan.id,
                scan.name,
                output::on_scanner(&scan.scanner),
                scan.state.as_str()
            )
        }
        Event::Column {
            scan,
            scanner,
            columns,
            columns_planned,
            samples,
            x_mm,
            ..
        } => {
            let on = output::on_scanner(scanner);
            format!(
                "scan {scan}{on}: column {columns}/{columns_planned} at x {x_mm:.3} mm, \
                 {samples} samples"
            )
        }
        Event::Job(job) => {
            let error = job
                .error
                .as_ref()
                .map_or(String::new(), |error| format!(": {error}"));
            format!(
                "job {} of scan {}{}: {}{error}",
                job.id,
                job.scan,
                output::on_scanner(&job.scanner),
                job.state.as_str()
            )
        }
        Event::Progress {
            job,
            scanner,
            stage,
            fraction,
            seconds,
            ..
        } => {
            let on = output::on_scanner(scanner);
            match seconds {
                Some(seconds) => format!("job {job}{on}: {stage} done in {seconds:.3} s"),
                None => format!("job {job}{on}: {stage} {:.0} %", fraction * 100.0),
            }
        }
        Event::Published {
            job,
            scanner,
            directory,
            files,
            ..
        } => {
            let on = output::on_scanner(scanner);
            format!(
                "job {job}{on}: published {directory} ({})",
                files.join(", ")
            )
        }
        Event::Lagged { missed } => format!("({missed} events were lost: too slow a reader)"),
        Event::Scanner(scanner) => {
            let problem = scanner
                .problem
                .as_ref()
                .map_or(String::new(), |problem| format!(": {problem}"));
            format!("{}: {}{problem}", at(scanner), scanner.link.as_str())
        }
        Event::Laser(laser) => {
            let on = output::on_scanner(&laser.scanner);
            format!("laser{on}: {}: {}", laser.laser.as_str(), laser.cause)
        }
        Event::Unknown => "(an event this program does not know)".to_owned(),
    }
}

/// Which scanner, and where it is attached.
fn at(scanner: &ScannerStatus) -> String {
    let name = output::scanner(&scanner.name);
    format!("{name} at {}", scanner.endpoint)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_happens_is_told_with_the_scanner_where_it_has_a_name() {
        let told = |scanner: &str| {
            let progress = format!(
                r#"{{"kind":"progress","job":3,"scan":"s","scanner":"{scanner}",
                    "stage":"segment","fraction":0.5}}"#
            );
            line(&serde_json::from_str(&progress).unwrap())
        };
        assert_eq!(told("left"), "job 3 on left: segment 50 %");
        assert_eq!(told("scanner"), "job 3: segment 50 %");
        assert_eq!(told(""), "job 3: segment 50 %");
        let job = r#"{"kind":"job","id":3,"scan":"s","scanner":"left","result":"s","name":"n",
            "state":"queued","queued_at":"t"}"#;
        assert_eq!(
            line(&serde_json::from_str(job).unwrap()),
            "job 3 of scan s on left: queued"
        );
    }
}
