//! Shared by the tests.
#![allow(dead_code)] // each test file uses its own part

use std::io::Write;
use std::path::PathBuf;

use scan_files::{PointScan, ReadOptions, ScanFileError, read_from};

pub(crate) fn read_text(text: &str) -> Result<PointScan, ScanFileError> {
    read_from(text.as_bytes(), "test.xyz", &ReadOptions::default())
}

pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).expect("a Vec takes any bytes");
    encoder.finish().expect("a Vec takes any bytes")
}

/// The lines in another order, by a linear congruence keyed by the seed.
pub(crate) fn shuffled(lines: &[String], seed: u64) -> Vec<String> {
    let mut keyed: Vec<(u64, &String)> = lines
        .iter()
        .enumerate()
        .map(|(k, line)| {
            let key = (k as u64 + seed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            (
                (key ^ (key >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9),
                line,
            )
        })
        .collect();
    keyed.sort();
    keyed.into_iter().map(|(_, line)| line.clone()).collect()
}

/// A file of the shared collection of real scans, if this machine has it.
pub(crate) fn real(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data")
        .join(name);
    if path.exists() {
        Some(path)
    } else {
        println!("skipped: {name} is not on this machine");
        None
    }
}
