//! What fuzzers do with everything that comes from outside.
//!
//! Each function takes any bytes and must come to an end: what it asserts, and every panic on
//! the way, is a finding. `fuzz/seeds` holds what fuzzers begin with, `fuzz/finds` what once
//! made a target fail; the tests replay both. `cargo xtask fuzz` runs the fuzzers.

mod files;
mod http;
mod line;

pub use files::{config, iges, journal, laid_out, ply, scan_file, step};
pub use http::{http, reply};
pub use line::{protocol, session};

/// A target.
pub type Target = fn(&[u8]);

/// All targets, by the names of their folders in `seeds` and `finds`.
pub const TARGETS: [(&str, Target); 9] = [
    ("config", config),
    ("http", http),
    ("iges", iges),
    ("journal", journal),
    ("ply", ply),
    ("protocol", protocol),
    ("scan_file", scan_file),
    ("session", session),
    ("step", step),
];
