//! Parts of long lists.

use serde::{Deserialize, Serialize};

/// Most entries of a list that one request may ask for.
pub const MAX_LIMIT: u32 = 1000;

/// Which part of a list is wanted, newest first; all of it unless it says otherwise.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, utoipa::IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields, default)]
pub struct Part {
    /// Most entries in the reply, 1 to [`MAX_LIMIT`].
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(minimum = 1, maximum = 1000)]
    pub limit: Option<u32>,
    /// Only those that are older than this one: `next` of the reply before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub before: Option<String>,
}
