//! How single values are spelled in the Global and Parameter sections.

use std::fmt::Write as _;

use crate::common::decimal;

/// Appends a number; the exponent letter is `D`, the standard's mark of double precision.
pub(super) fn real(out: &mut String, value: f64) {
    decimal(out, value, 'D');
}

/// Appends a string in Hollerith form, `5Hpart1`; nothing for an empty one, which is how
/// the standard leaves a field to its default. Characters that are not printable ASCII
/// become `_`.
pub(super) fn text(out: &mut String, value: &str) {
    let count = value.chars().count();
    if count == 0 {
        return;
    }
    let _ = write!(out, "{count}H");
    out.extend(value.chars().map(printable));
}

pub(super) fn printable(c: char) -> char {
    if matches!(c, ' '..='~') { c } else { '_' }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spelled(value: f64) -> String {
        let mut out = String::new();
        real(&mut out, value);
        out
    }

    #[test]
    fn reals_have_a_point_and_read_back_the_same() {
        for (value, expected) in [
            (0.0, "0."),
            (-0.0, "0."),
            (1.0, "1."),
            (-0.25, "-0.25"),
            (0.1 + 0.2, "0.30000000000000004"),
            (1.5e-7, "1.5D-7"),
            (1e-4, "0.0001"),
            (-3e22, "-3.D22"),
            (f64::MIN_POSITIVE, "2.2250738585072014D-308"),
            (5e-324, "5.D-324"),
            (f64::MAX, "1.7976931348623157D308"),
            (123_456_789_012_345.0, "123456789012345."),
        ] {
            let text = spelled(value);
            assert_eq!(text, expected);
            let back: f64 = text.replace('D', "e").parse().unwrap();
            assert_eq!(back, value);
        }
    }

    #[test]
    fn random_reals_read_back_bit_for_bit() {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut checked = 0;
        while checked < 20_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let value = f64::from_bits(state ^ (state >> 31));
            if !value.is_finite() || value == 0.0 {
                continue;
            }
            let text = spelled(value);
            assert!(text.contains('.') && text.len() <= 26, "{text}");
            let back: f64 = text.replace('D', "e").parse().unwrap();
            assert_eq!(back.to_bits(), value.to_bits(), "{text}");
            checked += 1;
        }
    }

    #[test]
    fn hollerith_counts_what_is_written() {
        for (value, expected) in [
            ("", ""),
            ("part", "4Hpart"),
            ("a,b;c", "5Ha,b;c"),
            ("Dach\u{fc} \u{1f600}\n", "8HDach_ __"),
        ] {
            let mut out = String::new();
            text(&mut out, value);
            assert_eq!(out, expected);
        }
    }
}
