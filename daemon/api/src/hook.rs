//! Hooks: programs that are run for each result.

use serde::{Deserialize, Serialize};

use crate::webhook::Delivery;

/// A program that is run for each result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Hook {
    /// Its name.
    pub name: String,
    /// The program and its arguments.
    pub command: Vec<String>,
    /// Results that it is still to be run for.
    pub waiting: usize,
    /// Results that had to make room since the service started: too many waited.
    #[serde(default)]
    pub dropped: u64,
    /// The run that was tried last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latest: Option<Delivery>,
}

/// The hooks.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct HookList {
    /// In the order of the configuration.
    pub hooks: Vec<Hook>,
}

/// What hooks were run for.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct HookRuns {
    /// Newest first, those that wait included: `about` is the scan, `status` of an attempt the exit
    /// code, `answer` the end of what it said.
    pub runs: Vec<Delivery>,
}
