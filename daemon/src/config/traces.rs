//! The section `[traces]`: an OpenTelemetry collector that is told how long scans and jobs took.

use std::path::PathBuf;
use std::time::Duration;

use serde::Deserialize;

use super::value;
use crate::receivers::FileError;

/// An OpenTelemetry collector, if there is one.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TracesConfig {
    /// Where it takes OTLP over HTTP, as `http://localhost:4318`; nobody is told unless set.
    #[serde(deserialize_with = "value::collector")]
    pub collector: Option<String>,
    /// File with fields that go with every request, one `name: value` a line.
    pub headers_file: Option<PathBuf>,
    /// File with the certificates of the authorities that are trusted; without it, those that
    /// the machine trusts.
    pub ca_file: Option<PathBuf>,
    /// How long it is tried to tell of something, with all attempts.
    #[serde(deserialize_with = "value::webhook_milliseconds")]
    pub timeout_ms: u32,
}

impl TracesConfig {
    /// How long it is tried to tell of something.
    #[must_use]
    pub fn timeout(&self) -> Duration {
        Duration::from_millis(self.timeout_ms.into())
    }

    /// What does not go together.
    pub(super) fn check(&self) -> Result<(), String> {
        let collector = self.collector.as_deref();
        for (key, file) in [
            ("headers_file", &self.headers_file),
            ("ca_file", &self.ca_file),
        ] {
            if file.is_some() && collector.is_none() {
                return Err(format!(
                    "`{key}` is for a `collector`: name one, or remove it"
                ));
            }
        }
        if self.ca_file.is_some() && !collector.is_some_and(|url| url.starts_with("https:")) {
            let message = "`ca_file` is for https, but `collector` is not: remove it, or change the \
                           address";
            return Err(message.to_owned());
        }
        Ok(())
    }

    /// Looks at the files that it names.
    pub(super) fn check_files(&self) -> Result<(), FileError> {
        crate::traces::check_files(self)
    }
}

impl Default for TracesConfig {
    fn default() -> Self {
        Self {
            collector: None,
            headers_file: None,
            ca_file: None,
            timeout_ms: 10_000,
        }
    }
}
