//! The program as a user runs it.

#![allow(clippy::panic)] // A test that panics has failed.

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::FileTypeExt;
use std::process::{Child, Command, Stdio};

use rustix::process::{Pid, Signal, kill_process};

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_sim-scanner"))
}

/// Reads what the program says until it serves.
fn wait_until_serving(child: &mut Child) -> String {
    let output = child.stdout.take().expect("piped");
    let mut said = String::new();
    for line in BufReader::new(output).lines() {
        let line = line.expect("text");
        said.push_str(&line);
        said.push('\n');
        if line.starts_with("serving") {
            return said;
        }
    }
    panic!("ended before it served: {said}")
}

#[test]
fn it_serves_until_a_signal_and_takes_its_link_along() {
    let folder = tempfile::tempdir().expect("a folder");
    for signal in [Signal::INT, Signal::TERM] {
        let link = folder.path().join("scanner");
        let mut child = program()
            .args(["--object", "cylinder", "--columns", "60", "--seed", "4"])
            .args(["--line-rate", "50", "--faults", "flip=1e-6,seed=7", "--pty"])
            .arg(&link)
            .stdout(Stdio::piped())
            .spawn()
            .expect("it starts");
        let said = wait_until_serving(&mut child);
        assert!(said.contains("cylinder"), "{said}");
        assert!(said.contains("60 columns"), "{said}");
        let port = fs::metadata(&link).expect("the link leads somewhere");
        assert!(port.file_type().is_char_device());
        let pid = Pid::from_child(&child);
        kill_process(pid, signal).expect("it is there");
        assert!(child.wait().expect("it ends").success());
        assert!(fs::symlink_metadata(&link).is_err(), "the link is gone");
    }
}

#[test]
fn an_stl_file_is_an_object_and_a_scan_file_a_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let stl = folder.path().join("wedge.stl");
    let corners = [[10, 20, 5], [60, 20, 5], [10, 70, 25]];
    let vertices: String = corners
        .iter()
        .map(|[x, y, z]| format!("vertex {x} {y} {z}\n"))
        .collect();
    let text = format!(
        "solid wedge\nfacet normal 0 0 1\nouter loop\n{vertices}endloop\nendfacet\nendsolid wedge\n"
    );
    fs::write(&stl, text).expect("written");
    let points = folder.path().join("points.xyz");
    let lines: String = (0..300)
        .map(|i| format!("{} {} {}\n", i / 20, i % 20, i % 7))
        .collect();
    fs::write(&points, lines).expect("written");
    for (option, file, says) in [
        ("--object", &stl, "240 columns"),
        ("--replay", &points, "300 in 15 columns"),
    ] {
        let mut child = program()
            .arg(option)
            .arg(file)
            .arg("--pty")
            .arg(folder.path().join("scanner"))
            .stdout(Stdio::piped())
            .spawn()
            .expect("it starts");
        let said = wait_until_serving(&mut child);
        kill_process(Pid::from_child(&child), Signal::TERM).expect("it is there");
        assert!(child.wait().expect("it ends").success());
        assert!(said.contains(says), "{said}");
    }
}

#[test]
fn mistakes_are_told_in_one_line_with_the_right_code() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("scanner");
    for (arguments, code, says) in [
        (&["--object", "no-such.stl"][..], 1, "no-such.stl"),
        (&["--replay", "no-such.ply"], 1, "no-such.ply"),
        (&["--outliers", "7"], 1, "between 0 and 1"),
        (&["--columns", "0"], 1, "columns must lie between 1"),
        (&["--faults", "flap=1"], 2, "unknown fault"),
        (&["--colums", "3"], 2, "--columns"),
    ] {
        let output = program()
            .args(arguments)
            .arg("--pty")
            .arg(&link)
            .output()
            .expect("it runs");
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(says), "{arguments:?}: {error}");
        assert!(
            code == 2 || error.trim_end().lines().count() == 1,
            "{error}"
        );
        assert!(fs::symlink_metadata(&link).is_err());
    }
}
