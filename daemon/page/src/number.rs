//! Numbers as they are shown.

/// A whole number, its digits in groups of three.
#[must_use]
pub fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let mut shown = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            shown.push(',');
        }
        shown.push(digit);
    }
    shown
}

/// Digits after the point that show two significant ones of an uncertainty; at most eight.
#[must_use]
pub fn decimals_of(uncertainty: f64) -> usize {
    if !(uncertainty.is_finite() && uncertainty > 0.0) {
        return 4;
    }
    (0..8)
        .find(|&decimals| {
            let digits = format!("{uncertainty:.decimals$}");
            let significant = digits.replace('.', "");
            significant.trim_start_matches('0').len() >= 2
        })
        .unwrap_or(8)
}

/// A number with so many digits after the point; never minus zero.
#[must_use]
pub fn fixed(value: f64, decimals: usize) -> String {
    let shown = format!("{value:.decimals$}");
    match shown.strip_prefix('-') {
        Some(rest) if !rest.contains(|c: char| c.is_ascii_digit() && c != '0') => rest.to_owned(),
        _ => shown,
    }
}

/// The same with its sign, also where it is above zero.
#[must_use]
pub fn signed(value: f64, decimals: usize) -> String {
    let shown = fixed(value, decimals);
    let is_zero = !shown.contains(|c: char| c.is_ascii_digit() && c != '0');
    if is_zero || shown.starts_with('-') {
        shown
    } else {
        format!("+{shown}")
    }
}

/// About `wanted` round numbers between two, with their text.
#[must_use]
pub fn ticks(low: f64, high: f64, wanted: usize) -> Vec<(f64, String)> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) {
        return Vec::new();
    }
    let raw = span / wanted.max(2) as f64;
    // The decade by its digits, since logarithms differ from machine to machine.
    let exponent: i32 = format!("{raw:e}")
        .split_once('e')
        .and_then(|(_, exponent)| exponent.parse().ok())
        .unwrap_or(0);
    let Some(step) = [1, 2, 5, 10]
        .into_iter()
        .filter_map(|times| format!("{times}e{exponent}").parse::<f64>().ok())
        .find(|step| *step >= raw)
    else {
        return Vec::new();
    };
    let decimals = (0..12)
        .find(|&decimals| format!("{step:.decimals$}").parse() == Ok(step))
        .unwrap_or(12);
    let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
    (0..=(last - first).clamp(0.0, 100.0) as usize)
        .map(|index| {
            let value = (first + index as f64) * step;
            (value, fixed(value, decimals))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_shown_as_engineers_write_them() {
        assert_eq!(grouped(0), "0");
        assert_eq!(grouped(999), "999");
        assert_eq!(grouped(5_120), "5,120");
        assert_eq!(grouped(1_234_567), "1,234,567");
        assert_eq!(fixed(-0.0004, 3), "0.000");
        assert_eq!(fixed(-0.0006, 3), "-0.001");
        assert_eq!(signed(0.25, 2), "+0.25");
        assert_eq!(signed(-0.25, 2), "-0.25");
        assert_eq!(signed(0.0001, 2), "0.00");
    }

    #[test]
    fn an_uncertainty_gets_two_significant_digits() {
        for (uncertainty, decimals) in [
            (0.0019, 4),
            (0.00998, 3),
            (0.0996, 2),
            (0.1, 2),
            (1.2, 1),
            (12.0, 0),
            (0.0, 4),
            (f64::NAN, 4),
            (1e-12, 8),
        ] {
            assert_eq!(decimals_of(uncertainty), decimals, "{uncertainty}");
        }
    }

    #[test]
    fn ticks_are_round_and_within() {
        let marks = ticks(-0.05, 0.05, 6);
        let texts: Vec<&str> = marks.iter().map(|(_, text)| text.as_str()).collect();
        assert_eq!(texts, ["-0.04", "-0.02", "0.00", "0.02", "0.04"]);
        assert_eq!(ticks(0.0, 30.0, 3).len(), 4);
        assert!(ticks(1.0, 1.0, 3).is_empty());
        assert!(ticks(0.0, f64::INFINITY, 3).is_empty());
    }
}
