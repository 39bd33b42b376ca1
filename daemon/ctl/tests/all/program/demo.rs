//! The demo.

use super::*;

#[test]
fn the_demo_leaves_the_deliverables_and_nothing_else() {
    let directory = tempfile::tempdir().unwrap();
    let temporary = directory.path().join("tmp");
    fs::create_dir(&temporary).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_relief"))
        .current_dir(directory.path())
        .env("TMPDIR", &temporary)
        .args(["demo", "--json", "--object", "cylinder", "--out", "there"])
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["iges"], "there/cylinder.igs");
    assert_eq!(told["scan"]["state"], "complete");
    assert_eq!(told["job"]["state"], "done");
    let model = &told["report"]["model"];
    assert_eq!(model["faces"], 2);
    // None is 0, never the -0 of an empty sum.
    let lengths = model["edge_lengths"].as_object().unwrap();
    assert!(
        lengths
            .values()
            .all(|length| length.as_f64().unwrap().is_sign_positive())
    );
    let mut names: Vec<String> = fs::read_dir(directory.path().join("there"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(
        names,
        [
            "cylinder.igs",
            "cylinder.step",
            "inliers.png",
            "manifest.json",
            "range.png",
            "regions.png",
            "report.html",
            "report.json",
            "report.pdf",
            "residuals.png",
            "view.glb"
        ]
    );
    assert_eq!(fs::read_dir(&temporary).unwrap().count(), 0);
}

#[test]
fn the_demo_tells_at_once_what_it_cannot_do() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    fs::write(at.join("taken"), "mine").unwrap();
    refused(
        &relief(at, &["demo", "--out", "taken"]),
        2,
        "not a directory",
    );
    assert_eq!(fs::read_to_string(at.join("taken")).unwrap(), "mine");
    refused(
        &relief(at, &["demo", "--noise-mm", "-1"]),
        2,
        "between 0 and 100",
    );
    refused(
        &relief(at, &["demo", "--outliers", "-0.1"]),
        2,
        "between 0 and 1",
    );
    refused(
        &relief(at, &["demo", "--dropouts", "1"]),
        2,
        "choose a share below 1",
    );
}
