//! Tickets: links that a browser can follow, which sends no token along.

use serde::{Deserialize, Serialize};

/// Asks for a link to a file.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CreateTicket {
    /// The file's path in this API: of the spool, or a scan's journal.
    pub path: String,
}

/// A link to a file that holds for a short time without a token.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Ticket {
    /// The path with the ticket in its query.
    pub url: String,
    /// For how long a download may be begun with it.
    pub expires_in_s: u32,
}
