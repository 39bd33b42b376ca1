//! What can be wrong with the records.

use std::io;
use std::path::{Path, PathBuf};

use super::record::VERSION;

/// The records cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// Another process has them.
    #[error(
        "{} is in use by another reliefd: stop that one, or give this one another state_dir",
        path.display()
    )]
    Locked {
        /// The file.
        path: PathBuf,
    },
    /// The service has ended.
    #[error("the records in {} are closed, since the service ends", path.display())]
    Closed {
        /// The file.
        path: PathBuf,
    },
    /// The file is damaged, or the disk refuses.
    #[error("cannot use the records in {}: {message}", path.display())]
    Unusable {
        /// The file.
        path: PathBuf,
        /// What the store says.
        message: String,
    },
    /// Written by a newer service.
    #[error(
        "{} holds a record of version {found}, this service knows up to {VERSION}: \
         use a newer reliefd",
        path.display()
    )]
    Newer {
        /// The file.
        path: PathBuf,
        /// Version of the record.
        found: u32,
    },
}

impl StoreError {
    pub(super) fn of(path: &Path, error: &redb::Error) -> Self {
        let path = path.to_owned();
        match error {
            redb::Error::DatabaseAlreadyOpen => Self::Locked { path },
            other => Self::Unusable {
                path,
                message: other.to_string(),
            },
        }
    }
}

/// True for what may be mended without this service: a disk that is full, read-only, away.
/// redb goes on only after the file was opened anew.
pub(super) fn is_trouble_of_the_disk(error: &redb::Error) -> bool {
    matches!(
        error,
        redb::Error::Io(_) | redb::Error::PreviousIo | redb::Error::DatabaseClosed
    )
}

/// True for what opening the file anew does not mend.
pub(super) fn is_damage(error: &redb::Error) -> bool {
    match error {
        redb::Error::Corrupted(_)
        | redb::Error::UpgradeRequired(_)
        | redb::Error::RepairAborted
        | redb::Error::TableTypeMismatch { .. }
        | redb::Error::TypeDefinitionChanged { .. } => true,
        redb::Error::Io(error) => matches!(
            error.kind(),
            io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof
        ),
        _ => false,
    }
}
