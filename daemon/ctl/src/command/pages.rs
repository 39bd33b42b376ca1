//! Pages that commands leave where the user says.

use std::path::{Path, PathBuf};

use deliverables::{DeliverError, PageFormat, write_atomically};

use super::places;
use crate::failure::Failure;

/// The form that a path's ending means.
fn format_of(path: &Path) -> Option<PageFormat> {
    let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
    match ending.as_str() {
        "html" | "htm" => Some(PageFormat::Html),
        "pdf" => Some(PageFormat::Pdf),
        _ => None,
    }
}

/// Refuses endings of no form and places that cannot be written, before anything is computed.
pub(super) fn check(paths: &[PathBuf]) -> Result<(), Failure> {
    for path in paths {
        if format_of(path).is_none() {
            return Err(Failure::Usage(format!(
                "the ending of {} names no form of a page; known: .html, .pdf",
                path.display()
            )));
        }
        places::check_file(path)?;
    }
    Ok(())
}

/// Writes a page to each of these.
pub(super) fn write(paths: &[PathBuf], page: &deliverables::Page) -> Result<(), Failure> {
    for path in paths {
        let format = format_of(path).unwrap_or(PageFormat::Html);
        write_atomically::<DeliverError>(path, |sink| Ok(sink.write_all(&format.bytes(page)?)?))
            .map_err(|error| Failure::at(format!("cannot write {}", path.display()), &error))?;
    }
    Ok(())
}
