//! The doctor, and the check of a configuration.

use super::*;

#[test]
fn a_configuration_is_checked_without_a_service() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    fs::write(at.join("good.toml"), "[scanner]\nport = \"/dev/ttyS7\"\n").unwrap();
    let output = relief(at, &["config", "check", "good.toml"]);
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{told}");
    assert_eq!(told, "good.toml: sound\nscanner: /dev/ttyS7\n");

    fs::write(at.join("bad.toml"), "[regrid]\npitch_mm = -1.0\n").unwrap();
    let output = relief(at, &["config", "check", "bad.toml"]);
    refused(&output, 1, "bad.toml, line 2, column");
    let output = relief(at, &["config", "check", "none.toml"]);
    refused(&output, 1, "cannot read the configuration none.toml");
}

#[test]
fn the_doctor_names_every_trouble_and_its_remedy() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let config = format!(
        "[service]\nstate_dir = {:?}\nspool_dir = {:?}\n[scanner]\nport = {:?}\n\
         [nats]\nservers = [\"nats://127.0.0.1:1\"]\n",
        at,
        at.join("no-spool"),
        at.join("no-port")
    );
    fs::write(at.join("reliefd.toml"), config).unwrap();
    let socket = at.join("none.sock");
    let output = relief(
        at,
        &[
            "doctor",
            "--json",
            "--config",
            "reliefd.toml",
            "--socket",
            socket.to_str().unwrap(),
        ],
    );
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(String::from_utf8_lossy(&output.stderr).lines().count(), 1);
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["healthy"], false);
    let graded = |check: &str| {
        let findings = told["findings"].as_array().unwrap();
        let found = findings
            .iter()
            .find(|finding| finding["check"] == check)
            .unwrap();
        assert_eq!(
            found["remedy"].is_null(),
            found["grade"] == "good",
            "{found}"
        );
        found["grade"].as_str().unwrap().to_owned()
    };
    assert_eq!(graded("configuration"), "good");
    assert_ne!(graded("kept scans"), "bad");
    for check in ["scanner port", "spool", "service", "NATS servers"] {
        assert_eq!(graded(check), "bad", "{check}");
    }
}

#[test]
fn the_doctor_looks_for_a_scanner_on_usb() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    // Numbers that no maker has.
    let config = "[scanner]\ntransport = \"usb\"\nvendor_id = 0xffff\nproduct_id = 0xffff\n";
    fs::write(at.join("reliefd.toml"), config).unwrap();
    let arguments = [
        "doctor",
        "--config",
        "reliefd.toml",
        "--socket",
        "none.sock",
    ];
    let output = relief(at, &arguments);
    assert_eq!(output.status.code(), Some(1));
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    for line in [
        concat!("ok        version: ", env!("CARGO_PKG_VERSION")),
        "TROUBLE   scanner on USB: there is no ffff:ffff\n          -> ",
        "doubtful  udev rules: ",
        "ok        serial ports: ",
        "ok        USB scanners: ",
    ] {
        assert!(told.contains(line), "no `{line}` in:\n{told}");
    }
}
