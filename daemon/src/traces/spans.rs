//! What a scan and a job are as spans.
//!
//! Nothing is measured for them: they are made of the records once these have ended. Ids follow
//! from those of scan and job, so that what another run of the service tells of joins the same
//! trace.

use std::time::{Duration, SystemTime};

use jiff::Timestamp;
use opentelemetry::trace::{
    SpanContext, SpanId, SpanKind, Status, TraceFlags, TraceId, TraceState,
};
use opentelemetry::{InstrumentationScope, KeyValue};
use opentelemetry_sdk::trace::{SpanData, SpanEvents, SpanLinks};
use relief_api::{Job, JobState, Scan, ScanState};
use sha2::{Digest, Sha256};

/// A trace, and a place in it.
struct Place {
    trace: TraceId,
    parent: SpanId,
    own: SpanId,
}

/// The first bytes of a hash of these words.
fn hashed<const N: usize>(words: &[&str]) -> [u8; N] {
    let mut hash = Sha256::new();
    for word in words {
        hash.update((word.len() as u64).to_le_bytes());
        hash.update(word);
    }
    let mut bytes = [0; N];
    let wanted = hash.finalize();
    for (byte, hashed) in bytes.iter_mut().zip(wanted) {
        *byte = hashed;
    }
    bytes
}

fn trace_of(scan: &str) -> TraceId {
    TraceId::from_bytes(hashed(&["trace", scan]))
}

fn span_of(words: &[&str]) -> SpanId {
    SpanId::from_bytes(hashed(words))
}

fn scan_span(scan: &str) -> SpanId {
    span_of(&["scan", scan])
}

fn moment(told: Option<&str>) -> Option<SystemTime> {
    let at: Timestamp = told?.parse().ok()?;
    Some(SystemTime::from(at))
}

fn span(
    name: String,
    place: &Place,
    [start_time, end_time]: [SystemTime; 2],
    attributes: Vec<KeyValue>,
    status: Status,
) -> SpanData {
    let (flags, state) = (TraceFlags::SAMPLED, TraceState::default());
    SpanData {
        span_context: SpanContext::new(place.trace, place.own, flags, false, state),
        parent_span_id: place.parent,
        parent_span_is_remote: false,
        span_kind: SpanKind::Internal,
        name: name.into(),
        start_time,
        // A clock that was set back in between tells of no time before the start.
        end_time: end_time.max(start_time),
        attributes,
        dropped_attributes_count: 0,
        events: SpanEvents::default(),
        links: SpanLinks::default(),
        status,
        instrumentation_scope: InstrumentationScope::builder("reliefd")
            .with_version(env!("CARGO_PKG_VERSION"))
            .build(),
    }
}

/// A scan that has ended, unless its times cannot be read.
pub(super) fn of_scan(scan: &Scan) -> Option<SpanData> {
    let start = moment(Some(&scan.started_at))?;
    let end = moment(scan.ended_at.as_deref())?;
    let place = Place {
        trace: trace_of(&scan.id),
        parent: SpanId::INVALID,
        own: scan_span(&scan.id),
    };
    let attributes = vec![
        KeyValue::new("relief.scan", scan.id.clone()),
        KeyValue::new("relief.name", scan.name.clone()),
        KeyValue::new("relief.scanner", scan.scanner.clone()),
        KeyValue::new("relief.state", scan.state.as_str()),
        KeyValue::new("relief.columns", i64::from(scan.columns)),
        KeyValue::new("relief.columns_planned", i64::from(scan.columns_planned)),
    ];
    let status = match (scan.state, &scan.reason) {
        (ScanState::Failed | ScanState::Interrupted, reason) => {
            Status::error(reason.clone().unwrap_or_default())
        }
        _ => Status::Unset,
    };
    Some(span(
        "scan".into(),
        &place,
        [start, end],
        attributes,
        status,
    ))
}

