//! What a mail says: a subject that says it all, what happened, what to do, where the result is.

use std::fmt::Write as _;

use relief_api::{Job, Scan, ScanState, ScannerStatus, WebhookData, WebhookEvent, WebhookMessage};

/// Characters of a subject: more are cut off by what shows them.
const MOST_SUBJECT_CHARS: usize = 100;

/// A mail in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Letter {
    pub(super) subject: String,
    pub(super) text: String,
}

/// Paragraphs of a text.
#[derive(Default)]
struct Paragraphs(Vec<String>);

impl Paragraphs {
    fn add(&mut self, text: impl Into<String>) {
        let text = text.into();
        if !text.is_empty() {
            self.0.push(text);
        }
    }
}

/// Puts a message into words. `public_url` is where a browser finds the service's page.
pub(super) fn letter(message: &WebhookMessage, machine: &str, public_url: Option<&str>) -> Letter {
    let data = &message.data;
    let mut told = Paragraphs::default();
    let (subject, route) = match message.event {
        WebhookEvent::ScanEnded => of_scan_ended(data, &mut told),
        WebhookEvent::ScanPaused => of_pause(data, &mut told),
        WebhookEvent::JobDone => of_job_done(data, &mut told),
        WebhookEvent::JobFailed => of_job_failed(data, &mut told),
        WebhookEvent::ScannerTrouble => of_trouble(data, &mut told),
        WebhookEvent::Interlock => of_interlock(data, &mut told),
        WebhookEvent::DiskLow => of_disk(data, &mut told),
        WebhookEvent::Test => of_test(data, &mut told),
        WebhookEvent::Unknown => ("something happened".to_owned(), None),
    };
    if let Some(scan) = &data.scan {
        told.add(particulars(scan));
    }
    if let Some(url) = public_url {
        let url = url.trim_end_matches('/');
        told.add(match route {
            Some(route) => format!("See {url}/#/{route}"),
            None => format!("See {url}/"),
        });
    }
    told.add(format!("{}, Relief on {machine}", message.timestamp));
    Letter {
        subject: one_line(&format!("[Relief] {subject}")),
        text: told.0.join("\n\n") + "\n",
    }
}

/// No name of a part or operator may begin another header.
fn one_line(text: &str) -> String {
    let words: Vec<&str> = text
        .split(|c: char| c.is_whitespace() || c.is_control())
        .filter(|word| !word.is_empty())
        .collect();
    let line = words.join(" ");
    if line.chars().count() <= MOST_SUBJECT_CHARS {
        return line;
    }
    let kept: String = line.chars().take(MOST_SUBJECT_CHARS - 3).collect();
    format!("{}...", kept.trim_end())
}

/// Ends as a sentence does.
fn sentence(text: &str) -> String {
    let text = text.trim_end();
    match text.ends_with(['.', '!', '?']) {
        true => text.to_owned(),
        false => format!("{text}."),
    }
}

/// What is told, and the page's view of it.
type Told = (String, Option<String>);

fn of_scan_ended(data: &WebhookData, told: &mut Paragraphs) -> Told {
    let Some(scan) = &data.scan else {
        return ("a scan is over".into(), None);
    };
    let name = &scan.name;
    let reason = scan.reason.as_deref().unwrap_or_default();
    let subject = match scan.state {
        ScanState::Complete => {
            told.add(format!("The scan {name} is complete."));
            told.add("Its result follows as soon as it is processed.");
            format!("{name}: scan complete, {} columns", scan.columns)
        }
        state => {
            let state = state.as_str();
            let became = match state {
                "failed" => "has failed",
                "aborted" => "was aborted",
                _ => "was interrupted",
            };
            told.add(match reason {
                "" => format!("The scan {name} {became}."),
                reason => format!("The scan {name} {became}: {}", sentence(reason)),
            });
            told.add(format!(
                "The {} columns of {} that were taken are kept.",
                scan.columns, scan.columns_planned
            ));
            told.add(format!(
                "To make what can be made of them: relief rerun {}\nTo scan again: relief scan \
                 --name {:?}",
                scan.id, name
            ));
            match reason {
                "" => format!("{name}: scan {state}"),
                reason => format!("{name}: scan {state}: {reason}"),
            }
        }
    };
    (subject, Some("scans".into()))
}

