//! The sections `[[hooks]]`: what is run when a result is there.

use std::path::PathBuf;
use std::time::Duration;

use serde::Deserialize;

use super::receivers::{KeyFault, Retry};
use super::value;

/// A program that is run for each result.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HookConfig {
    /// Its name; safe in a path and on a command line.
    #[serde(deserialize_with = "value::hook_name")]
    pub name: String,
    /// The program, by its whole path, and its arguments.
    pub command: Vec<String>,
    /// What it is run for.
    #[serde(default = "default_events")]
    pub events: Vec<HookEvent>,
    /// How long a run may take.
    #[serde(
        default = "default_timeout_s",
        deserialize_with = "value::hook_seconds"
    )]
    pub timeout_s: u32,
    /// Address space of each of its processes.
    #[serde(
        default = "default_megabytes",
        deserialize_with = "value::hook_megabytes"
    )]
    pub memory_mb: u32,
    /// Most that a file may have which it writes.
    #[serde(
        default = "default_megabytes",
        deserialize_with = "value::hook_megabytes"
    )]
    pub file_mb: u32,
    /// Processes and threads that the service's user may have for it to start another.
    #[serde(
        default = "default_processes",
        deserialize_with = "value::hook_processes"
    )]
    pub processes: u32,
    /// Whether the kernel keeps it from all files but its own.
    #[serde(default)]
    pub sandbox: HookSandbox,
    /// When a run is tried again; no key of the file.
    #[serde(skip)]
    pub retry: Retry,
    /// The program `reliefd`, where it is not what runs; no key of the file.
    #[serde(skip)]
    pub helper: Option<PathBuf>,
}

/// What a hook is run for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HookEvent {
    /// A result is in the spool.
    Published,
}

/// Whether the kernel keeps a hook from all files but its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HookSandbox {
    /// It does, where it has Landlock.
    #[default]
    On,
    /// It does not.
    Off,
}

fn default_events() -> Vec<HookEvent> {
    vec![HookEvent::Published]
}

fn default_timeout_s() -> u32 {
    300
}

fn default_megabytes() -> u32 {
    4_096
}

fn default_processes() -> u32 {
    512
}

impl HookConfig {
    /// A hook with everything else as it is by default.
    #[must_use]
    pub fn new(name: &str, command: &[&str]) -> Self {
        Self {
            name: name.to_owned(),
            command: command.iter().map(|&word| word.to_owned()).collect(),
            events: default_events(),
            timeout_s: default_timeout_s(),
            memory_mb: default_megabytes(),
            file_mb: default_megabytes(),
            processes: default_processes(),
            sandbox: HookSandbox::default(),
            retry: Retry::default(),
            helper: None,
        }
    }

    /// Refuses a command that would be another program elsewhere.
    pub(super) fn check(&self) -> Result<(), KeyFault> {
        let program = self.command.first().map(String::as_str).unwrap_or_default();
        if !program.starts_with('/') {
            return Err((
                "command",
                format!(
                    "{program:?} is no whole path: the first word is a program such as \
                     \"/usr/local/bin/accept-part\", and no shell"
                ),
            ));
        }
        if self.events.is_empty() {
            let told = "a hook without events is never run: use [\"published\"], or remove it";
            return Err(("events", told.into()));
        }
        Ok(())
    }

    /// How long a run may take.
    #[must_use]
    pub fn timeout(&self) -> Duration {
        Duration::from_secs(self.timeout_s.into())
    }
}
