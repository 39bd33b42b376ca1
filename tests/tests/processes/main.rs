//! Tests in which a process dies, or is measured: one after the other, without a harness.
//!
//! The other process is this program started once more, in a role of its own.

mod crash;
mod memory;
mod role;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use peak_alloc::PeakAlloc;

use role::{SCANNER, SERVICE};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

type Test = (&'static str, fn() -> Result<()>);

const TESTS: [Test; 6] = [
    (
        "crash::what_was_acknowledged_survives_the_death_of_the_service",
        crash::what_was_acknowledged_survives_the_death_of_the_service,
    ),
    (
        "crash::a_part_moved_while_the_service_was_dead_waits_for_a_person",
        crash::a_part_moved_while_the_service_was_dead_waits_for_a_person,
    ),
    (
        "crash::two_scans_survive_the_death_of_the_service",
        crash::two_scans_survive_the_death_of_the_service,
    ),
    (
        "crash::a_job_survives_the_death_of_the_service",
        crash::a_job_survives_the_death_of_the_service,
    ),
    (
        "crash::a_job_that_always_ends_the_service_is_given_up",
        crash::a_job_that_always_ends_the_service_is_given_up,
    ),
    (
        "memory::acquisition_needs_the_same_however_long_the_scan",
        memory::acquisition_needs_the_same_however_long_the_scan,
    ),
];

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments.as_slice() {
        [SCANNER, file, columns] => memory::be_the_scanner(Path::new(file), columns.parse()?),
        [SERVICE, folder, ports @ ..] => {
            let ports: Vec<&Path> = ports.iter().map(Path::new).collect();
            crash::be_the_service(Path::new(folder), &ports)
        }
        // Some runners ask first, and then want one test by its name.
        words if words.contains(&"--list") => {
            for (name, _) in TESTS {
                println!("{name}: test");
            }
            Ok(())
        }
        words => run(words),
    }
}

/// Runs the tests whose names hold one of the words that are no options; all without any.
fn run(words: &[&str]) -> Result<()> {
    let wanted: Vec<&str> = words
        .iter()
        .copied()
        .filter(|word| !word.starts_with('-'))
        .collect();
    let mut failed = 0;
    for (name, test) in TESTS {
        if !wanted.is_empty() && !wanted.iter().any(|word| name.contains(word)) {
            continue;
        }
        let begun = Instant::now();
        let result = test();
        let seconds = begun.elapsed().as_secs_f64();
        match result {
            Ok(()) => println!("test {name} ... ok ({seconds:.1} s)"),
            Err(error) => {
                failed += 1;
                println!("test {name} ... FAILED ({seconds:.1} s)\n{error:?}");
            }
        }
    }
    ensure!(failed == 0, "{failed} tests failed");
    Ok(())
}

/// What a test or a role runs on.
fn runtime() -> Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .context("no runtime")
}
