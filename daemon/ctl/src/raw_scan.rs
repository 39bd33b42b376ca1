//! Scans in counts, from journals that are files here or the service's.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use jiff::Timestamp;
use metrology::{RawSample, Scan};
use relief_api::path;
use reliefd::calibration::InForce;
use scan_files::Unpacked;
use scan_record::{EndCause, Ending, JournalReader};

use crate::command::named;
use crate::failure::Failure;
use crate::service::{Client, EndpointArgs};

/// Most samples that are held in memory.
const MOST_SAMPLES: usize = 1 << 25;

/// A scan as the scanner sent it, and who that was.
#[derive(Debug)]
pub(crate) struct RawScan {
    /// What the user called it.
    pub(crate) name: String,
    /// Its samples in counts, with the device's calibration and the correction it was taken with.
    pub(crate) scan: Scan,
    /// Model of the scanner.
    pub(crate) model: String,
    /// Its serial number.
    pub(crate) serial: String,
    /// Its name in the service; empty where it has none.
    pub(crate) scanner: String,
    /// When it was taken, where that is kept.
    pub(crate) started_at: Option<Timestamp>,
    /// The calibration that it was taken with.
    pub(crate) in_force: Option<InForce>,
    /// What is odd about it.
    pub(crate) notes: Vec<String>,
}

impl RawScan {
    /// The scanner in words.
    pub(crate) fn who(&self) -> String {
        format!("{}, serial number {}", self.model, self.serial)
    }
}

/// Reads scans: each a journal's file, or else a scan of the service.
pub(crate) async fn read_all(
    said: &[String],
    endpoint: &EndpointArgs,
) -> Result<Vec<RawScan>, Failure> {
    let mut scans = Vec::new();
    for name in said {
        let path = Path::new(name);
        // A name with a folder or an ending is never that of a scan.
        let is_file = path.exists() || name.contains('/') || name.ends_with(".scan");
        scans.push(if is_file {
            let cannot = |error: std::io::Error| Failure::at(format!("cannot read {name}"), &error);
            if path.is_dir() {
                return Err(Failure::Failed(format!(
                    "{name} is a directory; name a journal (.scan) in it"
                )));
            }
            let file = File::open(path).map_err(cannot)?;
            let unpacked = Unpacked::new(file, name).map_err(|error| Failure::at(name, &error))?;
            read(name, unpacked)?
        } else {
            let bytes = fetched(name, &endpoint.client()?).await?;
            read(name, bytes.as_slice())?
        });
    }
    one_scanner(&scans)?;
    Ok(scans)
}

/// The journal of a scan of the service.
async fn fetched(name: &str, client: &Client) -> Result<Vec<u8>, Failure> {
    let id = named::scan_id(client, name.to_owned()).await?;
    let mut journal = Vec::new();
    client
        .download::<Failure>(&path::scan_journal(&id), |bytes| {
            journal.extend_from_slice(bytes);
            Ok(())
        })
        .await?;
    Ok(journal)
}

fn read(name: &str, source: impl Read) -> Result<RawScan, Failure> {
    let failed = |error: scan_record::ReadError| match error {
        scan_record::ReadError::NotAJournal => Failure::Failed(format!(
            "{name} is no scan journal (.scan): counts are needed, which other files do not keep"
        )),
        other => Failure::at(name, &other),
    };
    let mut journal = JournalReader::new(source).map_err(failed)?;
    let header = journal.header().clone();
    let identity: serde_json::Value = serde_json::from_slice(&header.identity).unwrap_or_default();
    let field = |key: &str| {
        identity
            .get(key)
            .and_then(|v| v.as_str())
            .map(str::to_owned)
    };
    let (Some(model), Some(serial)) = (field("model"), field("serial")) else {
        return Err(Failure::Failed(format!(
            "{name} does not say which scanner took it; take the scan with this service"
        )));
    };
    let kept: Option<relief_api::Scan> = serde_json::from_slice(&header.metadata).ok();
    let mut columns = Vec::new();
    let mut samples = 0;
    while let Some(raw) = journal.next_column().map_err(failed)? {
        // Saturated ones as well, which are those of a bright surface that faces the beam: without
        // them the middle of a sphere would be missing. Strays weigh nothing later on.
        let column: Vec<RawSample> = raw
            .samples
            .iter()
            .map(|sample| RawSample {
                table_counts: raw.table_counts,
                lateral_counts: sample.lateral_counts,
                range_counts: sample.range_counts,
            })
            .collect();
        samples += column.len();
        columns.push(column);
        if samples + columns.len() > MOST_SAMPLES {
            return Err(Failure::Failed(format!(
                "{name} holds more than {MOST_SAMPLES} samples, the most that are read: scan the \
                 reference alone"
            )));
        }
    }
    let mut notes = Vec::new();
    if let Some(ending) = journal.ending()
        && *ending != Ending::Closed(EndCause::Complete)
    {
        notes.push(format!("{name}: the scan is {ending}"));
    }
    Ok(RawScan {
        name: name.to_owned(),
        model,
        serial,
        scanner: kept
            .as_ref()
            .map_or_else(String::new, |scan| scan.scanner.clone()),
        started_at: kept.and_then(|scan| scan.started_at.parse().ok()),
        in_force: InForce::kept_with(&header),
        scan: Scan {
            calibration: header.calibration,
            columns,
        },
        notes,
    })
}

/// Scans of several scanners say nothing of any.
fn one_scanner(scans: &[RawScan]) -> Result<(), Failure> {
    let Some(first) = scans.first() else {
        return Ok(());
    };
    for other in scans {
        if (&other.model, &other.serial) != (&first.model, &first.serial) {
            return Err(Failure::Failed(format!(
                "{} was taken by {}, but {} by {}: give scans of one scanner",
                first.name,
                first.who(),
                other.name,
                other.who()
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_journal_is_refused_by_name() {
        let told = read("cube.stl", &b"solid cube"[..])
            .unwrap_err()
            .to_string();
        assert!(told.starts_with("cube.stl is no scan journal"), "{told}");
    }
}
