//! Files beside the model, any of which may be left out.

use std::io::{self, Write};
use std::path::Path;

use range_image::Monitor;
use storage::{Disk, remove_file_if_there};

use crate::export::WriteError;
use crate::file::write_synced;
use crate::manifest::ManifestFile;
use crate::write::{DeliverError, is_full};

/// Writes such files. What there is no room for, or what cannot be, is left out with a word about
/// why, and the rest goes on.
pub(crate) struct Extras<'a> {
    pub(crate) disk: &'a dyn Disk,
    pub(crate) directory: &'a Path,
    pub(crate) is_short_of_room: bool,
    pub(crate) monitor: &'a dyn Monitor,
    /// Those that were written.
    pub(crate) files: Vec<ManifestFile>,
    /// What is to be known of them.
    pub(crate) remarks: Vec<String>,
    /// Those that were not, and why.
    pub(crate) left_out: Vec<String>,
}

impl Extras<'_> {
    /// Writes one; false if it was left out.
    pub(crate) fn put(
        &mut self,
        name: &str,
        content: &dyn Fn(&mut dyn Write) -> Result<(), WriteError>,
    ) -> Result<bool, DeliverError> {
        self.monitor.check()?;
        if self.lacks_room_for(name) {
            return Ok(false);
        }
        let put = write_synced::<DeliverError>(self.disk, self.directory, name, |sink| {
            Ok(content(sink)?)
        });
        let remove = || -> io::Result<()> {
            remove_file_if_there(self.disk, &self.directory.join(name))?;
            Ok(())
        };
        match put {
            Ok(file) => {
                self.files.push(file);
                return Ok(true);
            }
            Err(error) if error.is_for_want_of_room() => {
                remove()?;
                self.left_out.push(no_room(name));
            }
            Err(DeliverError::Export(error)) if error.io().is_none() => {
                remove()?;
                self.refuse(name, &error);
            }
            Err(error) => return Err(error),
        }
        Ok(false)
    }

    /// Whether the disk is nearly full, so that this one is left out.
    pub(crate) fn lacks_room_for(&mut self, name: &str) -> bool {
        if self.is_short_of_room {
            self.left_out.push(no_room(name));
        }
        self.is_short_of_room
    }

    /// Leaves one out.
    pub(crate) fn refuse(&mut self, name: &str, why: &dyn std::fmt::Display) {
        self.left_out.push(format!("{name} was left out: {why}"));
    }
}

fn no_room(name: &str) -> String {
    format!(
        "{name} was left out, since the disk is nearly full: make room and run the scan again to \
         have it"
    )
}

impl DeliverError {
    /// Nothing is wrong but that the disk is full.
    pub(crate) fn is_for_want_of_room(&self) -> bool {
        match self {
            Self::Io(error) => is_full(error),
            Self::Export(error) => error.io().is_some_and(is_full),
            _ => false,
        }
    }
}
