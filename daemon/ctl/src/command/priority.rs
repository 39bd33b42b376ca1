//! Which job goes first, as it is given on the command line.

use relief_api::Priority;

/// Reads a priority.
pub(super) fn parse(text: &str) -> Result<Priority, String> {
    let named = Priority::ALL.into_iter().find(|one| one.as_str() == text);
    named.ok_or_else(|| "high, normal and low are possible".to_owned())
}
