//! The grid pitch that suits a scan.

/// Grid pitch for a scan of this density, millimetres: the greater of the column pitch
/// and of the geometric mean of column pitch and sample spacing (about one node per
/// sample), rounded to two significant digits.
///
/// Arguments in millimetres, positive and finite.
#[must_use]
pub fn recommended_pitch_mm(column_pitch_mm: f64, sample_spacing_mm: f64) -> f64 {
    let pitch = column_pitch_mm.max((column_pitch_mm * sample_spacing_mm).sqrt());
    if !pitch.is_finite() || pitch <= 0.0 {
        return pitch;
    }
    // By way of decimal text, so that the result is the double nearest to those two digits.
    format!("{pitch:.1e}").parse().unwrap_or(pitch)
}

#[cfg(test)]
mod tests {
    use super::recommended_pitch_mm;

    #[test]
    fn two_digits_of_the_greater_of_pitch_and_mean() {
        assert_eq!(recommended_pitch_mm(0.25, 1.4), 0.59);
        assert_eq!(recommended_pitch_mm(0.42, 0.3), 0.42);
        assert_eq!(recommended_pitch_mm(12.34, 1.0), 12.0);
        assert_eq!(recommended_pitch_mm(0.001_234, 0.0), 0.0012);
    }
}
