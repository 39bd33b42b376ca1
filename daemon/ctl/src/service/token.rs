//! The token that the service wants on a loopback address.
//!
//! It comes from a file or the environment, never from the command line, which every user of
//! the machine can read.

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use hyper::header::HeaderValue;

use crate::failure::Failure;

/// Holds the token itself.
const VARIABLE: &str = "RELIEF_TOKEN";
/// A file with more is no file with a token.
const MOST_FILE_BYTES: u64 = 4096;

/// A token, which never gets into messages.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Token(HeaderValue);

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(..)")
    }
}

impl Token {
    fn new(text: &str) -> Option<Self> {
        let text = text.trim();
        let plain = !text.is_empty() && text.bytes().all(|b| b.is_ascii_graphic());
        let mut value = HeaderValue::try_from(format!("Bearer {text}")).ok()?;
        value.set_sensitive(true);
        plain.then_some(Self(value))
    }

    /// Value of the `Authorization` field.
    pub(super) fn header(&self) -> HeaderValue {
        self.0.clone()
    }
}

/// The token in the file, or else that in the environment; none when neither is given.
pub(super) fn find(file: Option<&Path>) -> Result<Option<Token>, Failure> {
    if let Some(path) = file {
        return read(path).map(Some);
    }
    match std::env::var(VARIABLE) {
        Ok(text) => Token::new(&text)
            .ok_or_else(|| Failure::Usage(format!("{VARIABLE} holds no token")))
            .map(Some),
        Err(std::env::VarError::NotPresent) => Ok(None),
        Err(error) => Err(Failure::Usage(format!("{VARIABLE}: {error}"))),
    }
}

fn read(path: &Path) -> Result<Token, Failure> {
    let shown = path.display();
    let failed =
        |error: std::io::Error| Failure::at(format!("cannot read the token in {shown}"), &error);
    let file = File::open(path).map_err(failed)?;
    let mode = file.metadata().map_err(failed)?.permissions().mode();
    if mode & 0o077 != 0 {
        return Err(Failure::Failed(format!(
            "the token in {shown} may be used by others (mode {:04o}): chmod 600 {shown}, and if \
             others could have read it, make another token",
            mode & 0o7777
        )));
    }
    let mut text = String::new();
    file.take(MOST_FILE_BYTES + 1)
        .read_to_string(&mut text)
        .map_err(failed)?;
    Token::new(&text).ok_or_else(|| {
        Failure::Failed(format!(
            "{shown} holds no token: `relief token create NAME --out FILE` makes such a file"
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(folder: &Path, text: &str, mode: u32) -> std::path::PathBuf {
        let path = folder.join("token");
        std::fs::write(&path, text).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
        path
    }

    #[test]
    fn a_token_is_read_from_a_file_that_is_ones_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = file(folder.path(), "relief_abc\n", 0o600);
        let token = find(Some(&path)).unwrap().unwrap();
        assert_eq!(token.header(), "Bearer relief_abc");
        assert!(!format!("{token:?} {:?}", token.header()).contains("abc"));

        for (text, mode, why) in [
            ("relief_abc", 0o644, "(mode 0644): chmod 600"),
            ("relief_abc", 0o660, "(mode 0660): chmod 600"),
            ("", 0o600, "holds no token"),
            ("two words", 0o600, "holds no token"),
            ("a\nb", 0o600, "holds no token"),
        ] {
            let path = file(folder.path(), text, mode);
            let error = find(Some(&path)).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
            assert!(!error.contains("abc"), "{error}");
        }
        let error = find(Some(&folder.path().join("none"))).unwrap_err();
        assert!(error.to_string().contains("cannot read the token in"));
    }
}
