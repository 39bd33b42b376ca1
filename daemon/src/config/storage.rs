//! The section `[storage]`: room on the disk.

use serde::Deserialize;

use super::value;

/// Room on the disk: how much stays free, and what goes to make some.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StorageConfig {
    /// Megabytes that stay free on the disks of kept scans and results; a scan that would need
    /// some of them is refused.
    #[serde(deserialize_with = "value::reserve_mb")]
    pub reserve_mb: u32,
    /// With fewer megabytes free there, receivers of messages are told; 0 for never.
    #[serde(deserialize_with = "value::reserve_mb")]
    pub low_mb: u32,
    /// Most megabytes that kept scans may take; the oldest go first.
    #[serde(deserialize_with = "value::megabytes")]
    pub scans_mb: Option<u32>,
    /// Days for which scans are kept.
    #[serde(deserialize_with = "value::days")]
    pub scans_days: Option<u32>,
    /// Most megabytes that results may take; the oldest go first.
    #[serde(deserialize_with = "value::megabytes")]
    pub results_mb: Option<u32>,
    /// Days for which results are kept.
    #[serde(deserialize_with = "value::days")]
    pub results_days: Option<u32>,
    /// Days for which results are kept once they are acknowledged.
    #[serde(deserialize_with = "value::days")]
    pub acknowledged_days: Option<u32>,
    /// What becomes of results that are acknowledged.
    pub acknowledged: Acknowledged,
    /// What becomes of results that are not.
    pub unacknowledged: Unacknowledged,
}

/// What becomes of results that somebody has acknowledged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Acknowledged {
    /// They stay until their days are over or room is short, when they go before all others.
    #[default]
    Keep,
    /// They go at the next look.
    Remove,
}

/// What becomes of results that nobody has acknowledged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Unacknowledged {
    /// They go by age and size, after those that are acknowledged.
    #[default]
    Limits,
    /// They stay, whatever the limits.
    Keep,
}

/// Bytes of a megabyte.
const MB: u64 = 1_000_000;

impl StorageConfig {
    /// Bytes that stay free.
    #[must_use]
    pub fn reserve_bytes(&self) -> u64 {
        u64::from(self.reserve_mb) * MB
    }

    /// With fewer bytes free, receivers are told.
    #[must_use]
    pub fn low_bytes(&self) -> u64 {
        u64::from(self.low_mb) * MB
    }

    /// Most bytes and days of kept scans.
    #[must_use]
    pub fn scans(&self) -> Limits {
        Limits::new(self.scans_mb, self.scans_days)
    }

    /// Most bytes and days of results.
    #[must_use]
    pub fn results(&self) -> Limits {
        Limits {
            acknowledged_s: match self.acknowledged {
                Acknowledged::Keep => self.acknowledged_days.map(seconds),
                Acknowledged::Remove => Some(0),
            },
            ..Limits::new(self.results_mb, self.results_days)
        }
    }

    /// Refuses what contradicts itself.
    pub(super) fn check(&self) -> Result<(), String> {
        if self.acknowledged == Acknowledged::Remove && self.acknowledged_days.is_some() {
            return Err(
                "acknowledged = \"remove\" leaves nothing for acknowledged_days to keep: \
                 leave out one of them"
                    .to_owned(),
            );
        }
        Ok(())
    }
}

impl Default for StorageConfig {
    fn default() -> Self {
        Self {
            reserve_mb: 256,
            low_mb: 1_024,
            scans_mb: None,
            scans_days: None,
            results_mb: None,
            results_days: None,
            acknowledged_days: None,
            acknowledged: Acknowledged::default(),
            unacknowledged: Unacknowledged::default(),
        }
    }
}

/// How much is kept, and for how long; without a limit, everything for ever.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Limits {
    /// Bytes in all.
    pub bytes: Option<u64>,
    /// Seconds since the end.
    pub age_s: Option<u64>,
    /// Seconds since it was acknowledged; 0 for none at all.
    pub acknowledged_s: Option<u64>,
}

fn seconds(days: u32) -> u64 {
    u64::from(days) * 86_400
}

impl Limits {
    fn new(megabytes: Option<u32>, days: Option<u32>) -> Self {
        Self {
            bytes: megabytes.map(|megabytes| u64::from(megabytes) * MB),
            age_s: days.map(seconds),
            acknowledged_s: None,
        }
    }
}
