//! Shared by the tests.
#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "each test file uses its own part, and says where it cannot go on"
)]

pub(crate) mod schema;

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};

/// The program, without what the caller's environment may say to it.
pub(crate) fn relief(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relief"))
        .current_dir(directory)
        .env_remove("SOURCE_DATE_EPOCH")
        .env_remove("RELIEF_SOCKET")
        .env_remove("RELIEF_TOKEN")
        .env_remove("RELIEF_TOKEN_FILE")
        .args(arguments)
        .output()
        .expect("the program starts")
}

/// Points of a roof of two planes, 24 mm square.
pub(crate) fn roof() -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for i in -24..=24 {
        for j in -24..=24 {
            let (x, y) = (f64::from(i) * 0.5, f64::from(j) * 0.5);
            points.push([x, y, 20.0 - 0.6 * x.abs() + 0.1 * y]);
        }
    }
    points
}

pub(crate) fn text(points: &[[f64; 3]]) -> String {
    points.iter().fold(String::new(), |mut text, [x, y, z]| {
        writeln!(text, "{x} {y} {z}").expect("text takes it");
        text
    })
}
