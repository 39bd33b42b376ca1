//! Rows of the table.

use core::fmt;

use serde::Serialize;

/// One stage at one size.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Row {
    pub(crate) stage: &'static str,
    pub(crate) size: String,
    /// What the time is told for: a node, a sample.
    pub(crate) unit: &'static str,
    /// Nanoseconds for each.
    pub(crate) ns: f64,
    /// Nanoseconds below which no way of doing it is known, where they have been counted.
    pub(crate) floor_ns: Option<f64>,
    /// A peer, and how many times our time it took in the same run.
    pub(crate) peer: Option<(&'static str, f64)>,
}

pub(crate) const HEAD: &str = "\
| stage | size | time | floor, of it | peer | times ours |
|---|---|---:|---:|---|---:|";

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            stage,
            size,
            unit,
            ns,
            floor_ns,
            peer,
        } = self;
        write!(f, "| {stage} | {size} | {ns:.0} ns a {unit} |")?;
        match floor_ns {
            Some(floor_ns) => write!(f, " {:.0} % |", 100.0 * floor_ns / ns)?,
            None => write!(f, " |")?,
        }
        match peer {
            Some((name, times)) => write!(f, " {name} | {times:.1} |"),
            None => write!(f, " | |"),
        }
    }
}
