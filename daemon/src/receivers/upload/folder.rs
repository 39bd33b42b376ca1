//! Copies into a folder, such as a mounted share.

use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Instant;

use deliverables::MANIFEST_NAME;

use super::Way;
use super::parcel::{Parcel, digest};
use crate::config::UploadConfig;

/// Bytes that are copied before the clock is looked at.
const AT_ONCE: usize = 1 << 20;

pub(super) struct Folder {
    folder: PathBuf,
    must_be_mount: bool,
}

impl Folder {
    pub(super) fn new(config: &UploadConfig) -> Self {
        Self {
            folder: config.folder.clone().unwrap_or_default(),
            must_be_mount: config.must_be_mount.unwrap_or_default(),
        }
    }

    /// A share that is not there leaves the folder below its place, on this machine's own disk.
    fn check(&self) -> Result<(), String> {
        let folder = &self.folder;
        let failed = |error: io::Error| format!("{}: {error}: is it mounted?", folder.display());
        let here = fs::metadata(folder).map_err(failed)?;
        if !here.is_dir() {
            return Err(format!("{} is no folder", folder.display()));
        }
        let above = fs::metadata(folder.join("..")).map_err(failed)?;
        if self.must_be_mount && here.dev() == above.dev() {
            return Err(format!(
                "nothing is mounted at {} (must_be_mount)",
                folder.display()
            ));
        }
        Ok(())
    }
}

impl Way for Folder {
    fn send(&self, parcel: &Parcel, until: Instant) -> Result<(), String> {
        self.check()?;
        let place = self.folder.join(&parcel.result);
        let manifest = place.join(MANIFEST_NAME);
        if let (Ok(mut there), Some(own)) = (File::open(&manifest), parcel.files.last()) {
            return match digest(&mut there) {
                // An attempt of before whose end nobody heard of.
                Ok(sha256) if sha256 == own.sha256 => Ok(()),
                _ => Err(format!(
                    "{} is there and is another result",
                    place.display()
                )),
            };
        }
        // Nobody takes it for the result before it is whole.
        let part = self.folder.join(format!(".{}.part", parcel.result));
        let failed = |what: &Path, error: io::Error| format!("{}: {error}", what.display());
        match fs::remove_dir_all(&part) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(failed(&part, error));
            }
            _ => {}
        }
        fs::create_dir(&part).map_err(|error| failed(&part, error))?;
        for piece in &parcel.files {
            let mut from = parcel.open(piece)?;
            let to = part.join(&piece.name);
            let copied = copy(&mut from, &to, until).map_err(|error| failed(&to, error))?;
            if !copied {
                return Err(format!(
                    "{} had not come to its end in timeout_s",
                    to.display()
                ));
            }
        }
        File::open(&part)
            .and_then(|folder| folder.sync_all())
            .and_then(|()| fs::rename(&part, &place))
            .map_err(|error| failed(&place, error))?;
        // Some shares know no syncing of folders.
        let _ = File::open(&self.folder).and_then(|folder| folder.sync_all());
        Ok(())
    }
}

/// Copies to a new file that is then safe on disk. False where there is no time left.
fn copy(from: &mut File, to: &Path, until: Instant) -> io::Result<bool> {
    let mut file = File::create_new(to)?;
    let mut bytes = vec![0; AT_ONCE];
    loop {
        let count = io::Read::read(from, &mut bytes)?;
        if count == 0 {
            file.sync_all()?;
            return Ok(true);
        }
        if Instant::now() >= until {
            return Ok(false);
        }
        file.write_all(&bytes[..count])?;
    }
}