fn of_pause(data: &WebhookData, told: &mut Paragraphs) -> Told {
    let Some(scan) = &data.scan else {
        return ("a scan waits for a person".into(), None);
    };
    let (name, reason) = (&scan.name, scan.reason.as_deref().unwrap_or_default());
    told.add(format!(
        "The scan {name} stands still after {} of {} columns, with the laser off, and waits for a \
         person.",
        scan.columns, scan.columns_planned
    ));
    told.add(match reason {
        "" => String::new(),
        reason => format!("Why: {}", sentence(reason)),
    });
    told.add(format!(
        "Look at the scanner first. To go on: relief resume {id}\nTo end it: relief abort {id}",
        id = scan.id
    ));
    let subject = match reason {
        "" => format!("{name}: scan waits for you"),
        reason => format!("{name}: scan waits for you: {reason}"),
    };
    (subject, Some("machine".into()))
}

fn of_job_done(data: &WebhookData, told: &mut Paragraphs) -> Told {
    let Some(job) = &data.job else {
        return ("a result is ready".into(), None);
    };
    told.add(format!("The result of {} is ready.", job.name));
    if let Some(directory) = &job.directory {
        told.add(format!("Its files are in {directory}"));
    }
    let left_out = &job.left_out;
    let mut subject = format!("{}: result ready", job.name);
    if !left_out.is_empty() {
        let _ = write!(subject, ", but {} of it could not be made", left_out.len());
        told.add(format!(
            "This could not be made:\n- {}",
            left_out.join("\n- ")
        ));
    }
    let took: f64 = job.timings.iter().map(|stage| stage.seconds).sum();
    if took > 0.0 {
        told.add(format!("Processing took {took:.0} s."));
    }
    told.add(format!("To fetch it: relief fetch {}", job.result));
    (subject, Some(format!("result/{}", job.result)))
}

fn of_job_failed(data: &WebhookData, told: &mut Paragraphs) -> Told {
    let Some(job) = &data.job else {
        return ("processing failed".into(), None);
    };
    let Job { id, name, .. } = job;
    let error = job.error.as_deref().unwrap_or("no reason is known");
    told.add(format!("Processing {name} failed: {}", sentence(error)));
    if let Some(hint) = &job.hint {
        told.add(format!("What to do: {}", sentence(hint)));
    }
    told.add(format!(
        "The scan is kept. To process it again as it is: relief retry {id}\nWith other settings: \
         relief rerun {}",
        job.scan
    ));
    (
        format!("{name}: processing failed: {error}"),
        Some("jobs".into()),
    )
}

/// Of a scanner and what is wrong with it.
fn trouble(data: &WebhookData) -> (String, String) {
    let scanner = data.scanner.clone().unwrap_or_else(|| "?".into());
    let problem = data
        .status
        .as_ref()
        .and_then(|status| status.problem.clone());
    (scanner, problem.unwrap_or_else(|| "trouble".into()))
}

fn of_trouble(data: &WebhookData, told: &mut Paragraphs) -> Told {
    let (scanner, problem) = trouble(data);
    told.add(format!(
        "The scanner {scanner} is in trouble: {}",
        sentence(&problem)
    ));
    told.add(place(data.status.as_ref()));
    told.add("To see how it does: relief status\nTo find the cause: relief doctor");
    (
        format!("scanner {scanner}: {problem}"),
        Some("machine".into()),
    )
}

fn of_interlock(data: &WebhookData, told: &mut Paragraphs) -> Told {
    let (scanner, problem) = trouble(data);
    told.add(format!(
        "The safety chain of the scanner {scanner} is open: {} The scanner keeps its laser off while it is.",
        sentence(&problem)
    ));
    told.add(place(data.status.as_ref()));
    told.add(
        "Look why before anything else: somebody may have wanted it to stop. Close the interlock, \
         or release the emergency stop. To go on with a scan that stands still: relief resume",
    );
    (
        format!("scanner {scanner}: {problem}: safety chain open"),
        Some("machine".into()),
    )
}

