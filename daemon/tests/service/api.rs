//! What programs build on: the API's description, pages of lists, keys of requests, parts of
//! files, links for browsers, metrics.

use std::collections::BTreeSet;

use relief_api::{
    CreateTicket, Event, JobList, LiveColumn, NewToken, Problem, Regrid, RegridImage, Scan,
    ScanImage, ScanList, StartScan, Ticket, path,
};
use serde_json::Value;
use tokio::net::TcpStream;

use crate::client::{Reply, exchange};
use crate::fake::COLUMNS;
use crate::rig::{Rig, ended};

/// A request with further header fields.
async fn ask(rig: &Rig, method: &str, path: &str, fields: &str, body: Option<&str>) -> Reply {
    let stream = tokio::net::UnixStream::connect(rig.daemon.socket())
        .await
        .unwrap();
    let host = format!("localhost{fields}");
    exchange(stream, &host, method, path, body).await
}

#[tokio::test(flavor = "multi_thread")]
async fn the_description_has_every_endpoint_with_its_problems() {
    let rig = Rig::new().await;
    let document: Value = rig.client.get(path::OPENAPI).await;
    assert_eq!(document["openapi"], "3.1.0");
    assert_eq!(document["info"]["version"], env!("CARGO_PKG_VERSION"));
    let source = include_str!("../../api/src/path.rs");
    let constants = source.lines().filter_map(|line| {
        let value = line.strip_prefix("pub const ")?.split_once("= \"")?.1;
        Some(value.trim_end_matches("\";").to_owned())
    });
    let known: BTreeSet<String> = constants.collect();
    let described = document["paths"].as_object().unwrap();
    let described: BTreeSet<String> = described.keys().cloned().collect();
    assert!(known.len() > 30);
    assert_eq!(described, known);
    let mut names = BTreeSet::new();
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            let name = operation["operationId"].as_str().unwrap().to_owned();
            assert!(
                names.insert(name),
                "{method} {path}: its name is not its own"
            );
            assert!(
                operation["summary"].is_string(),
                "{method} {path} says nothing"
            );
            for status in ["400", "401", "500"] {
                let problem = &operation["responses"][status]["$ref"];
                assert_eq!(problem, "#/components/responses/Problem", "{method} {path}");
            }
        }
    }
    // Every reference leads somewhere.
    let text = document.to_string();
    for reference in text.split("\"$ref\":\"#").skip(1) {
        let pointer = reference.split('"').next().unwrap();
        assert!(document.pointer(pointer).is_some(), "{pointer}");
    }
    assert!(
        text.contains("#/components/schemas/LiveColumn"),
        "events are described"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn lists_come_page_by_page() {
    let rig = Rig::new().await;
    let mut ids = Vec::new();
    for name in ["a", "b", "c", "d", "e"] {
        ids.insert(0, rig.scan_to_result(name).await.0.id);
    }
    let all: ScanList = rig.client.get(path::SCANS).await;
    let found: Vec<&String> = all.scans.iter().map(|scan| &scan.id).collect();
    assert_eq!((found, all.next), (ids.iter().collect(), None));

    let mut found = Vec::new();
    let mut next = String::new();
    loop {
        let page: ScanList = rig
            .client
            .get(&format!("{}?limit=2{next}", path::SCANS))
            .await;
        found.extend(page.scans.into_iter().map(|scan| scan.id));
        match page.next {
            Some(last) => next = format!("&before={last}"),
            None => break,
        }
    }
    assert_eq!(found, ids);
    // A page that ends with the list is the last.
    let whole: ScanList = rig.client.get(&format!("{}?limit=5", path::SCANS)).await;
    assert_eq!((whole.scans.len(), whole.next), (5, None));

    let page: JobList = rig.client.get("/v1/jobs?limit=3").await;
    let numbers: Vec<u64> = page.jobs.iter().map(|job| job.id).collect();
    assert_eq!((numbers.len(), page.next), (3, numbers.last().copied()));
    let rest = format!("/v1/jobs?limit=3&before={}", numbers[2]);
    let rest: JobList = rig.client.get(&rest).await;
    assert_eq!((rest.jobs.len(), rest.next), (2, None));
    assert!(rest.jobs[0].id < numbers[2]);

    for (query, told) in [
        ("/v1/scans?limit=0", "from 1 to 1000"),
        ("/v1/scans?limit=1001", "from 1 to 1000"),
        ("/v1/scans?limit=x", "limit"),
        ("/v1/scans?offset=3", "unknown field `offset`"),
        ("/v1/jobs?before=x", "jobs have numbers"),
    ] {
        let problem = rig.client.request("GET", query, None).await.problem();
        assert_eq!(
            (problem.status, problem.kind.as_str()),
            (400, "wrong-query")
        );
        assert!(problem.detail.contains(told), "{query}: {problem}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_with_a_key_is_done_once() {
    let rig = Rig::new().await;
    let start = async |key: &str, name: &str| {
        let body = format!(r#"{{"name":"{name}"}}"#);
        let fields = format!("\r\nIdempotency-Key: {key}");
        ask(&rig, "POST", path::SCANS, &fields, Some(&body)).await
    };
    let scan_of = |reply: Reply| -> Scan {
        assert_eq!(
            reply.status,
            202,
            "{}",
            String::from_utf8_lossy(&reply.body)
        );
        serde_json::from_slice(&reply.body).unwrap()
    };
    let mut events = rig.client.events().await;
    let first = scan_of(start("k-1", "a").await);
    // In the midst of it, where another scan would be refused.
    assert_eq!(scan_of(start("k-1", "a").await).id, first.id);
    ended(&mut events, &first.id).await;
    let again = scan_of(start("k-1", "a").await);
    assert_eq!(again.id, first.id);
    let other = start("k-1", "b").await.problem();
    assert_eq!((other.status, other.kind.as_str()), (422, "key-used"));
    assert!(other.detail.contains(&first.id), "{other}");
    let second = scan_of(start("k-2", "a").await);
    assert_ne!(second.id, first.id);
    ended(&mut events, &second.id).await;
    for key in ["", "a b", &"x".repeat(201)] {
        let refused = start(key, "a").await.problem();
        assert_eq!((refused.status, refused.kind.as_str()), (400, "wrong-key"));
    }
    // Known to the next run of the service, too.
    let rig = rig.restart().await;
    let fields = "\r\nIdempotency-Key: k-1";
    let reply = ask(&rig, "POST", path::SCANS, fields, Some(r#"{"name":"a"}"#)).await;
    assert_eq!(scan_of(reply).id, first.id);
    let all: ScanList = rig.client.get(path::SCANS).await;
    assert_eq!(all.scans.len(), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn files_are_sent_in_parts_and_only_to_who_has_them_not() {
    let rig = Rig::new().await;
    let (scan, job) = rig.scan_to_result("part").await;
    let on_disk = std::fs::read(format!("{}/part.igs", job.directory.unwrap())).unwrap();
    let file = path::spool_file(&scan.id, "part.igs");
    let whole = ask(&rig, "GET", &file, "", None).await;
    assert_eq!((whole.status, &whole.body), (200, &on_disk));
    assert_eq!(whole.header("accept-ranges"), Some("bytes"));
    let etag = whole.header("etag").unwrap().to_owned();

    let part = ask(&rig, "GET", &file, "\r\nRange: bytes=80-159", None).await;
    assert_eq!((part.status, &part.body[..]), (206, &on_disk[80..160]));
    let range = format!("bytes 80-159/{}", on_disk.len());
    assert_eq!(part.header("content-range"), Some(range.as_str()));
    assert_eq!(part.header("content-length"), Some("80"));
    let tail = format!(
        "\r\nRange: bytes={}-\r\nIf-Range: {etag}",
        on_disk.len() - 5
    );
    let tail = ask(&rig, "GET", &file, &tail, None).await;
    assert_eq!(
        (tail.status, &tail.body[..]),
        (206, &on_disk[on_disk.len() - 5..])
    );
    let changed = ask(
        &rig,
        "GET",
        &file,
        "\r\nRange: bytes=0-4\r\nIf-Range: \"x\"",
        None,
    )
    .await;
    assert_eq!((changed.status, changed.body.len()), (200, on_disk.len()));
    let beyond = ask(&rig, "GET", &file, "\r\nRange: bytes=99999999-", None).await;
    let range = format!("bytes */{}", on_disk.len());
    assert_eq!(beyond.header("content-range"), Some(range.as_str()));
    assert_eq!(beyond.problem().kind, "no-such-range");
    let same = ask(
        &rig,
        "GET",
        &file,
        &format!("\r\nIf-None-Match: {etag}"),
        None,
    )
    .await;
    assert_eq!((same.status, same.body.len()), (304, 0));
    assert_eq!(same.header("etag"), Some(etag.as_str()));
    let head = ask(&rig, "HEAD", &file, "", None).await;
    let length = on_disk.len().to_string();
    assert_eq!(head.header("content-length"), Some(length.as_str()));
    assert_eq!(head.body.len(), 0);

    let page = ask(
        &rig,
        "GET",
        &path::spool_file(&scan.id, "report.html"),
        "",
        None,
    )
    .await;
    assert_eq!(
        page.header("content-type"),
        Some("text/html; charset=utf-8")
    );
    let policy = page.header("content-security-policy").unwrap();
    assert!(policy.starts_with("sandbox;"), "{policy}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_browser_follows_a_ticket_without_a_token() {
    let rig = Rig::start(tempfile::tempdir().unwrap(), |config| {
        config.service.listen = Some("127.0.0.1:0".parse().unwrap());
    })
    .await;
    let (scan, _) = rig.scan_to_result("part").await;
    let address = rig.daemon.listen().unwrap();
    let desk: NewToken = rig
        .client
        .post(path::TOKENS, &serde_json::json!({"name": "desk"}))
        .await;
    let at = async |fields: &str, method: &str, path: &str, body: Option<&str>| {
        let stream = TcpStream::connect(address).await.unwrap();
        exchange(stream, &format!("{address}{fields}"), method, path, body).await
    };
    let file = path::spool_file(&scan.id, "part.igs");
    assert_eq!(at("", "GET", &file, None).await.status, 401);
    let bearer = format!("\r\nAuthorization: Bearer {}", desk.token);
    let wish = serde_json::to_string(&CreateTicket { path: file.clone() }).unwrap();
    let made = at(&bearer, "POST", path::TICKETS, Some(&wish)).await;
    assert_eq!(made.status, 201);
    let ticket: Ticket = serde_json::from_slice(&made.body).unwrap();
    assert_eq!(ticket.expires_in_s, 60);
    let got = at("", "GET", &ticket.url, None).await;
    assert_eq!(got.status, 200);
    assert!(got.body.ends_with(b"T      1\n"), "an IGES file");
    // For nothing else, and for no other site's page.
    let other = ticket.url.replace("part.igs", "report.json");
    assert_eq!(at("", "GET", &other, None).await.status, 401);
    assert_eq!(at("", "POST", &ticket.url, None).await.status, 401);
    let foreign = "\r\nSec-Fetch-Site: cross-site";
    assert_eq!(at(foreign, "GET", &ticket.url, None).await.status, 403);
    let wish = r#"{"path":"/v1/status"}"#;
    let refused = at(&bearer, "POST", path::TICKETS, Some(wish))
        .await
        .problem();
    assert_eq!(refused.kind, "no-file");

    // The page itself is for everybody on this machine, and shows nothing without a token.
    let page = at("\r\nSec-Fetch-Site: cross-site", "GET", "/", None).await;
    assert_eq!(page.status, 200);
    assert_eq!(
        page.header("content-type"),
        Some("text/html; charset=utf-8")
    );
    let policy = page.header("content-security-policy").unwrap();
    assert!(policy.starts_with("default-src 'none'"), "{policy}");
    let etag = page.header("etag").unwrap();
    let again = at(&format!("\r\nIf-None-Match: {etag}"), "GET", "/", None).await;
    assert_eq!((again.status, again.body.len()), (304, 0));
    let stream = TcpStream::connect(address).await.unwrap();
    let rebound = exchange(stream, "relief.example", "GET", "/", None).await;
    assert_eq!(rebound.problem().kind, "not-local");
    assert_eq!(at("", "GET", "/assets/x.js", None).await.status, 404);
}

#[tokio::test(flavor = "multi_thread")]
async fn who_comes_in_the_middle_sees_the_whole_image() {
    let rig = Rig::new().await;
    let mut early = rig.client.events().await;
    rig.scanner.allow(COLUMNS / 2);
    let scan = rig.start_scan("live").await;
    let half = |event: &Event| match event {
        Event::Column { columns, .. } if *columns == COLUMNS / 2 => Some(()),
        _ => None,
    };
    let (story, ()) = early.until(half).await;
    let told = |story: &[Event]| -> Vec<LiveColumn> {
        let live = story.iter().filter_map(|event| match event {
            Event::Column { live, .. } => Some(live.clone()),
            _ => None,
        });
        live.flatten().collect()
    };
    let so_far = told(&story);
    assert!(so_far.len() > 5, "{}", so_far.len());
    // Who comes now listens first, and asks then.
    let mut late = rig.client.events().await;
    let image: ScanImage = rig.client.get(&path::scan_image(&scan.id)).await;
    assert_eq!((image.pitch_mm, image.step), (0.5, 1));
    assert_eq!(image.columns, so_far);
    let thin = format!("{}?most_nodes=100", path::scan_image(&scan.id));
    let thin: ScanImage = rig.client.get(&thin).await;
    assert!(thin.step > 1);
    for column in &thin.columns {
        let whole = so_far.iter().find(|own| own.i == column.i).unwrap();
        let first = (column.j_first - whole.j_first) as usize;
        let nodes = whole.z_um[first..].iter().step_by(thin.step as usize);
        assert!(nodes.eq(&column.z_um), "{column:?}");
    }
    rig.scanner.allow_all();
    let over = |event: &Event| match event {
        Event::Scan(own) if own.id == scan.id && own.state.is_over() => Some(()),
        _ => None,
    };
    let (rest, ()) = late.until(over).await;
    let all: Vec<i64> = image
        .columns
        .iter()
        .chain(&told(&rest))
        .map(|c| c.i)
        .collect();
    let expected: Vec<i64> = (all[0]..).take(all.len()).collect();
    assert_eq!(all, expected, "each once");
}

#[tokio::test(flavor = "multi_thread")]
async fn other_settings_are_tried_on_a_kept_scan_and_change_nothing() {
    let rig = Rig::new().await;
    let (scan, _) = rig.scan_to_result("kept").await;
    let whole: ScanImage = rig.client.get(&path::scan_image(&scan.id)).await;
    let nodes = |columns: &[LiveColumn]| -> usize {
        columns.iter().flat_map(|c| &c.z_um).flatten().count()
    };
    assert_eq!(whole.pitch_mm, 0.5);
    let coarse: Regrid = serde_json::from_str(r#"{"settings":{"regrid.pitch_mm":1.0}}"#).unwrap();
    let coarse: RegridImage = rig.client.post(&path::scan_regrid(&scan.id), &coarse).await;
    assert_eq!(coarse.image.pitch_mm, 1.0);
    assert_eq!(coarse.nodes as usize, nodes(&coarse.image.columns));
    let ratio = nodes(&whole.columns) as f64 / coarse.nodes as f64;
    assert!((3.0..5.0).contains(&ratio), "{ratio}");
    assert!(coarse.noise_mm.unwrap() < 0.01, "a scan without noise");
    let after: Scan = rig.client.get(&path::scan(&scan.id)).await;
    assert_eq!(after.jobs, scan.jobs);
    for (body, kind) in [
        (r#"{"settings":{"regrid.pitch_mm":-1}}"#, "wrong-setting"),
        (r#"{"settings":{"regrid.pitch_mm":0.001}}"#, "no-image"),
        (r#"{"most_nodes":0}"#, "wrong-query"),
        (r#"{"setting":{}}"#, "wrong-body"),
    ] {
        let regrid = path::scan_regrid(&scan.id);
        let refused = rig.client.request("POST", &regrid, Some(body)).await;
        let problem: Problem = refused.problem();
        assert_eq!(problem.kind, kind, "{body}: {problem}");
    }
    let absent = rig
        .client
        .request("GET", &path::scan_image("x"), None)
        .await;
    assert_eq!(absent.problem().kind, "no-such-scan");
}

#[tokio::test(flavor = "multi_thread")]
async fn metrics_count_what_has_happened() {
    let rig = Rig::new().await;
    let text = async || {
        let reply = rig.client.request("GET", path::METRICS, None).await;
        assert_eq!(
            reply.header("content-type"),
            Some("application/openmetrics-text; version=1.0.0; charset=utf-8")
        );
        String::from_utf8(reply.body).unwrap()
    };
    let value = |text: &str, name: &str| -> Option<f64> {
        let line = text
            .lines()
            .find(|line| line.starts_with(&format!("{name} ")))?;
        line[name.len()..].trim().parse().ok()
    };
    let before = text().await;
    assert!(before.ends_with("# EOF\n"), "{before}");
    let columns = "relief_columns_total{scanner=\"scanner\"}";
    assert_eq!(value(&before, columns), None);
    rig.scan_to_result("one").await;
    let after = text().await;
    assert_eq!(value(&after, columns), Some(f64::from(COLUMNS)));
    let shown = "relief_shown_columns_total{scanner=\"scanner\"}";
    assert_eq!(value(&after, shown), Some(f64::from(COLUMNS)));
    let scans = "relief_scans_total{scanner=\"scanner\",state=\"complete\"}";
    assert_eq!(value(&after, scans), Some(1.0));
    assert_eq!(
        value(&after, "relief_jobs_total{state=\"done\"}"),
        Some(1.0)
    );
    let segment = "relief_stage_seconds_count{stage=\"segment\"}";
    assert_eq!(value(&after, segment), Some(1.0));
    assert_eq!(
        value(&after, "relief_laser_on{scanner=\"scanner\"}"),
        Some(0.0)
    );
    let on = "relief_laser_on_time_seconds{scanner=\"scanner\"}";
    assert!(value(&after, on).unwrap() > 0.0, "{after}");
    assert!(value(&after, "relief_kept_bytes{place=\"spool\"}").is_some());
    let version = concat!(
        "relief_build_info{version=\"",
        env!("CARGO_PKG_VERSION"),
        "\"}"
    );
    assert_eq!(value(&after, version), Some(1.0));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stream_goes_on_where_it_was_lost() {
    let rig = Rig::new().await;
    let mut first = rig.client.events().await;
    assert!(matches!(first.next().await, Some(Event::Status(_))));
    let scan: Scan = rig.client.post(path::SCANS, &StartScan::default()).await;
    first.next().await.unwrap();
    let last = first.last_id().to_owned();
    drop(first);
    let mut events = rig.client.events().await;
    ended(&mut events, &scan.id).await;
    let mut resumed = rig.client.events_since(&last).await;
    let over = |event: &Event| match event {
        Event::Scan(own) if own.id == scan.id && own.state.is_over() => Some(()),
        _ => None,
    };
    let (story, ()) = resumed.until(over).await;
    assert!(
        !story.iter().any(|event| matches!(event, Event::Status(_))),
        "nothing was lost, so nothing has to be asked for again"
    );
    let columns = story
        .iter()
        .filter(|event| matches!(event, Event::Column { .. }));
    assert_eq!(columns.count(), COLUMNS as usize);
    // Of another run of the service nothing is known.
    let rig = rig.restart().await;
    for unknown in [last.as_str(), "nonsense"] {
        let mut anew = rig.client.events_since(unknown).await;
        assert!(
            matches!(anew.next().await, Some(Event::Status(_))),
            "{unknown}"
        );
    }
}

/// The kinds of problems that a file of the API names, each behind its status.
fn kinds(source: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for status in ["S::", "StatusCode::"] {
        for rest in source.split(status).skip(1) {
            // `S::CONFLICT, "kind"`, in a row or one below the other.
            let name = rest.trim_start_matches(|c: char| c.is_ascii_uppercase() || c == '_');
            if let Some(text) = name.strip_prefix(',').map(str::trim_start)
                && let Some(literal) = text.strip_prefix('"')
            {
                found.extend(literal.split('"').next().map(str::to_owned));
            }
        }
    }
    found
}

#[test]
fn the_guide_for_integrators_has_every_kind_of_problem() {
    let guide = include_str!("../../../docs/integrators-guide.md");
    let told: BTreeSet<String> = guide
        .lines()
        .filter(|line| line.starts_with("| `"))
        .filter_map(|line| line.split('`').nth(1))
        .map(str::to_owned)
        .collect();
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/http");
    let mut all = BTreeSet::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            all.extend(kinds(&std::fs::read_to_string(path).unwrap()));
        }
    }
    assert!(all.len() > 40, "{all:?}");
    let untold: Vec<&String> = all.difference(&told).collect();
    assert!(untold.is_empty(), "{untold:?}");
}
