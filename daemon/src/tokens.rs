//! Tokens, by which requests on a loopback address are known.
//!
//! A token is 32 random bytes. What is kept of it is its SHA-256, in a file that the
//! service's user alone may read: as nobody can guess 32 random bytes, a slower hash would
//! protect nothing more.

use std::fs::{self, File, Permissions};
use std::io::{self, Read};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use deliverables::hexadecimal;
use relief_api::{MAX_TOKEN_NAME_CHARS, NewToken, Token};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use storage::{Disk, remove_file_if_there};
use subtle::ConstantTimeEq;

use crate::ids::now;
use crate::service::lock;

/// Begins every token, so that one that has got about is recognised.
const PREFIX: &str = "relief_";
const SECRET_BYTES: usize = 32;
/// More tokens than this are a mistake of some program.
const MOST_TOKENS: usize = 100;
/// A larger file is not ours: a hundred tokens take a fifth of that.
const MOST_FILE_BYTES: u64 = 128 * 1024;
const VERSION: u32 = 1;
/// Readable and writable for the service's user only.
const FILE_MODE: u32 = 0o600;

/// Something about the tokens does not work.
#[derive(Debug, thiserror::Error)]
pub enum TokenError {
    /// The file cannot be read or written.
    #[error("cannot {action} the tokens {}: {source}; see to the folder service.state_dir", path.display())]
    File {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file is not as we write it.
    #[error(
        "the tokens {} are damaged: {why}; move the file away and make new tokens \
         (`relief token create`)",
        path.display()
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// The name would not do.
    #[error(
        "`{name}` is no name for a token: 1 to {} letters, digits, `.`, `_` or `-` are",
        MAX_TOKEN_NAME_CHARS
    )]
    Name {
        /// As it was given.
        name: String,
    },
    /// There is one of that name.
    #[error("there is a token {name} already")]
    Taken {
        /// The name.
        name: String,
    },
    /// There is none of that name.
    #[error("there is no token {name}")]
    NoSuch {
        /// The name.
        name: String,
    },
    /// There are too many.
    #[error("there are {MOST_TOKENS} tokens, and no more are possible")]
    TooMany,
    /// The system gives no random bytes.
    #[error("the system gives no random bytes: {0}")]
    Random(getrandom::Error),
}

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct KeptToken {
    name: String,
    created_at: String,
    sha256: String,
}

impl KeptToken {
    fn shown(&self) -> Token {
        Token {
            name: self.name.clone(),
            created_at: self.created_at.clone(),
        }
    }
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Contents {
    version: u32,
    tokens: Vec<KeptToken>,
}

/// The tokens that hold.
#[derive(Debug)]
pub(crate) struct Tokens {
    disk: Arc<dyn Disk>,
    path: PathBuf,
    /// Held only for moments: each request on a loopback address waits for it.
    kept: Mutex<Vec<KeptToken>>,
    /// Held while the tokens change, until that is on disk.
    changing: Mutex<()>,
}

impl Tokens {
    /// Reads the tokens; where there is no file there are none.
    pub(crate) fn open(disk: Arc<dyn Disk>, path: &Path) -> Result<Self, TokenError> {
        Ok(Self {
            disk,
            kept: Mutex::new(read(path)?),
            path: path.to_owned(),
            changing: Mutex::default(),
        })
    }

    /// The tokens, oldest first.
    pub(crate) fn list(&self) -> Vec<Token> {
        lock(&self.kept).iter().map(KeptToken::shown).collect()
    }

    /// Makes a token, which is on disk when this returns.
    pub(crate) fn create(&self, name: &str) -> Result<NewToken, TokenError> {
        if !is_name(name) {
            return Err(TokenError::Name {
                name: name.chars().take(MAX_TOKEN_NAME_CHARS).collect(),
            });
        }
        let _order = lock(&self.changing);
        let mut tokens = lock(&self.kept).clone();
        if tokens.iter().any(|token| token.name == name) {
            return Err(TokenError::Taken { name: name.into() });
        }
        if tokens.len() >= MOST_TOKENS {
            return Err(TokenError::TooMany);
        }
        let mut secret = [0; SECRET_BYTES];
        getrandom::fill(&mut secret).map_err(TokenError::Random)?;
        let token = format!("{PREFIX}{}", hexadecimal(&secret));
        let new = KeptToken {
            name: name.to_owned(),
            created_at: now(),
            sha256: hash(&token),
        };
        tokens.push(new.clone());
        self.write(&tokens)?;
        *lock(&self.kept) = tokens;
        Ok(NewToken {
            name: new.name,
            created_at: new.created_at,
            token,
        })
    }

    /// Takes a token back: it is refused from now on, and after a restart.
    pub(crate) fn revoke(&self, name: &str) -> Result<Token, TokenError> {
        let _order = lock(&self.changing);
        let mut tokens = lock(&self.kept).clone();
        let Some(index) = tokens.iter().position(|token| token.name == name) else {
            return Err(TokenError::NoSuch { name: name.into() });
        };
        let revoked = tokens.remove(index);
        self.write(&tokens)?;
        *lock(&self.kept) = tokens;
        Ok(revoked.shown())
    }

    /// Who bears this token, if it holds.
    pub(crate) fn bearer(&self, token: &str) -> Option<String> {
        let hash = hash(token);
        let kept = lock(&self.kept);
        let found = kept
            .iter()
            .find(|kept| bool::from(kept.sha256.as_bytes().ct_eq(hash.as_bytes())))?;
        Some(found.name.clone())
    }

