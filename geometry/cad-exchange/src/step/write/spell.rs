//! How single values are spelled (ISO 10303-21, 6.4).

use std::fmt::Write as _;

use crate::common::decimal;

/// Appends a number; the exponent letter is `E`.
pub(super) fn real(out: &mut String, value: f64) {
    decimal(out, value, 'E');
}

/// Appends a string between apostrophes. Apostrophes and backslashes are doubled;
/// characters that are not printable ASCII stand between `\X2\` and `\X0\` by the four
/// digits of their code, those beyond the basic plane between `\X4\` and `\X0\` by eight.
/// So does an apostrophe before a comma or a closing bracket, where OpenCASCADE 8 takes a
/// doubled one for the end of the string.
pub(super) fn text(out: &mut String, value: &str) {
    out.push('\'');
    let mut open = "";
    for (at, c) in value.char_indices() {
        let ends_for_some = || {
            let rest = value.get(at + 1..).unwrap_or_default();
            rest.trim_start_matches(' ').starts_with([',', ')'])
        };
        let wanted = match c {
            '\'' if ends_for_some() => "\\X2\\",
            ' '..='~' => "",
            '\0'..='\u{ffff}' => "\\X2\\",
            _ => "\\X4\\",
        };
        if wanted != open {
            if !open.is_empty() {
                out.push_str("\\X0\\");
            }
            out.push_str(wanted);
            open = wanted;
        }
        let _ = match wanted {
            "\\X2\\" => write!(out, "{:04X}", u32::from(c)),
            "\\X4\\" => write!(out, "{:08X}", u32::from(c)),
            _ => {
                if c == '\'' || c == '\\' {
                    out.push(c);
                }
                out.push(c);
                Ok(())
            }
        };
    }
    if !open.is_empty() {
        out.push_str("\\X0\\");
    }
    out.push('\'');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reals_have_a_point_and_read_back_the_same() {
        for (value, expected) in [
            (0.0, "0."),
            (-0.0, "0."),
            (1.0, "1."),
            (-0.25, "-0.25"),
            (0.1 + 0.2, "0.30000000000000004"),
            (1.5e-7, "1.5E-7"),
            (1e-4, "0.0001"),
            (-3e22, "-3.E22"),
            (5e-324, "5.E-324"),
            (f64::MAX, "1.7976931348623157E308"),
        ] {
            let mut text = String::new();
            real(&mut text, value);
            assert_eq!(text, expected);
            assert_eq!(text.parse::<f64>().unwrap(), value);
        }
    }

    #[test]
    fn strings() {
        for (value, expected) in [
            ("", "''"),
            ("part 1", "'part 1'"),
            ("it's", "'it''s'"),
            ("'B', (it's)", "'''B\\X2\\0027\\X0\\, (it''s)'"),
            ("B' )", "'B\\X2\\0027\\X0\\ )'"),
            ("a\\b", "'a\\\\b'"),
            ("Geh\u{e4}use", "'Geh\\X2\\00E4\\X0\\use'"),
            (
                "\u{1f600}\u{e4}\u{fc}\n",
                "'\\X4\\0001F600\\X0\\\\X2\\00E400FC000A\\X0\\'",
            ),
        ] {
            let mut out = String::new();
            text(&mut out, value);
            assert_eq!(out, expected);
        }
    }
}