/// An attempt at a job that has ended, and its stages; nothing where its times cannot be read.
pub(super) fn of_job(job: &Job) -> Vec<SpanData> {
    let (Some(start), Some(end)) = (
        moment(job.started_at.as_deref()),
        moment(job.ended_at.as_deref()),
    ) else {
        return Vec::new();
    };
    let (id, attempt) = (job.id.to_string(), job.attempts.to_string());
    // A scan's jobs are numbered within a service, and so are attempts within a job.
    let own = |what: &str| span_of(&[what, &job.scan, &job.queued_at, &id, &attempt]);
    let trace = trace_of(&job.scan);
    let whole = Place {
        trace,
        parent: scan_span(&job.scan),
        own: own("job"),
    };
    let attributes = vec![
        KeyValue::new("relief.scan", job.scan.clone()),
        KeyValue::new("relief.scanner", job.scanner.clone()),
        KeyValue::new("relief.job", i64::try_from(job.id).unwrap_or(i64::MAX)),
        KeyValue::new("relief.result", job.result.clone()),
        KeyValue::new("relief.name", job.name.clone()),
        KeyValue::new("relief.state", job.state.as_str()),
        KeyValue::new("relief.attempt", i64::from(job.attempts)),
    ];
    let status = match (job.state, &job.error) {
        (JobState::Failed, error) => Status::error(error.clone().unwrap_or_default()),
        _ => Status::Unset,
    };
    let mut spans = vec![span("job".into(), &whole, [start, end], attributes, status)];
    let mut part = |name: &str, from: SystemTime, to: SystemTime| {
        let place = Place {
            trace,
            parent: whole.own,
            own: own(name),
        };
        spans.push(span(
            name.to_owned(),
            &place,
            [from, to],
            Vec::new(),
            Status::Unset,
        ));
    };
    // Stages follow one another; the record has how long each took.
    let mut from = start;
    for timing in &job.timings {
        let took = Duration::try_from_secs_f64(timing.seconds).unwrap_or_default();
        let to = from.checked_add(took).unwrap_or(end);
        part(&timing.stage, from, to);
        from = to;
    }
    spans
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn scan(state: &str) -> Scan {
        serde_json::from_value(json!({
            "id": "s1", "name": "house", "scanner": "left", "state": state,
            "reason": "the line was lost", "started_at": "2026-11-29T10:00:00.000Z",
            "ended_at": "2026-11-29T10:00:09.500Z", "columns_planned": 40, "columns": 12,
        }))
        .unwrap()
    }

    fn job(attempts: u32) -> Job {
        serde_json::from_value(json!({
            "id": 7, "scan": "s1", "scanner": "left", "result": "s1", "name": "house",
            "state": "failed", "error": "no region is large enough", "attempts": attempts,
            "queued_at": "2026-11-29T10:00:09.500Z", "started_at": "2026-11-29T10:00:10.000Z",
            "ended_at": "2026-11-29T10:00:12.000Z",
            "timings": [{"stage": "regrid", "seconds": 0.5}, {"stage": "segment", "seconds": 1.25}],
        }))
        .unwrap()
    }

    fn seconds(span: &SpanData) -> f64 {
        span.end_time
            .duration_since(span.start_time)
            .unwrap()
            .as_secs_f64()
    }

    #[test]
    fn a_scan_is_the_root_of_its_jobs_and_their_stages() {
        let scan = of_scan(&scan("failed")).unwrap();
        assert_eq!(seconds(&scan), 9.5);
        assert_eq!(scan.parent_span_id, SpanId::INVALID);
        assert_eq!(scan.status, Status::error("the line was lost"));
        let spans = of_job(&job(1));
        let names: Vec<&str> = spans.iter().map(|span| &*span.name).collect();
        assert_eq!(names, ["job", "regrid", "segment"]);
        for span in &spans {
            assert_eq!(span.span_context.trace_id(), scan.span_context.trace_id());
            assert!(span.span_context.is_valid());
        }
        assert_eq!(spans[0].parent_span_id, scan.span_context.span_id());
        assert_eq!(spans[2].parent_span_id, spans[0].span_context.span_id());
        assert_eq!(spans[2].start_time, spans[1].end_time);
        assert_eq!((seconds(&spans[1]), seconds(&spans[2])), (0.5, 1.25));
        assert_eq!(spans[0].status, Status::error("no region is large enough"));
    }

    #[test]
    fn another_attempt_is_another_span_and_the_same_one_the_same() {
        let [first, again, second] = [1, 1, 2].map(|n| of_job(&job(n)).remove(0).span_context);
        assert_eq!(first, again);
        assert_ne!(first.span_id(), second.span_id());
        assert_eq!(first.trace_id(), second.trace_id());
    }

    #[test]
    fn what_did_not_end_or_never_began_is_not_told() {
        let mut open = scan("scanning");
        open.ended_at = None;
        assert!(of_scan(&open).is_none());
        let mut queued = job(0);
        queued.started_at = None;
        assert!(of_job(&queued).is_empty());
        // Nor does a clock that was set back, or a time that is none, stop anything.
        let mut back = job(1);
        back.ended_at = Some("2026-11-29T09:00:00Z".into());
        back.timings[0].seconds = f64::NAN;
        assert_eq!(of_job(&back).len(), 3);
        assert_eq!(seconds(&of_job(&back)[0]), 0.0);
    }
}
