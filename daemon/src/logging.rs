//! Where the log goes: lines for people, the systemd journal, or JSON.

mod journal;

use std::io::IsTerminal;

use tracing_subscriber::filter::EnvFilter;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{Layer, Registry, fmt, reload};

use crate::config::{LogConfig, LogFormat};

/// The log cannot be set up.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// There is no systemd journal.
    #[error("cannot reach the systemd journal: {0}; set log.format = \"text\"")]
    NoJournal(std::io::Error),
    /// The filter is not one.
    #[error("log.level: {0}")]
    Filter(String),
    /// Something else in this process logs already.
    #[error("the log was set up before")]
    Twice,
}

/// Changes the level while the service runs.
#[derive(Debug)]
pub struct LogHandle {
    filter: reload::Handle<EnvFilter, Registry>,
}

impl LogHandle {
    /// From now on, log this much.
    ///
    /// # Errors
    /// [`LogError::Filter`].
    pub fn set_level(&self, level: &str) -> Result<(), LogError> {
        let filter = filter(level)?;
        self.filter
            .reload(filter)
            .map_err(|error| LogError::Filter(error.to_string()))
    }
}

/// Sets up the log of this process.
///
/// # Errors
/// Any [`LogError`].
pub fn init(config: &LogConfig) -> Result<LogHandle, LogError> {
    let (filter, handle) = reload::Layer::new(filter(&config.level)?);
    let layer: Box<dyn Layer<_> + Send + Sync> = match resolved(config.format) {
        LogFormat::Journald => Box::new(journal::layer().map_err(LogError::NoJournal)?),
        LogFormat::Json => Box::new(fmt::layer().json().with_writer(std::io::stderr)),
        LogFormat::Text | LogFormat::Auto => Box::new(
            fmt::layer()
                .with_ansi(std::io::stderr().is_terminal())
                .with_target(false)
                .with_writer(std::io::stderr),
        ),
    };
    tracing_subscriber::registry()
        .with(filter)
        .with(layer)
        .try_init()
        .map_err(|_| LogError::Twice)?;
    Ok(LogHandle { filter: handle })
}

fn resolved(format: LogFormat) -> LogFormat {
    match format {
        LogFormat::Auto if goes_to_journal() => LogFormat::Journald,
        other => other,
    }
}

/// systemd sets JOURNAL_STREAM to device and number of the file that leads to its journal.
/// Programs that were started by a service inherit the variable, but not always the file.
fn goes_to_journal() -> bool {
    let Some(said) = std::env::var_os("JOURNAL_STREAM") else {
        return false;
    };
    rustix::fs::fstat(std::io::stderr())
        .is_ok_and(|file| said.to_str() == Some(&format!("{}:{}", file.st_dev, file.st_ino)))
}

fn filter(level: &str) -> Result<EnvFilter, LogError> {
    // It tells of each attempt to connect; that the servers are away is told here, once. What is
    // asked for by name goes before.
    EnvFilter::try_new(format!("async_nats=warn,{level}"))
        .map_err(|error| LogError::Filter(error.to_string()))
}
