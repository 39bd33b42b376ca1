//! A record as it is kept: JSON in an envelope that tells its version.

use std::path::Path;

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::error::StoreError;

/// The version that is written, and the newest that is read.
pub(super) const VERSION: u32 = 1;

#[derive(Serialize)]
struct Outgoing<'a, T> {
    version: u32,
    record: &'a T,
}

#[derive(Deserialize)]
struct Incoming<T> {
    record: T,
}

#[derive(Deserialize)]
struct Version {
    version: u32,
}

pub(super) fn encode<T: Serialize>(record: &T) -> Vec<u8> {
    // Scans and jobs are put into JSON whatever they hold.
    serde_json::to_vec(&Outgoing {
        version: VERSION,
        record,
    })
    .unwrap_or_default()
}

/// `path` is for the messages.
pub(super) fn decode<T: DeserializeOwned>(path: &Path, bytes: &[u8]) -> Result<T, StoreError> {
    let unusable = |error: serde_json::Error| StoreError::Unusable {
        path: path.to_owned(),
        message: format!("a record cannot be read: {error}"),
    };
    let Version { version } = serde_json::from_slice(bytes).map_err(unusable)?;
    if version > VERSION {
        return Err(StoreError::Newer {
            path: path.to_owned(),
            found: version,
        });
    }
    let incoming: Incoming<T> = serde_json::from_slice(bytes).map_err(unusable)?;
    Ok(incoming.record)
}
