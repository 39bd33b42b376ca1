//! What a service is there for.

use std::collections::BTreeSet;

use serde::{Deserialize, Deserializer, de::Error};

use super::Config;

/// Something that a service is there for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// It takes scans.
    Acquire,
    /// It works on jobs: on its own, and with `[nats]` on those of others.
    Work,
    /// It offers its API and its page.
    Serve,
}

impl Role {
    /// All there are.
    pub const ALL: [Self; 3] = [Self::Acquire, Self::Work, Self::Serve];
}

/// At least one.
pub(super) fn roles<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<BTreeSet<Role>, D::Error> {
    let roles = BTreeSet::deserialize(deserializer)?;
    if roles.is_empty() {
        return Err(D::Error::custom(
            "without a role there is nothing to do: \"acquire\", \"work\" and \"serve\" are known",
        ));
    }
    Ok(roles)
}

impl Config {
    /// Whether the service has this role.
    #[must_use]
    pub fn has(&self, role: Role) -> bool {
        self.service.roles.contains(&role)
    }

    /// Refuses roles that lead to nothing.
    pub(super) fn check_roles(&self) -> Result<(), String> {
        let wrong = |told: &str| Err(told.to_owned());
        if self.has(Role::Acquire) && !self.has(Role::Serve) {
            return wrong(
                "the role \"acquire\" needs \"serve\": scans are started by the API, on the socket \
                 alone unless `listen` is set",
            );
        }
        if !self.has(Role::Work) && !self.nats.is_used() {
            return wrong(
                "without the role \"work\" nobody works on jobs: add it, or name `servers` in [nats]",
            );
        }
        if !self.has(Role::Serve) && !self.nats.is_used() {
            return wrong(
                "the role \"work\" alone is for jobs of others: add \"serve\", or name `servers` in \
                 [nats]",
            );
        }
        Ok(())
    }
}
