//! Why a command did not succeed.

use std::io;
use std::process::ExitCode;

use crate::service::ServiceError;

/// Why a command did not succeed, with its exit code.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// The command line asks for something that makes no sense; exit code 2.
    #[error("{0}")]
    Usage(String),
    /// Anything else; exit code 1.
    #[error("{0}")]
    Failed(String),
    /// The service refused or was not reached.
    #[error(transparent)]
    Service(#[from] ServiceError),
    /// Standard output does not take what we print.
    #[error("cannot write to standard output: {0}")]
    Output(io::Error),
    /// Ctrl-C.
    #[error("interrupted")]
    Interrupted,
}

impl Failure {
    /// A failure told by somebody else's error, with what we were at.
    pub(crate) fn at(doing: impl std::fmt::Display, error: &dyn std::error::Error) -> Self {
        Self::Failed(format!("{doing}: {}", with_causes(error)))
    }

    /// Tells the user in one line on standard error and gives the exit code.
    pub(crate) fn tell(&self) -> ExitCode {
        if let Self::Output(error) = self
            && error.kind() == io::ErrorKind::BrokenPipe
        {
            // The reader (`head`, a pager) has seen enough.
            return ExitCode::SUCCESS;
        }
        let message = self.to_string();
        let words: Vec<&str> = message.split_whitespace().collect();
        eprintln!("relief: {}", words.join(" "));
        ExitCode::from(match self {
            Self::Usage(_) => 2,
            _ => 1,
        })
    }
}

/// An error and what caused it, unless it says so itself.
pub(crate) fn with_causes(error: &dyn std::error::Error) -> String {
    let mut message = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        let text = inner.to_string();
        if !message.contains(&text) {
            message.push_str(": ");
            message.push_str(&text);
        }
        cause = inner.source();
    }
    message
}
