//! From a file's text to a configuration, or to an error that a person can act on.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::{Config, Transport};
use crate::error::bounded;

/// A hundred times what every key with its comment takes.
const MOST_BYTES: u64 = 1 << 20;

/// The configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read the configuration {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The file is something else.
    #[error(
        "{} has more than {MOST_BYTES} bytes, and is no configuration",
        path.display()
    )]
    Long {
        /// The file.
        path: PathBuf,
    },
    /// Something in the file is wrong.
    #[error("{}, line {line}, column {column}: {message}", path.display())]
    Wrong {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What is wrong and what to do.
        message: String,
    },
    /// Values that are each possible do not go together.
    #[error("{}, section [{section}]: {message}", path.display())]
    Inconsistent {
        /// The file.
        path: PathBuf,
        /// The section.
        section: &'static str,
        /// What is wrong and what to do.
        message: String,
    },
}

impl Config {
    /// Reads a configuration file.
    ///
    /// # Errors
    /// Any [`ConfigError`].
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let failed = |source| ConfigError::Read {
            path: path.to_owned(),
            source,
        };
        let mut bytes = Vec::new();
        File::open(path)
            .and_then(|file| file.take(MOST_BYTES + 1).read_to_end(&mut bytes))
            .map_err(failed)?;
        if bytes.len() as u64 > MOST_BYTES {
            return Err(ConfigError::Long {
                path: path.to_owned(),
            });
        }
        let text = String::from_utf8(bytes)
            .map_err(|error| failed(std::io::Error::new(std::io::ErrorKind::InvalidData, error)))?;
        Self::parse(&text, path)
    }

    /// Reads a configuration from text; `path` is for the messages.
    ///
    /// # Errors
    /// [`ConfigError::Wrong`] and [`ConfigError::Inconsistent`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, ConfigError> {
        let config: Self = toml::from_str(text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start).min(text.len());
            let before = text.get(..start).unwrap_or_default();
            let line_start = before.rfind('\n').map_or(0, |at| at + 1);
            let mut message = with_nearest_name(error.message());
            if error.message().starts_with("unknown field")
                && let Some(section) = section_of(before)
            {
                message =
                    message.replacen("unknown key", &format!("in [{section}] unknown key"), 1);
            }
            ConfigError::Wrong {
                path: path.to_owned(),
                line: before.matches('\n').count() + 1,
                column: before[line_start..].chars().count() + 1,
                message: bounded(message),
            }
        })?;
        let inconsistent = |(section, message)| ConfigError::Inconsistent {
            path: path.to_owned(),
            section,
            message: bounded(message),
        };
        other_transport(text, config.scanner.transport).map_err(inconsistent)?;
        config.processing().check().map_err(inconsistent)?;
        Ok(config)
    }
}

/// Refuses keys that belong to the other way of attaching a scanner: they would do nothing.
fn other_transport(text: &str, transport: Transport) -> Result<(), (&'static str, String)> {
    const SERIAL: [&str; 2] = ["port", "baud"];
    const USB: [&str; 3] = ["vendor_id", "product_id", "serial_number"];
    let (of_the_other, other, own): (&[&str], _, _) = match transport {
        Transport::Serial => (&USB, "usb", "serial"),
        Transport::Usb => (&SERIAL, "serial", "usb"),
    };
    let given: Option<toml::Table> = toml::from_str(text).ok();
    let section = given
        .as_ref()
        .and_then(|all| all.get("scanner")?.as_table());
    let Some(key) = section.and_then(|s| of_the_other.iter().find(|key| s.contains_key(**key)))
    else {
        return Ok(());
    };
    Err((
        "scanner",
        format!(
            "`{key}` is for transport = \"{other}\", but the transport is \"{own}\": \
             remove it, or change the transport"
        ),
    ))
}

/// The section that a place in the file belongs to; `None` on a section's own line.
fn section_of(before: &str) -> Option<&str> {
    let (lines, last) = before.rsplit_once('\n')?;
    if last.trim_start().starts_with('[') {
        return None;
    }
    lines
        .lines()
        .rev()
        .find_map(|line| line.trim().strip_prefix('[')?.split_once(']'))
        .map(|(name, _)| name.trim())
}

/// Serde's message about an unknown name, with the nearest known one put forward.
pub(super) fn with_nearest_name(message: &str) -> String {
    for (kind, ours) in [("unknown field", "key"), ("unknown variant", "value")] {
        let Some(rest) = message.strip_prefix(kind) else {
            continue;
        };
        let mut quoted = rest.split('`').skip(1).step_by(2);
        let Some(given) = quoted.next() else {
            continue;
        };
        let known: Vec<&str> = quoted.collect();
        let nearest = known
            .iter()
            .map(|name| (strsim::damerau_levenshtein(given, name), name))
            .min_by_key(|(distance, _)| *distance)
            .filter(|(distance, name)| *distance <= 1 + name.len() / 3);
        return match nearest {
            Some((_, name)) => format!("unknown {ours} `{given}`; did you mean `{name}`?"),
            None => format!("unknown {ours} `{given}`; known are: {}", known.join(", ")),
        };
    }
    message.to_owned()
}
