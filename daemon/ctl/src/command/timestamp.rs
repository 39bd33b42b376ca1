//! The time that is written into a file.

use std::path::Path;

use jiff::Timestamp;

use crate::failure::Failure;

/// What the user gives, else `SOURCE_DATE_EPOCH`, else what the input keeps, else when the input
/// was changed.
pub(crate) fn of(
    given: Option<Timestamp>,
    kept: Option<Timestamp>,
    input: &Path,
) -> Result<Timestamp, Failure> {
    if let Some(given) = given {
        return Ok(given);
    }
    if let Some(epoch) = std::env::var_os("SOURCE_DATE_EPOCH") {
        let seconds = epoch.to_str().and_then(|text| text.parse().ok());
        let time = seconds.and_then(|seconds| Timestamp::from_second(seconds).ok());
        return time.ok_or_else(|| {
            Failure::Usage(format!(
                "SOURCE_DATE_EPOCH is {epoch:?}, which is not a number of seconds since 1970"
            ))
        });
    }
    if let Some(kept) = kept {
        return Ok(kept);
    }
    let changed = std::fs::metadata(input).and_then(|file| file.modified());
    let changed = changed.ok().and_then(|time| Timestamp::try_from(time).ok());
    Ok(changed.unwrap_or(Timestamp::UNIX_EPOCH))
}
