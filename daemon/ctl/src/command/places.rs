//! Whether the results will find their places, asked before the work and not after it.

use std::path::{Path, PathBuf};

use rustix::fs::{Access, access};

use super::convert::same_file;
use crate::failure::Failure;

/// A file that is to be written, in a folder that is there.
pub(crate) fn check_file(file: &Path) -> Result<(), Failure> {
    if file.is_dir() {
        return Err(Failure::Usage(format!(
            "{} is a directory; name a file in it",
            file.display()
        )));
    }
    let folder = folder_of(file);
    if !folder.is_dir() {
        return Err(Failure::Usage(format!(
            "cannot write {}: there is no directory {}",
            file.display(),
            folder.display()
        )));
    }
    check_writable(&folder, file)
}

/// Files that are written, each a place where one can be: none is one that is read, or another.
pub(crate) fn check_files(written: &[&Path], read: &[(&str, &Path)]) -> Result<(), Failure> {
    for (k, file) in written.iter().enumerate() {
        check_file(file)?;
        if let Some((what, _)) = read.iter().find(|(_, own)| same_file(own, file)) {
            return Err(Failure::Usage(format!(
                "{} is the {what} itself: it is read, and cannot be written as well; choose another \
                 name",
                file.display()
            )));
        }
        if written[..k].iter().any(|other| same_place(other, file)) {
            return Err(Failure::Usage(format!(
                "{} is named twice; give each output a file of its own",
                file.display()
            )));
        }
    }
    Ok(())
}

/// Whether two names are of one file, which need not be there yet.
fn same_place(a: &Path, b: &Path) -> bool {
    let place = |file: &Path| {
        Some((
            folder_of(file).canonicalize().ok()?,
            file.file_name()?.to_owned(),
        ))
    };
    same_file(a, b) || place(a).zip(place(b)).is_some_and(|(a, b)| a == b)
}

/// A folder for files, which is made if need be.
pub(crate) fn check_directory(directory: &Path) -> Result<(), Failure> {
    let Some(there) = directory
        .ancestors()
        .map(folder_or_here)
        .find(|folder| folder.exists())
    else {
        return Ok(());
    };
    if !there.is_dir() {
        return Err(Failure::Usage(format!(
            "cannot write into {}: {} is not a directory",
            directory.display(),
            there.display()
        )));
    }
    check_writable(&there, directory)
}

fn check_writable(folder: &Path, wanted: &Path) -> Result<(), Failure> {
    access(folder, Access::WRITE_OK | Access::EXEC_OK).map_err(|error| {
        Failure::Failed(format!(
            "cannot write {}: the directory {} is not writable ({error})",
            wanted.display(),
            folder.display()
        ))
    })
}

fn folder_of(file: &Path) -> PathBuf {
    folder_or_here(file.parent().unwrap_or(Path::new("")))
}

/// The empty path means the current directory.
fn folder_or_here(folder: &Path) -> PathBuf {
    if folder.as_os_str().is_empty() {
        PathBuf::from(".")
    } else {
        folder.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_that_cannot_be_written_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let inside = |name: &str| folder.path().join(name);
        std::fs::write(inside("file"), "").unwrap();
        let told = |result: Result<(), Failure>| result.unwrap_err().to_string();
        assert!(check_file(&inside("new.igs")).is_ok());
        assert!(check_file(&inside("file")).is_ok(), "it is replaced");
        assert!(check_file(Path::new("here.igs")).is_ok());
        assert!(told(check_file(folder.path())).contains("is a directory"));
        assert!(told(check_file(&inside("none/new.igs"))).contains("there is no directory"));
        assert!(told(check_file(&inside("file/new.igs"))).contains("there is no directory"));
        assert!(check_directory(&inside("new/deep")).is_ok());
        assert!(check_directory(Path::new("new/deep")).is_ok());
        assert!(told(check_directory(&inside("file"))).contains("file is not a directory"));
        assert!(told(check_directory(&inside("file/deep"))).contains("file is not a directory"));
    }
}