fn place(status: Option<&ScannerStatus>) -> String {
    let Some(status) = status else {
        return String::new();
    };
    let known = [&status.model, &status.serial].map(|known| known.as_deref());
    let known: Vec<&str> = known.into_iter().flatten().collect();
    match known.join(" ") {
        known if known.is_empty() => format!("It is attached to {}.", status.endpoint),
        known => format!("It is attached to {} ({known}).", status.endpoint),
    }
}

fn of_disk(data: &WebhookData, told: &mut Paragraphs) -> Told {
    let Some(disk) = &data.disk else {
        return ("the disk gets full".into(), None);
    };
    let free_mb = disk.free_bytes / 1_000_000;
    told.add(format!(
        "{free_mb} MB are free in {}, less than the {} MB of storage.low_mb.",
        disk.folder,
        disk.low_bytes / 1_000_000
    ));
    told.add(format!(
        "A scan that would leave less than {} MB (storage.reserve_mb) is refused.",
        disk.reserve_bytes / 1_000_000
    ));
    told.add(
        "Fetch what is needed and delete it there, or let the service remove what is old: \
         storage.scans_days, results_days, scans_mb and results_mb.",
    );
    (
        format!("disk nearly full: {free_mb} MB free in {}", disk.folder),
        Some("room".into()),
    )
}

fn of_test(data: &WebhookData, told: &mut Paragraphs) -> Told {
    let name = data.webhook.as_deref().unwrap_or_default();
    told.add(format!(
        "This is a test of [[mail]] {name}, which somebody asked for. Mails arrive."
    ));
    (format!("test of {name}"), None)
}

