//! `relief features train`: networks with the user's own classes, and bad patterns.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

use crate::common;

use std::fs;
use std::path::Path;
use std::process::Output;

use common::relief;
use common::schema::check;
use features::code::{Attributes, Digit, Form, Sense};
use features::network::{Classifier, PUBLISHED};
use serde_json::Value;

const PATTERNS: &str = r#"
[[pattern]]
class = "rib"
code = [2, 1, 2, 3, 4, 5, 4]
sense = "convex"
form = "open"

[[pattern]]
class = "v-groove"
section = [[0, 0], [8, 0], [16, -8], [24, 0], [32, 0]]
sense = "concave"
form = "open"
"#;

fn train(folder: &Path, more: &[&str]) -> Output {
    let small = ["features", "train", "--per-class", "120", "--epochs", "80"];
    relief(folder, &[&small[..], more].concat())
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn attributes(code: &[u8], sense: Sense, form: Form) -> Attributes {
    let code = code.iter().filter_map(|&own| Digit::of(own)).collect();
    Attributes { code, sense, form }
}

#[test]
fn patterns_of_a_user_become_classes() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("mine.toml"), PATTERNS).unwrap();
    let output = train(
        folder.path(),
        &["--json", "--patterns", "mine.toml", "-o", "n.toml"],
    );
    assert!(output.status.success(), "{}", stderr(&output));
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    check("commands.schema.json#/$defs/features_train", &told);
    let names: Vec<&str> = (told["classes"].as_array().unwrap().iter())
        .filter_map(Value::as_str)
        .collect();
    assert_eq!(names[8..], ["rib", "v-groove"]);
    let errors = told["errors"].as_array().unwrap();
    let error = |own: &Value| own["error"].as_f64().unwrap();
    assert!(error(&errors[0]) > 4.0 * error(&errors[errors.len() - 1]));
    let rows = told["judged"]["confusion"].as_array().unwrap();
    assert!(rows.len() == 10 && rows[0].as_array().unwrap().len() == 11);
    // What was new to the network before is known to this one, and all else still is.
    let text = fs::read_to_string(folder.path().join("n.toml")).unwrap();
    let network = Classifier::read(&text).unwrap();
    for (code, sense, form, class) in [
        (&[2, 1, 2, 3, 4, 5, 4][..], Sense::Convex, Form::Open, "rib"),
        (&[4, 4, 4, 2, 2, 2], Sense::Concave, Form::Open, "v-groove"),
        (&[4, 5, 4, 3, 2, 1, 2], Sense::Concave, Form::Open, "slot"),
        (
            &[4, 5, 4, 3, 2, 1, 2],
            Sense::Concave,
            Form::Circular,
            "hole",
        ),
    ] {
        let own = attributes(code, sense, form);
        assert_eq!(network.classify(&own).known(), Some(class));
    }
    let rib = attributes(&[2, 1, 2, 3, 4, 5, 4], Sense::Convex, Form::Open);
    assert!(Classifier::shipped().classify(&rib).is_unknown());
}

#[test]
fn the_same_command_makes_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for name in ["a.toml", "b.toml"] {
        assert!(train(folder.path(), &["-o", name]).status.success());
    }
    assert_eq!(
        fs::read(at("a.toml")).unwrap(),
        fs::read(at("b.toml")).unwrap()
    );
    let other = train(folder.path(), &["-o", "c.toml", "--seed", "2"]);
    assert!(other.status.success());
    assert_ne!(
        fs::read(at("a.toml")).unwrap(),
        fs::read(at("c.toml")).unwrap()
    );
    let shape = ["--digits", "7", "--hidden", "9", "--json"];
    let output = train(folder.path(), &shape);
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["neurons"], serde_json::json!([9, 9, 8]));
    assert!(at("network.toml").exists());
}

