//! Files that receivers name: secrets, and certificates.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Read};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;

/// A file with more is no file with a secret.
const MOST_SECRET_BYTES: u64 = 65_536;
/// A file with more is no file of certificates.
const MOST_CA_BYTES: u64 = 1 << 20;

/// A file that a receiver names cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub(crate) struct FileError {
    /// The key that names it.
    pub(super) key: &'static str,
    pub(super) message: String,
}

impl FileError {
    pub(crate) fn new(key: &'static str, message: String) -> Self {
        Self { key, message }
    }

    pub(crate) fn key(&self) -> &'static str {
        self.key
    }
}

/// Reads a secret from a file that is the service's own. `what` says in a word what it is.
pub(crate) fn read_secret(key: &'static str, what: &str, path: &Path) -> Result<String, FileError> {
    let failed = |message: String| FileError { key, message };
    let shown = path.display();
    let refused = |error: io::Error| {
        failed(format!(
            "cannot read the {what} in {shown}: {error}; it must be a file that the user of \
             reliefd may read: install -m 600 -o relief -g relief FILE {shown}"
        ))
    };
    // Before it is opened: a pipe might keep whoever does so.
    let metadata = fs::metadata(path).map_err(refused)?;
    if !metadata.is_file() {
        return Err(failed(format!("{shown} is no file")));
    }
    let mode = metadata.permissions().mode();
    let credentials = std::env::var_os("CREDENTIALS_DIRECTORY");
    if mode & others(path, credentials.as_deref()) != 0 {
        return Err(failed(format!(
            "the {what} in {shown} may be used by others (mode {:04o}): chmod 600 {shown}, and if \
             others could have read it, make another one",
            mode & 0o7777
        )));
    }
    let mut text = String::new();
    File::open(path)
        .and_then(|file| file.take(MOST_SECRET_BYTES).read_to_string(&mut text))
        .map_err(refused)?;
    Ok(text)
}

/// What of a secret's mode lets in others. systemd keeps credentials for one service in a folder that
/// it alone may enter, where the mask of an ACL shows as what the group may do.
fn others(path: &Path, credentials: Option<&OsStr>) -> u32 {
    let is_credential = |folder: &OsStr| !folder.is_empty() && path.starts_with(folder);
    if credentials.is_some_and(is_credential) {
        0o037
    } else {
        0o077
    }
}

/// Reads the password of a `password_file`; the end of its line is no part of it.
pub(super) fn read_password(path: &Path) -> Result<String, FileError> {
    let key = "password_file";
    let text = read_secret(key, "password", path)?;
    let password = text.trim_end_matches(['\r', '\n']);
    if password.is_empty() || password.contains(['\r', '\n', '\0']) {
        return Err(FileError {
            key,
            message: format!(
                "{} holds no password: it is to be the one line of the file",
                path.display()
            ),
        });
    }
    Ok(password.to_owned())
}

/// The certificates of authorities in a file.
pub(crate) fn authorities_in(path: &Path) -> Result<Vec<CertificateDer<'static>>, FileError> {
    certificates_in("ca_file", path)
}

/// The certificates in a file.
pub(crate) fn certificates_in(
    key: &'static str,
    path: &Path,
) -> Result<Vec<CertificateDer<'static>>, FileError> {
    let failed = |message: String| FileError { key, message };
    let shown = path.display();
    let unread =
        |error: io::Error| failed(format!("cannot read the certificates in {shown}: {error}"));
    // Before it is opened: a pipe might keep whoever does so.
    if !fs::metadata(path).map_err(unread)?.is_file() {
        return Err(failed(format!(
            "{shown} is no file: name one with certificates (PEM)"
        )));
    }
    let mut text = Vec::new();
    File::open(path)
        .and_then(|file| file.take(MOST_CA_BYTES).read_to_end(&mut text))
        .map_err(unread)?;
    let found: Vec<CertificateDer<'static>> = CertificateDer::pem_slice_iter(&text)
        .collect::<Result<_, _>>()
        .map_err(|error| failed(format!("{shown} holds no PEM certificates: {error}")))?;
    if found.is_empty() {
        return Err(failed(format!(
            "{shown} holds no PEM certificate (BEGIN CERTIFICATE): name a file with one"
        )));
    }
    Ok(found)
}

/// Those that the machine trusts, as they are now.
pub(super) fn authorities_of_the_machine() -> Vec<CertificateDer<'static>> {
    let found = rustls_native_certs::load_native_certs();
    for error in &found.errors {
        tracing::warn!(%error, "cannot read a certificate of an authority");
    }
    found.certs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_systemd_hands_over_may_show_the_mask_of_an_acl() {
        let of = |path: &str, folder: Option<&str>| others(Path::new(path), folder.map(OsStr::new));
        let folder = "/run/credentials/relief-worker.service";
        let token = "/run/credentials/relief-worker.service/token";
        assert_eq!(of(token, Some(folder)), 0o037);
        for (path, folder) in [
            (token, None),
            (token, Some("")),
            (
                "/run/credentials/relief-worker.service2/token",
                Some(folder),
            ),
            ("/etc/relief/token", Some(folder)),
        ] {
            assert_eq!(of(path, folder), 0o077, "{path} {folder:?}");
        }
    }

    #[test]
    fn files_of_certificates_hold_some() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ca.pem");
        let refused = || authorities_in(&path).map(|found| found.len()).unwrap_err();
        assert!(
            refused()
                .to_string()
                .contains("cannot read the certificates in")
        );
        assert_eq!(refused().key, "ca_file");
        for text in [
            "",
            "nothing",
            "-----BEGIN CERTIFICATE-----\n!\n-----END CERTIFICATE-----\n",
        ] {
            std::fs::write(&path, text).unwrap();
            let error = refused().to_string();
            assert!(error.contains("holds no PEM certificate"), "{error}");
        }
        assert!(
            authorities_in(folder.path())
                .unwrap_err()
                .to_string()
                .contains("is no file")
        );
        let own = rcgen::generate_simple_self_signed(["a.example".to_owned()]).unwrap();
        std::fs::write(&path, own.cert.pem().repeat(2)).unwrap();
        assert_eq!(authorities_in(&path).unwrap().len(), 2);
    }

    #[test]
    fn a_pipe_in_place_of_certificates_keeps_nobody() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ca.pem");
        let (kind, mode) = (rustix::fs::FileType::Fifo, rustix::fs::Mode::RWXU);
        rustix::fs::mknodat(rustix::fs::CWD, &path, kind, mode, 0).unwrap();
        // Whoever did open it would find that it ends, and say so.
        let ends = std::thread::spawn({
            let path = path.clone();
            move || File::options().write(true).open(path).map(drop)
        });
        let error = authorities_in(&path).unwrap_err();
        // Whoever opens both ends waits for nobody, and the other need not wait any more.
        let both = File::options().read(true).write(true).open(&path).unwrap();
        ends.join().unwrap().unwrap();
        drop(both);
        assert!(error.to_string().contains("is no file"), "{error}");
        assert_eq!(error.key, "ca_file");
    }
}
