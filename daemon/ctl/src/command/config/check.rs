//! `relief config check`.

use std::path::PathBuf;

use reliefd::{Config, ConfigError};
use serde::Serialize;

use crate::failure::Failure;
use crate::output;

/// Check a configuration as the service would, without a service
///
/// The files that it names are looked at, too: those with secrets, a milling machine's, a network's.
/// Prints "sound", or what is wrong, in which line, and what to do (exit code 1).
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The configuration (TOML)
    #[arg(value_name = "FILE", default_value = "/etc/relief/reliefd.toml")]
    file: PathBuf,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Told {
    file: PathBuf,
    sound: bool,
    scanners: Vec<Scanner>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<Wrong>,
}

#[derive(Debug, Serialize)]
struct Scanner {
    name: String,
    place: String,
}

#[derive(Debug, Serialize)]
struct Wrong {
    message: String,
    line: Option<usize>,
    column: Option<usize>,
    section: Option<&'static str>,
}

pub(super) fn run(args: &Args, json: bool) -> Result<(), Failure> {
    let file = args.file.clone();
    match Config::load_with_files(&file) {
        Ok(config) => {
            let scanners = config.each_scanner().into_iter().map(|one| Scanner {
                name: one.name.to_string(),
                place: one.config.place(),
            });
            let told = Told {
                file,
                sound: true,
                scanners: scanners.collect(),
                error: None,
            };
            output::either(json, &told, lines)
        }
        Err(error) => {
            let message = error.to_string();
            if json {
                output::json(&Told {
                    file,
                    sound: false,
                    scanners: Vec::new(),
                    error: Some(wrong(&error)),
                })?;
            }
            Err(Failure::Failed(message))
        }
    }
}

fn lines(told: &Told) -> String {
    let mut lines = vec![format!("{}: sound", told.file.display())];
    let scanners = told.scanners.iter();
    lines.extend(scanners.map(|one| format!("{}: {}", output::scanner(&one.name), one.place)));
    lines.join("\n")
}

fn wrong(error: &ConfigError) -> Wrong {
    let (line, column, section, message) = match error {
        ConfigError::Wrong {
            line,
            column,
            message,
            ..
        } => (Some(*line), Some(*column), None, message.clone()),
        ConfigError::Inconsistent {
            section, message, ..
        } => (None, None, Some(*section), message.clone()),
        error => (None, None, None, error.to_string()),
    };
    Wrong {
        message,
        line,
        column,
        section,
    }
}