#[test]
fn the_published_network_is_made_as_it_is_built_in() {
    let folder = tempfile::tempdir().unwrap();
    let output = relief(
        folder.path(),
        &["features", "train", "--published", "-o", "p.toml"],
    );
    assert!(output.status.success(), "{}", stderr(&output));
    let text = fs::read_to_string(folder.path().join("p.toml")).unwrap();
    assert!(text == PUBLISHED);
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    for words in [
        "EPOCH",
        "IS \\ CALLED",
        "9-15-6",
        "below the tolerance",
        "written to",
    ] {
        assert!(table.contains(words), "{words}: {table}");
    }
}

#[test]
fn bad_patterns_are_told_with_file_and_line() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |text: &str, words: &[&str]| {
        fs::write(folder.path().join("bad.toml"), text).unwrap();
        let output = train(folder.path(), &["--patterns", "bad.toml"]);
        let told = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{told}");
        let line = told.lines().find(|line| line.starts_with("relief: "));
        let line = line.unwrap_or_else(|| panic!("{told}"));
        for word in words {
            assert!(line.contains(word), "{word}: {told}");
        }
        assert!(!folder.path().join("network.toml").exists());
    };
    let with = |from: &str, to: &str| {
        assert!(PATTERNS.contains(from), "{from}");
        PATTERNS.replacen(from, to, 1)
    };
    refused("", &["bad.toml:1:", "[[pattern]]"]);
    refused("[[pattern", &["bad.toml:1:"]);
    refused(
        &with("3, 4, 5", "3, 4, 6"),
        &["bad.toml:2:", "6 is no direction"],
    );
    refused(&with("\"convex\"", "\"proud\""), &["bad.toml:5:", "proud"]);
    refused(
        &with("class = \"v", "klass = \"v"),
        &["bad.toml:9:", "klass"],
    );
    refused(
        &with("\"v-groove\"", "\"v groove\""),
        &["bad.toml:8:", "v groove"],
    );
    refused(
        &with("\"v-groove\"", "\"unknown\""),
        &["bad.toml:8:", "unknown"],
    );
    refused(
        &with("[16, -8]", "[4, -8]"),
        &["bad.toml:8:", "not go back"],
    );
    refused(
        &with("[16, -8]", "[16, nan]"),
        &["bad.toml:8:", "two points"],
    );
    refused(&with("[16, -8]", "[16, 0]"), &["bad.toml:8:", "no wall"]);
    refused(
        &with("section", "code = [3]\nsection"),
        &["bad.toml:8:", "not both"],
    );
    refused(
        &with("[32, 0]]", "[32, 0]]\npitch_mm = 0"),
        &["bad.toml:8:", "pitch_mm 0"],
    );
    // What looks like a slot cannot be told from one.
    let slot = "[[pattern]]\nclass = \"keyway\"\ncode = [4,5,4,3,2,1,2]\nsense = \"concave\"\nform = \"open\"\n";
    refused(slot, &["keyway", "line 1", "slot", "4543212"]);
}

#[test]
fn bad_options_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (more, words) in [
        (&["--digits", "2"][..], "digits 2"),
        (&["--hidden", "0"], "hidden neurons 0"),
        (&["--epochs", "0"], "epochs 0"),
        (&["--published", "--digits", "9"], "--published"),
        (&["-o", "n.igs"], ".toml"),
        (&["-o", "none/n.toml"], "none"),
        (&["--seed", "18446744073709551615"], "seed"),
    ] {
        let output = relief(folder.path(), &[&["features", "train"], more].concat());
        assert_eq!(output.status.code(), Some(2), "{more:?}");
        assert!(stderr(&output).contains(words), "{}", stderr(&output));
    }
    let output = train(folder.path(), &["--patterns", "none.toml"]);
    assert!(stderr(&output).contains("cannot read none.toml"));
    fs::write(folder.path().join("mine.toml"), PATTERNS).unwrap();
    let onto = train(
        folder.path(),
        &["--patterns", "mine.toml", "-o", "mine.toml"],
    );
    assert_eq!(onto.status.code(), Some(2));
    assert_eq!(
        fs::read_to_string(folder.path().join("mine.toml")).unwrap(),
        PATTERNS
    );
}
