//! From a file's text to a configuration, or to an error that a person can act on.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use super::{Config, receivers, scanners};
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
    /// Reads a configuration file, and the machine's file if it names one.
    ///
    /// # Errors
    /// Any [`ConfigError`].
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        Self::parse_file(&read(path)?, path)
    }

    /// Reads a configuration file, and looks at the files that it names: those with secrets are
    /// for the service alone, and others need not be able to read them.
    ///
    /// # Errors
    /// Any [`ConfigError`].
    pub fn load_with_files(path: &Path) -> Result<Self, ConfigError> {
        let text = read(path)?;
        let config = Self::parse_file(&text, path)?;
        receivers::check_all_files(&text, &config)
            .map_err(|(start, message)| wrong(&text, path, start, message))?;
        let traces = config.traces.check_files();
        traces.map_err(|error| inconsistent(path, "traces", error.to_string()))?;
        let nats = crate::fleet::check_files(&config.nats);
        nats.map_err(|error| inconsistent(path, "nats", error.to_string()))?;
        Ok(config)
    }

    fn parse_file(text: &str, path: &Path) -> Result<Self, ConfigError> {
        // Two names may lead to one port; one that is not there is what it is called.
        let port = |port: &Path| fs::canonicalize(port).unwrap_or_else(|_| port.to_owned());
        let mut config = Self::parse_with(text, path, &port)?;
        let deliverables = &mut config.deliverables;
        deliverables
            .read_machine(path)
            .and_then(|()| deliverables.read_network(path))
            // Whether it has the cutters.
            .and_then(|()| deliverables.further().map(drop))
            .map_err(|(section, message)| inconsistent(path, section, message))?;
        config
            .scanner
            .read_calibration(path)
            .map_err(|message| inconsistent(path, "scanner", message))?;
        for (name, scanner) in &mut config.scanners {
            scanner.read_calibration(path).map_err(|message| {
                inconsistent(path, "scanners", format!("scanner {name}: {message}"))
            })?;
        }
        if !config.deliverables.edit.is_empty() {
            let told = "edit changes the features of one scan: give it with a rerun of that";
            return Err(inconsistent(path, "deliverables", told.to_owned()));
        }
        Ok(config)
    }

    /// Reads a configuration from text; `path` is for the messages.
    ///
    /// # Errors
    /// [`ConfigError::Wrong`] and [`ConfigError::Inconsistent`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, ConfigError> {
        Self::parse_with(text, path, &Path::to_owned)
    }

    fn parse_with(
        text: &str,
        path: &Path,
        port: &dyn Fn(&Path) -> PathBuf,
    ) -> Result<Self, ConfigError> {
        let wrong = |start: usize, message: String| wrong(text, path, start, message);
        let config: Self = toml::from_str(text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start).min(text.len());
            let before = text.get(..start).unwrap_or_default();
            let mut message = with_nearest_name(error.message());
            if error.message().starts_with("unknown field")
                && let Some(section) = section_of(before)
            {
                message =
                    message.replacen("unknown key", &format!("in [{section}] unknown key"), 1);
            }
            wrong(start, message)
        })?;
        scanners::check(text, &config, port)
            .and_then(|()| receivers::check(text, &config))
            .map_err(|(start, message)| wrong(start, message))?;
        let traces = config.traces.check();
        traces.map_err(|message| inconsistent(path, "traces", message))?;
        config
            .nats
            .check()
            .map_err(|message| inconsistent(path, "nats", message))?;
        config
            .check_roles()
            .map_err(|message| inconsistent(path, "service", message))?;
        config
            .storage
            .check()
            .map_err(|message| inconsistent(path, "storage", message))?;
        config
            .discovery
            .check(&config.http.hosts)
            .map_err(|message| inconsistent(path, "discovery", message))?;
        config
            .processing()
            .check()
            .map_err(|(section, message)| inconsistent(path, section, message))?;
        Ok(config)
    }
}

/// The text of a file.
fn read(path: &Path) -> Result<String, ConfigError> {
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
    String::from_utf8(bytes)
        .map_err(|error| failed(std::io::Error::new(std::io::ErrorKind::InvalidData, error)))
}

fn wrong(text: &str, path: &Path, start: usize, message: String) -> ConfigError {
    let (line, column) = line_and_column(text, start);
    ConfigError::Wrong {
        path: path.to_owned(),
        line,
        column,
        message: bounded(message),
    }
}

fn inconsistent(path: &Path, section: &'static str, message: String) -> ConfigError {
    ConfigError::Inconsistent {
        path: path.to_owned(),
        section,
        message: bounded(message),
    }
}

/// Line and column in characters of a place in a text, each from 1.
pub(super) fn line_and_column(text: &str, start: usize) -> (usize, usize) {
    let before = text.get(..start).unwrap_or_default();
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    (
        before.matches('\n').count() + 1,
        before[line_start..].chars().count() + 1,
    )
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
        // One of several sections of the same name has its brackets doubled.
        .map(|(name, _)| name.trim_start_matches('[').trim())
}

/// Serde's message about an unknown name, with the nearest known one put forward, or about one
/// that is missing.
pub(super) fn with_nearest_name(message: &str) -> String {
    if let Some(key) = message.strip_prefix("missing field ") {
        return format!("the key {key} is missing");
    }
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
