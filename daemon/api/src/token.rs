//! Tokens, by which requests on a loopback address are known.

use serde::{Deserialize, Serialize};

/// Longest name of a token: letters, digits, `.`, `_` and `-`.
pub const MAX_TOKEN_NAME_CHARS: usize = 64;

/// A token that holds. What it reads itself is known to its bearer alone.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Token {
    /// What its bearer is called.
    pub name: String,
    /// When it was made, RFC 3339 in UTC.
    pub created_at: String,
}

/// The tokens that hold.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, utoipa::ToSchema)]
pub struct TokenList {
    /// Oldest first.
    pub tokens: Vec<Token>,
}

/// Asks for a token.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CreateToken {
    /// What its bearer shall be called.
    pub name: String,
}

/// A token that was just made: the only time that it is told.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct NewToken {
    /// What its bearer is called.
    pub name: String,
    /// When it was made, RFC 3339 in UTC.
    pub created_at: String,
    /// What the bearer sends: `Authorization: Bearer TOKEN`.
    pub token: String,
}

impl core::fmt::Debug for NewToken {
    /// Without the token, which has no place in a log.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("NewToken")
            .field("name", &self.name)
            .field("created_at", &self.created_at)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::NewToken;

    #[test]
    fn a_token_does_not_get_into_a_log() {
        let token = NewToken {
            name: "desk".into(),
            created_at: String::new(),
            token: "relief_0123".into(),
        };
        assert!(!format!("{token:?}").contains("0123"));
    }
}
