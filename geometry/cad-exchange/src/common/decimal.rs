//! Numbers as both formats want them.

use std::fmt::Write as _;

/// Appends the shortest decimal that reads back as the same number, always with a point, and
/// with this letter before an exponent: `1.`, `-0.25`, `1.5E-7`.
pub(crate) fn decimal(out: &mut String, value: f64, exponent_letter: char) {
    if value == 0.0 {
        // Both zeros: a sign would say nothing to a reader.
        out.push_str("0.");
        return;
    }
    let from = out.len();
    // Writing to a string cannot fail.
    if (1e-5..1e15).contains(&value.abs()) {
        let _ = write!(out, "{value}");
        if !out[from..].contains('.') {
            out.push('.');
        }
    } else {
        let _ = write!(out, "{value:e}");
        let tail = out.split_off(from);
        let (mantissa, exponent) = tail.split_once('e').unwrap_or((&tail, "0"));
        out.push_str(mantissa);
        if !mantissa.contains('.') {
            out.push('.');
        }
        out.push(exponent_letter);
        out.push_str(exponent);
    }
}
