//! What the service leaves behind: results and journals.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result};
use hyper::body::Bytes;
use relief_api::{SpoolEntry, path};
use scan_record::{JournalReader, RawColumn};
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::Client;

/// The files of a result, fetched over the API.
#[derive(Debug, Clone, PartialEq)]
pub struct Published {
    /// Where the service says that the folder is.
    pub directory: String,
    /// Content by name.
    pub files: BTreeMap<String, Bytes>,
}

impl Published {
    pub(super) async fn fetch(client: &Client, result: &str) -> Result<Self> {
        let entry: SpoolEntry = client.get(&path::spool(result)).await?;
        let mut files = BTreeMap::new();
        for file in entry.files {
            let bytes = client
                .download(&path::spool_file(result, &file.name))
                .await?;
            anyhow::ensure!(bytes.len() as u64 == file.bytes, "{} is cut", file.name);
            files.insert(file.name, bytes);
        }
        Ok(Self {
            directory: entry.directory,
            files,
        })
    }

    /// A file.
    ///
    /// # Errors
    /// When there is none of this name.
    pub fn file(&self, name: &str) -> Result<&Bytes> {
        let names = || format!("no {name} among {:?}", self.files.keys());
        self.files.get(name).with_context(names)
    }

    /// The CAD file.
    ///
    /// # Errors
    /// When there is none.
    pub fn iges(&self) -> Result<&Bytes> {
        let name = self.files.keys().find(|name| name.ends_with(".igs"));
        self.file(name.map_or("*.igs", String::as_str))
    }

    /// A document.
    ///
    /// # Errors
    /// When there is none of this name, or it is no JSON.
    pub fn json(&self, name: &str) -> Result<Value> {
        Ok(serde_json::from_slice(self.file(name)?)?)
    }

    /// SHA-256 of a file as 64 lower-case hexadecimal digits.
    ///
    /// # Errors
    /// When there is none of this name.
    pub fn sha256(&self, name: &str) -> Result<String> {
        let mut text = String::new();
        for byte in Sha256::digest(self.file(name)?) {
            write!(text, "{byte:02x}")?;
        }
        Ok(text)
    }
}

/// All columns of a journal.
///
/// # Errors
/// When it cannot be read.
pub fn journal_columns(path: &Path) -> Result<Vec<RawColumn>> {
    let mut journal = JournalReader::open(path)?;
    let mut columns = Vec::new();
    while let Some(column) = journal.next_column()? {
        columns.push(column);
    }
    Ok(columns)
}
