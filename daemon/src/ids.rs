//! Names of scans and results: sortable by time, safe as file names, each given once.

use std::sync::Mutex;

use jiff::Timestamp;
use relief_api::MAX_NAME_CHARS;

use crate::error::ServiceError;

/// Longest part of an id that comes from the user.
const NAME_BYTES: usize = 48;

/// Gives out ids.
#[derive(Debug, Default)]
pub(crate) struct Ids {
    last_ms: Mutex<i64>,
}

impl Ids {
    /// An id of this moment, such as `20261121T110830.123Z-house`. No two share their
    /// time, so that no two are equal whatever their names. `taken` tells of names that
    /// exist already, from before a restart under a clock that was put back.
    pub(crate) fn next(&self, name: &str, taken: impl Fn(&str) -> bool) -> String {
        let mut last_ms = self
            .last_ms
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut ms = Timestamp::now().as_millisecond().max(*last_ms + 1);
        loop {
            // Times that jiff cannot express lie ten thousand years off.
            let time = Timestamp::from_millisecond(ms).unwrap_or_default();
            let id = format!(
                "{}-{}",
                time.strftime("%Y%m%dT%H%M%S.%3fZ"),
                safe_name(name)
            );
            if !taken(&id) {
                *last_ms = ms;
                return id;
            }
            ms += 1;
        }
    }
}

/// The name with everything replaced that some file system or shell might stumble over;
/// `scan` when nothing is left.
pub(crate) fn safe_name(name: &str) -> String {
    let mut safe = String::new();
    for c in name.chars() {
        let c = if c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-') {
            c
        } else {
            '-'
        };
        // One separator in a row is enough, and a name must not begin like an option or
        // a hidden file.
        let separator = matches!(c, '-' | '.');
        if separator && (safe.is_empty() || safe.ends_with(['-', '.'])) {
            continue;
        }
        if safe.len() == NAME_BYTES {
            break;
        }
        safe.push(c);
    }
    let safe = safe.trim_end_matches(['-', '.']);
    if safe.is_empty() { "scan" } else { safe }.to_owned()
}

/// The name as it is shown and stands in files: one line, not endless, not empty.
///
/// # Errors
/// [`ServiceError::LongName`] for what would have to be cut.
pub(crate) fn shown_name(name: &str) -> Result<String, ServiceError> {
    let shown: String = name.trim().chars().filter(|c| !c.is_control()).collect();
    let chars = shown.chars().count();
    if chars > MAX_NAME_CHARS {
        Err(ServiceError::LongName { chars })
    } else if shown.is_empty() {
        Ok("scan".to_owned())
    } else {
        Ok(shown)
    }
}

/// Now, RFC 3339 in UTC with milliseconds.
pub(crate) fn now() -> String {
    at(Timestamp::now())
}

/// A time, in the same way.
pub(crate) fn at(time: Timestamp) -> String {
    time.strftime("%Y-%m-%dT%H:%M:%S.%3fZ").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_safe() {
        for (name, safe) in [
            ("house", "house"),
            ("../../etc/passwd", "etc-passwd"),
            ("Bracket No. 7 (left)", "Bracket-No.7-left"),
            ("-rf", "rf"),
            ("..", "scan"),
            ("", "scan"),
            ("gr\u{fc}n\u{1f600}", "gr-n"),
            ("a\n\0b", "a-b"),
        ] {
            assert_eq!(safe_name(name), safe, "{name:?}");
        }
        assert_eq!(safe_name(&"x".repeat(500)).len(), NAME_BYTES);
    }

    #[test]
    fn long_names_are_refused_and_not_cut() {
        assert_eq!(shown_name(" a\nb\t ").unwrap(), "ab");
        assert_eq!(shown_name("\n").unwrap(), "scan");
        let longest = "\u{e4}".repeat(MAX_NAME_CHARS);
        assert_eq!(shown_name(&longest).unwrap(), longest);
        let error = shown_name(&format!("{longest}x")).unwrap_err().to_string();
        assert_eq!(
            error,
            "the name has 101 characters; at most 100 are allowed"
        );
    }

    #[test]
    fn ids_ascend_and_avoid_what_is_taken() {
        let ids = Ids::default();
        let given: Vec<String> = (0..50).map(|_| ids.next("a", |_| false)).collect();
        assert!(given.is_sorted() && given.windows(2).all(|w| w[0] != w[1]));
        let first = ids.next("a", |_| false);
        let other = ids.next("a", |id| id.ends_with("0Z-a") || *id <= *first);
        assert!(!other.ends_with("0Z-a"));
        let shape: String = other
            .chars()
            .map(|c| if c.is_ascii_digit() { '9' } else { c })
            .collect();
        assert_eq!(shape, "99999999T999999.999Z-a");
    }
}
