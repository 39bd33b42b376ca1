//! Copies into a bucket of an object store that speaks S3.

use std::io::Read;
use std::time::{Duration, Instant};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use rusty_s3::{Bucket, Credentials, S3Action, UrlStyle};
use ureq::{Agent, Body};

use super::super::FileError;
use super::super::agent::agent;
use super::super::files::read_secret;
use super::super::words::{of_io, printable};
use super::Way;
use super::parcel::{Parcel, Piece};
use crate::config::UploadConfig;

const REGION: &str = "us-east-1";
/// For how long a signature holds: clocks may differ by as much.
const SIGNED_FOR: Duration = Duration::from_secs(15 * 60);
/// Bytes of a refusal that are looked at.
const MOST_ANSWER_BYTES: u64 = 2_048;
const CHECKSUM: &str = "x-amz-checksum-sha256";

pub(super) struct Store {
    agent: Agent,
    bucket: Bucket,
    credentials: Credentials,
    prefix: String,
    host: String,
}

/// The id and the secret of a key.
fn read_key(config: &UploadConfig) -> Result<Credentials, FileError> {
    const KEY: &str = "key_file";
    let path = config.key_file.clone().unwrap_or_default();
    let text = read_secret(KEY, "key", &path)?;
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    match lines.as_slice() {
        [id, secret] if !id.is_empty() && !secret.is_empty() => Ok(Credentials::new(*id, *secret)),
        _ => Err(FileError::new(
            KEY,
            format!(
                "{} is to hold two lines: the id of the key, and its secret",
                path.display()
            ),
        )),
    }
}

impl Store {
    pub(super) fn new(config: &UploadConfig) -> Result<Self, FileError> {
        let credentials = read_key(config)?;
        let endpoint = config.endpoint.clone().unwrap_or_default();
        let agent = agent(&endpoint, config.ca_file.as_deref(), config.timeout())?;
        let failed = |error: &dyn std::fmt::Display| FileError::new("endpoint", error.to_string());
        let url = endpoint.parse().map_err(|error| failed(&error))?;
        let region = config.region.clone().unwrap_or_else(|| REGION.into());
        let name = config.bucket.clone().unwrap_or_default();
        let bucket = Bucket::new(url, UrlStyle::Path, name, region).map_err(|e| failed(&e))?;
        let host = bucket.object_url("").authority().to_owned();
        Ok(Self {
            agent,
            bucket,
            credentials,
            prefix: config.prefix.clone().unwrap_or_default(),
            host,
        })
    }

    fn put(&self, parcel: &Parcel, piece: &Piece, until: Instant) -> Result<(), String> {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err("there was no time left (timeout_s)".to_owned());
        }
        let file = parcel.open(piece)?;
        let bytes = file.metadata().map_err(|error| error.to_string())?.len();
        let object = format!("{}{}/{}", self.prefix, parcel.result, piece.name);
        // The store takes nothing that is not what the manifest says.
        let checksum = STANDARD.encode(piece.sha256);
        let mut action = self.bucket.put_object(Some(&self.credentials), &object);
        action.headers_mut().insert(CHECKSUM, checksum.as_str());
        let url = action.sign(SIGNED_FOR);
        let sent = self
            .agent
            .put(url.as_str())
            .config()
            .timeout_global(Some(left))
            .build()
            .header(CHECKSUM, &checksum)
            .header("content-length", bytes)
            .send(file);
        // Errors are told without the address, which is signed.
        let mut answer = sent.map_err(|error| match error {
            ureq::Error::Io(error) => of_io(&error, &self.host),
            ureq::Error::Timeout(_) => format!("{} was too slow (timeout_s)", self.host),
            error => format!("{}: {error}", self.host),
        })?;
        let status = answer.status().as_u16();
        if (200..300).contains(&status) {
            return Ok(());
        }
        let what = match status {
            403 => "does not let the service in: see to key_file, and to this machine's clock",
            404 => "has no such bucket",
            301 | 307 => "has the bucket in another region: see to endpoint and region",
            _ => "refuses the file",
        };
        Err(format!(
            "{} {what} ({status}): {}",
            self.host,
            beginning(answer.body_mut())
        ))
    }
}

/// The first words of an answer.
fn beginning(body: &mut Body) -> String {
    let mut bytes = Vec::new();
    // What came before an error is kept.
    let _ = body
        .as_reader()
        .take(MOST_ANSWER_BYTES)
        .read_to_end(&mut bytes);
    printable(&bytes)
}

impl Way for Store {
    fn send(&self, parcel: &Parcel, until: Instant) -> Result<(), String> {
        let mut pieces = parcel.files.iter();
        pieces.try_for_each(|piece| self.put(parcel, piece, until))
    }
}
