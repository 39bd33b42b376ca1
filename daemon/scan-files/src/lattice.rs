//! The lattice of 10 nm that all coordinates are rounded to.

/// Pitch of the coordinate lattice, millimetres.
pub const LATTICE_MM: f64 = 1e-5;

/// The coordinate in millimetres of a lattice count: `counts * LATTICE_MM`, with this one
/// rounding, as a calibration with that count size computes it.
#[must_use]
pub fn lattice_mm(counts: i32) -> f64 {
    f64::from(counts) * LATTICE_MM
}

/// The nearest lattice count; the exact inverse of [`lattice_mm`]. `None` when the
/// coordinate is not finite or its count does not fit (beyond 21 474 mm).
#[must_use]
pub fn lattice_counts(coordinate_mm: f64) -> Option<i32> {
    let counts = (coordinate_mm * 1e5).round();
    (counts.abs() <= f64::from(i32::MAX)).then_some(counts as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_millimetres_are_inverse() {
        let mut counts = 1_i32;
        while counts < i32::MAX / 3 {
            for c in [counts, -counts, counts + 1] {
                assert_eq!(lattice_counts(lattice_mm(c)), Some(c));
            }
            counts = counts * 2 + 7;
        }
        assert_eq!(lattice_counts(lattice_mm(i32::MAX)), Some(i32::MAX));
    }

    #[test]
    fn what_does_not_fit_has_no_count() {
        for far in [21_475.0, -21_475.0, f64::NAN, f64::INFINITY] {
            assert_eq!(lattice_counts(far), None);
        }
    }
}
