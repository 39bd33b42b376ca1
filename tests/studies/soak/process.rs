//! What the kernel says of a process.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result};

use crate::trend::Sample;

/// What a process takes now.
pub(crate) fn sample(id: u32, at: Duration) -> Result<Sample> {
    let process = Path::new("/proc").join(id.to_string());
    let status = std::fs::read_to_string(process.join("status"))?;
    let number = |name: &str| -> Result<u64> {
        let line = status.lines().find_map(|line| line.strip_prefix(name));
        let word = line.and_then(|line| line.split_whitespace().next());
        Ok(word.with_context(|| format!("no {name}"))?.parse()?)
    };
    Ok(Sample {
        at_s: at.as_secs_f64(),
        memory_bytes: number("VmRSS:")? * 1024,
        threads: number("Threads:")?,
        descriptors: std::fs::read_dir(process.join("fd"))?.count() as u64,
    })
}
