//! The laser, and what became of it.

use serde::{Deserialize, Serialize};

/// What is known of the laser.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LaserState {
    /// On, or about to be.
    On,
    /// Off: the scanner says so.
    Off,
    /// The scanner cannot be asked. It turns the laser off by itself when it does not hear
    /// from the service (dead-man time).
    Unknown,
}

impl LaserState {
    /// As it is spelt in JSON.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::On => "on",
            Self::Off => "off",
            Self::Unknown => "unknown",
        }
    }
}

/// A change of the laser's state; a line of the audit log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct LaserEntry {
    /// When, RFC 3339 in UTC.
    pub at: String,
    /// What it is from then on.
    pub laser: LaserState,
    /// Why, in words.
    pub cause: String,
    /// Name of the scanner whose laser it is; empty from services that had but one.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub scanner: String,
    /// The scan for whose sake.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scan: Option<String>,
}

/// The latest changes of the laser's state.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct LaserLog {
    /// Oldest first.
    pub entries: Vec<LaserEntry>,
}