    fn write(&self, tokens: &[KeptToken]) -> Result<(), TokenError> {
        let contents = Contents {
            version: VERSION,
            tokens: tokens.to_vec(),
        };
        let failed = |source| TokenError::File {
            action: "keep",
            path: self.path.clone(),
            source,
        };
        let text = serde_json::to_vec_pretty(&contents)
            .map_err(|error| failed(io::Error::other(error)))?;
        replace(&*self.disk, &self.path, &text).map_err(failed)
    }
}

fn read(path: &Path) -> Result<Vec<KeptToken>, TokenError> {
    let failed = |source| TokenError::File {
        action: "read",
        path: path.to_owned(),
        source,
    };
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(failed(error)),
    };
    let mut text = Vec::new();
    file.take(MOST_FILE_BYTES + 1)
        .read_to_end(&mut text)
        .map_err(failed)?;
    let damaged = |why: String| TokenError::Damaged {
        path: path.to_owned(),
        why,
    };
    if text.len() as u64 > MOST_FILE_BYTES {
        return Err(damaged(format!("more than {MOST_FILE_BYTES} bytes")));
    }
    let contents: Contents =
        serde_json::from_slice(&text).map_err(|error| damaged(error.to_string()))?;
    if contents.version != VERSION {
        return Err(damaged(format!(
            "they are of version {}, and this program knows version {VERSION}",
            contents.version
        )));
    }
    Ok(contents.tokens)
}

/// Puts new contents in a file's place: whole, or not at all.
fn replace(disk: &dyn Disk, path: &Path, text: &[u8]) -> io::Result<()> {
    let beside = path.with_extension("json.new");
    remove_file_if_there(disk, &beside)?;
    let file = disk.create(&beside)?;
    // Before there is anything in it.
    fs::set_permissions(&beside, Permissions::from_mode(FILE_MODE))?;
    file.write_at(text, 0)?;
    file.sync_data()?;
    disk.rename(&beside, path)?;
    path.parent().map_or(Ok(()), |folder| disk.sync_dir(folder))
}

fn is_name(name: &str) -> bool {
    (1..=MAX_TOKEN_NAME_CHARS).contains(&name.len())
        && name
            .bytes()
            .all(|b| b.is_ascii_alphanumeric() || b"._-".contains(&b))
}

fn hash(token: &str) -> String {
    hexadecimal(&Sha256::digest(token.as_bytes()))
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use storage::LocalDisk;

    use super::*;

    fn open(path: &Path) -> Result<Tokens, TokenError> {
        Tokens::open(Arc::new(LocalDisk), path)
    }

    #[test]
    fn tokens_hold_until_revoked_and_survive_a_restart() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens.json");
        let tokens = open(&path).unwrap();
        assert!(!path.exists(), "nothing is written before there is a token");
        let desk = tokens.create("desk").unwrap();
        let robot = tokens.create("robot").unwrap();
        assert_ne!(desk.token, robot.token);
        assert_eq!(desk.token.len(), PREFIX.len() + 64);

        let tokens = open(&path).unwrap();
        assert_eq!(tokens.bearer(&desk.token).as_deref(), Some("desk"));
        assert_eq!(tokens.bearer(&robot.token).as_deref(), Some("robot"));
        let longer = format!("{}0", desk.token);
        for other in ["", "relief_", &desk.token[1..], &longer, &hash(&desk.token)] {
            assert_eq!(tokens.bearer(other), None, "{other}");
        }
        assert_eq!(tokens.revoke("desk").unwrap().name, "desk");
        assert_eq!(tokens.bearer(&desk.token), None);
        let tokens = open(&path).unwrap();
        assert_eq!(tokens.bearer(&desk.token), None);
        let names: Vec<String> = tokens.list().into_iter().map(|t| t.name).collect();
        assert_eq!(names, ["robot"]);
    }

    #[test]
    fn what_lies_on_disk_is_no_token_and_for_the_service_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens.json");
        let token = open(&path).unwrap().create("desk").unwrap().token;
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(!text.contains(&token[PREFIX.len()..]), "{text}");
        let mode = std::fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
    }

    #[test]
    fn names_are_plain_and_given_once() {
        let folder = tempfile::tempdir().unwrap();
        let tokens = open(&folder.path().join("tokens.json")).unwrap();
        tokens.create("A.b_c-9").unwrap();
        let twice = tokens.create("A.b_c-9").unwrap_err();
        assert_eq!(twice.to_string(), "there is a token A.b_c-9 already");
        let long = "x".repeat(MAX_TOKEN_NAME_CHARS + 1);
        for name in ["", "a b", "../a", "a\n", "\u{e4}", &long] {
            assert!(
                matches!(tokens.create(name), Err(TokenError::Name { .. })),
                "{name:?}"
            );
        }
        assert!(matches!(
            tokens.revoke("b"),
            Err(TokenError::NoSuch { name }) if name == "b"
        ));
        for number in 1..MOST_TOKENS {
            tokens.create(&format!("t{number}")).unwrap();
        }
        assert!(matches!(
            tokens.create("one-more"),
            Err(TokenError::TooMany)
        ));
    }

    #[test]
    fn a_damaged_file_is_told_and_not_taken_for_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens.json");
        for (text, why) in [
            (String::new(), "EOF"),
            ("{}".into(), "missing field"),
            (r#"{"version":2,"tokens":[]}"#.into(), "version 2"),
            (" ".repeat(200_000), "more than 131072 bytes"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = open(&path).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
            assert!(error.contains("move the file away"), "{error}");
        }
    }
}
