//! Seeds as options of studies.

use std::ops::RangeInclusive;

/// One seed, or the first and the last as in `201..=210`.
///
/// # Errors
/// What is expected, for the user.
pub fn parse_seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let parse = |number: &str| number.trim().parse::<u64>().ok();
    let ends = match text.split_once("..=") {
        Some((first, last)) => (parse(first), parse(last)),
        None => (parse(text), parse(text)),
    };
    match ends {
        (Some(first), Some(last)) if first <= last => Ok(first..=last),
        _ => Err("a seed, or the first and last as in 201..=210".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::parse_seeds;

    #[test]
    fn seeds_are_one_or_a_range() {
        assert_eq!(parse_seeds("7"), Ok(7..=7));
        assert_eq!(parse_seeds("201..=210"), Ok(201..=210));
        assert!(parse_seeds("210..=201").is_err());
        assert!(parse_seeds("a few").is_err());
    }
}