/// Whose scan it is, as far as anybody has said.
fn particulars(scan: &Scan) -> String {
    let known = [
        ("Scan", &scan.id),
        ("Part", &scan.part),
        ("Operator", &scan.operator),
        ("Scanner", &scan.scanner),
        ("Note", &scan.note),
    ];
    let lines: Vec<String> = known
        .into_iter()
        .filter(|(_, value)| !value.is_empty())
        .map(|(key, value)| format!("{key}: {value}"))
        .collect();
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    const URL: &str = "https://bench.lab.example/";

    fn of(event: &str, data: Value) -> Letter {
        let message = json!({
            "type": event,
            "timestamp": "2026-11-22T10:00:00.000Z",
            "data": data,
        });
        let message: WebhookMessage = serde_json::from_value(message).unwrap();
        letter(&message, "bench-1", Some(URL))
    }

    fn scan(state: &str, reason: Option<&str>) -> Value {
        json!({
            "id": "20261122T095900.000Z-roof",
            "name": "roof",
            "part": "P-17",
            "operator": "Ada",
            "scanner": "left",
            "state": state,
            "reason": reason,
            "started_at": "2026-11-22T09:59:00.000Z",
            "columns": 120,
            "columns_planned": 240,
        })
    }

    fn job(state: &str, more: &Value) -> Value {
        let mut job = json!({
            "id": 7,
            "scan": "20261122T095900.000Z-roof",
            "result": "20261122T095900.000Z-roof",
            "name": "roof",
            "state": state,
            "queued_at": "2026-11-22T10:00:00.000Z",
        });
        let (job_keys, more) = (job.as_object_mut().unwrap(), more.as_object().unwrap());
        job_keys.extend(more.clone());
        job
    }

    #[test]
    fn a_mail_says_what_happened_what_to_do_and_where_it_is() {
        let failed = of(
            "scan-ended",
            json!({ "scan": scan("failed", Some("table stalled")) }),
        );
        assert_eq!(failed.subject, "[Relief] roof: scan failed: table stalled");
        assert_eq!(
            failed.text,
            "The scan roof has failed: table stalled.\n\n\
             The 120 columns of 240 that were taken are kept.\n\n\
             To make what can be made of them: relief rerun 20261122T095900.000Z-roof\n\
             To scan again: relief scan --name \"roof\"\n\n\
             Scan: 20261122T095900.000Z-roof\nPart: P-17\nOperator: Ada\nScanner: left\n\n\
             See https://bench.lab.example/#/scans\n\n\
             2026-11-22T10:00:00.000Z, Relief on bench-1\n"
        );
    }

    #[test]
    fn every_event_has_a_subject_a_hint_and_a_link() {
        let directory = "/var/spool/relief/20261122T095900.000Z-roof";
        let done = job(
            "done",
            &json!({
                "directory": directory,
                "left_out": ["pictures: no room"],
                "timings": [{ "stage": "fit", "seconds": 1.4 }, { "stage": "write", "seconds": 1.4 }],
            }),
        );
        let failed = job(
            "failed",
            &json!({ "error": "no sample is left", "hint": "widen regrid.roi_x_mm" }),
        );
        let status = json!({
            "name": "left",
            "link": "trouble",
            "endpoint": "/dev/relief/scanner-000123",
            "model": "ST-2",
            "problem": "interlock open",
        });
        let stopped = json!({ "scanner": "left", "status": status });
        let disk = json!({
            "folder": "/var/lib/relief/scans",
            "free_bytes": 900_000_000_u64,
            "low_bytes": 1_024_000_000_u64,
            "reserve_bytes": 256_000_000_u64,
        });
        for (event, data, subject, parts) in [
            (
                "scan-ended",
                json!({ "scan": scan("complete", None) }),
                "[Relief] roof: scan complete, 120 columns",
                vec!["Its result follows", "#/scans"],
            ),
            (
                "scan-paused",
                json!({ "scan": scan("paused", Some("interlock open")) }),
                "[Relief] roof: scan waits for you: interlock open",
                vec![
                    "after 120 of 240 columns, with the laser off",
                    "relief resume 20261122T095900.000Z-roof",
                    "#/machine",
                ],
            ),
            (
                "job-done",
                json!({ "job": done, "scan": scan("complete", None) }),
                "[Relief] roof: result ready, but 1 of it could not be made",
                vec![
                    directory,
                    "- pictures: no room",
                    "took 3 s",
                    "relief fetch 2026",
                    "#/result/2026",
                ],
            ),
            (
                "job-failed",
                json!({ "job": failed }),
                "[Relief] roof: processing failed: no sample is left",
                vec![
                    "What to do: widen regrid.roi_x_mm.",
                    "relief retry 7",
                    "#/jobs",
                ],
            ),
            (
                "scanner-trouble",
                stopped.clone(),
                "[Relief] scanner left: interlock open",
                vec![
                    "attached to /dev/relief/scanner-000123 (ST-2)",
                    "relief doctor",
                ],
            ),
            (
                "interlock",
                stopped,
                "[Relief] scanner left: interlock open: safety chain open",
                vec!["keeps its laser off", "Look why before anything else"],
            ),
            (
                "disk-low",
                json!({ "disk": disk }),
                "[Relief] disk nearly full: 900 MB free in /var/lib/relief/scans",
                vec![
                    "less than the 1024 MB",
                    "less than 256 MB",
                    "storage.scans_days",
                    "#/room",
                ],
            ),
            (
                "test",
                json!({ "webhook": "night" }),
                "[Relief] test of night",
                vec!["Mails arrive", "See https://bench.lab.example/\n"],
            ),
        ] {
            let letter = of(event, data);
            assert_eq!(letter.subject, subject);
            for part in parts {
                assert!(
                    letter.text.contains(part),
                    "{event}, {part}: {}",
                    letter.text
                );
            }
        }
    }

    #[test]
    fn a_subject_is_one_line_whatever_a_part_is_called() {
        let mut scan = scan("complete", None);
        scan["name"] = "roof\r\nBcc: eve@example.org ".repeat(9).into();
        let letter = of("scan-ended", json!({ "scan": scan }));
        assert!(!letter.subject.contains(['\r', '\n']), "{}", letter.subject);
        assert!(
            letter.subject.len() <= MOST_SUBJECT_CHARS,
            "{}",
            letter.subject
        );
        assert!(letter.subject.ends_with("..."), "{}", letter.subject);
    }

    #[test]
    fn without_an_address_of_the_page_there_is_no_link() {
        let message = json!({
            "type": "test",
            "timestamp": "2026-11-22T10:00:00.000Z",
            "data": { "webhook": "night" },
        });
        let message: WebhookMessage = serde_json::from_value(message).unwrap();
        assert!(!letter(&message, "bench-1", None).text.contains("See "));
    }
}
