//! How often faults struck: a rate says only how often they are to be expected.

use std::collections::BTreeMap;

/// Number of times that each fault has struck, by its key in a list of faults.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Strikes(BTreeMap<&'static str, u64>);

impl Strikes {
    /// One more of this key.
    pub fn note(&mut self, key: &'static str) {
        *self.0.entry(key).or_default() += 1;
    }

    /// Those of this key.
    #[must_use]
    pub fn of(&self, key: &str) -> u64 {
        self.0.get(key).copied().unwrap_or(0)
    }

    /// Those of all keys.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.0.values().sum()
    }

    /// Those of another place as well.
    pub fn add(&mut self, other: &Self) {
        for (key, count) in &other.0 {
            *self.0.entry(key).or_default() += count;
        }
    }
}
