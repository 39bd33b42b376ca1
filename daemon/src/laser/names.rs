//! Names of the logs.

use std::path::Path;

use relief_api::THE_SCANNER;
use storage::Disk;

use super::Laser;

/// The only scanner's log has had this name before scanners had any.
pub(super) fn file_name(scanner: &str) -> String {
    match scanner {
        THE_SCANNER => "laser.jsonl".to_owned(),
        name => format!("laser-{name}.jsonl"),
    }
}

/// The scanner whose log a file is, if it is one.
fn scanner_of(file_name: &str) -> Option<&str> {
    match file_name {
        "laser.jsonl" => Some(THE_SCANNER),
        other => other.strip_prefix("laser-")?.strip_suffix(".jsonl"),
    }
}

/// Ends the logs of scanners that are configured no more, so that none says for ever that a
/// laser is on.
pub(crate) fn end_other_logs(disk: &dyn Disk, state_dir: &Path, configured: &[&str]) {
    for entry in std::fs::read_dir(state_dir).into_iter().flatten().flatten() {
        let file = entry.file_name();
        let scanner = file.to_str().and_then(scanner_of);
        if let Some(scanner) = scanner.filter(|name| !configured.contains(name))
            && let Err(error) = Laser::open(disk, state_dir, scanner)
        {
            tracing::warn!(scanner, %error, "the log of a laser is left as it is");
        }
    }
}
