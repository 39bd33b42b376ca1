//! Which thread a hole may have: what is seen of one from above is its crests, the minor diameter.

/// Metric coarse threads: nominal diameter and pitch, millimetres (ISO 261).
const COARSE: [(&str, f64, f64); 16] = [
    ("M3", 3.0, 0.5),
    ("M4", 4.0, 0.7),
    ("M5", 5.0, 0.8),
    ("M6", 6.0, 1.0),
    ("M8", 8.0, 1.25),
    ("M10", 10.0, 1.5),
    ("M12", 12.0, 1.75),
    ("M14", 14.0, 2.0),
    ("M16", 16.0, 2.0),
    ("M18", 18.0, 2.5),
    ("M20", 20.0, 2.5),
    ("M22", 22.0, 2.5),
    ("M24", 24.0, 3.0),
    ("M27", 27.0, 3.0),
    ("M30", 30.0, 3.5),
    ("M36", 36.0, 4.0),
];

/// Of a standard uncertainty, half of the interval in which a diameter is taken to be.
const COVERAGE: f64 = 2.0;

/// The coarse metric thread whose minor diameter, in the tolerance 6H, a hole of this diameter may have
/// within its uncertainty; the nearest of several. A guess: a plain hole of that size looks the same.
#[must_use]
pub fn nominal_thread(diameter_mm: f64, sigma_mm: f64) -> Option<&'static str> {
    if !diameter_mm.is_finite() {
        return None;
    }
    let off = |&(_, nominal, pitch): &(&str, f64, f64)| {
        let [low, high] = minor_diameters_mm(nominal, pitch);
        (low - diameter_mm).max(diameter_mm - high).max(0.0)
    };
    COARSE
        .iter()
        .filter(|own| off(own) <= COVERAGE * sigma_mm.max(0.0))
        .min_by(|a, b| off(a).total_cmp(&off(b)))
        .map(|own| own.0)
}

/// Least and greatest minor diameter of an internal thread (ISO 724; 6H of ISO 965-1, section 13.5).
fn minor_diameters_mm(nominal_mm: f64, pitch_mm: f64) -> [f64; 2] {
    let least = nominal_mm - 1.082_532 * pitch_mm;
    let tolerance_um = if pitch_mm < 1.0 {
        433.0 * pitch_mm - 190.0 * libm::pow(pitch_mm, 1.22)
    } else {
        230.0 * libm::pow(pitch_mm, 0.7)
    };
    [least, least + 1e-3 * tolerance_um]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the tables of ISO 965-2.
    #[test]
    fn minor_diameters_are_those_of_the_tables() {
        for (nominal, pitch, low, high) in [
            (3.0, 0.5, 2.459, 2.599),
            (6.0, 1.0, 4.917, 5.153),
            (8.0, 1.25, 6.647, 6.912),
            (10.0, 1.5, 8.376, 8.676),
            (20.0, 2.5, 17.294, 17.744),
        ] {
            let [least, most] = minor_diameters_mm(nominal, pitch);
            assert!((least - low).abs() < 0.001, "{nominal}: {least}");
            // Tables round tolerances to preferred numbers.
            assert!((most - high).abs() < 0.02, "{nominal}: {most}");
        }
    }

    #[test]
    fn drilled_for_a_thread_it_is_told_and_else_none() {
        assert_eq!(nominal_thread(6.8, 0.01), Some("M8"));
        assert_eq!(nominal_thread(8.5, 0.01), Some("M10"));
        assert_eq!(nominal_thread(8.019, 0.01), None);
        // What is not known well may be one.
        assert_eq!(nominal_thread(8.019, 0.3), Some("M10"));
        assert_eq!(nominal_thread(f64::NAN, 0.1), None);
    }
}
