//! A collector is told how long scans and jobs took, and nobody waits for it.

use std::collections::BTreeMap;

use relief_api::{ScanState, Status, path};
use reliefd::config::TracesConfig;
use serde_json::Value;

use crate::rig::{Rig, ended};
use crate::webhooks::receiver::{Answer, Receiver, any_port};
use crate::webhooks::write_secret;

/// The spans of a request.
fn spans(body: &str) -> Vec<Value> {
    let told: Value = serde_json::from_str(body).unwrap();
    let service = &told["resourceSpans"][0];
    let attributes = service["resource"]["attributes"].as_array().unwrap();
    let is_named = |attribute: &Value| {
        attribute["key"] == "service.name" && attribute["value"]["stringValue"] == "reliefd"
    };
    assert!(attributes.iter().any(is_named), "{attributes:?}");
    service["scopeSpans"][0]["spans"]
        .as_array()
        .unwrap()
        .clone()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scan_its_job_and_the_stages_become_a_trace() {
    let collector = Receiver::new([]);
    let folder = tempfile::tempdir().unwrap();
    let fields = folder.path().join("fields");
    write_secret(&fields, "authorization: Bearer hunter2\n");
    let rig = Rig::start(folder, |config| {
        config.traces = TracesConfig {
            collector: Some(format!("http://{}/", collector.address)),
            headers_file: Some(fields),
            ..TracesConfig::default()
        };
    })
    .await;
    let (scan, job) = rig.scan_to_result("a").await;
    rig.daemon.shutdown().await;
    let mut found = BTreeMap::new();
    // Two requests, or one for both.
    while !(found.contains_key("scan") && found.contains_key("job")) {
        let got = collector.next();
        assert!(
            got.request.starts_with("POST /v1/traces "),
            "{}",
            got.request
        );
        assert_eq!(got.header("authorization"), "Bearer hunter2");
        assert_eq!(got.header("content-type"), "application/json");
        for span in spans(&got.body) {
            found.insert(span["name"].as_str().unwrap().to_owned(), span);
        }
    }
    let text = |name: &str, key: &str| found[name][key].as_str().unwrap().to_owned();
    for timing in &job.timings {
        assert_eq!(text(&timing.stage, "parentSpanId"), text("job", "spanId"));
        let at = |key: &str| text(&timing.stage, key).parse::<f64>().unwrap() * 1e-9;
        let took_s = at("endTimeUnixNano") - at("startTimeUnixNano");
        assert!(
            (took_s - timing.seconds).abs() < 1e-6,
            "{timing:?}: {took_s}"
        );
    }
    assert_eq!(text("job", "parentSpanId"), text("scan", "spanId"));
    let traces: Vec<String> = found.keys().map(|name| text(name, "traceId")).collect();
    assert!(
        traces
            .iter()
            .all(|trace| *trace == traces[0] && trace.len() == 32)
    );
    let attributes = found["scan"]["attributes"].as_array().unwrap();
    let id = attributes
        .iter()
        .find(|a| a["key"] == "relief.scan")
        .unwrap();
    assert_eq!(id["value"]["stringValue"], scan.id);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_collector_that_hangs_or_is_away_keeps_nobody() {
    let away = any_port().local_addr().unwrap();
    let hanging = Receiver::new([Answer::Hang, Answer::Hang]);
    for collector in [away, hanging.address] {
        let folder = tempfile::tempdir().unwrap();
        let rig = Rig::start(folder, |config| {
            config.traces.collector = Some(format!("http://{collector}"));
        })
        .await;
        let mut events = rig.client.events().await;
        let scan = rig.start_scan("a").await;
        assert_eq!(
            ended(&mut events, &scan.id).await.state,
            ScanState::Complete
        );
        let _: Status = rig.client.get(path::STATUS).await;
        rig.daemon.shutdown().await;
    }
}
