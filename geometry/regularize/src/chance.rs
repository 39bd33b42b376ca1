//! How likely things are by noise, and how likely by chance.

use core::f64::consts::PI;

/// Probability that a sum of so many squares of standard normal numbers is this large, or larger.
#[must_use]
pub fn survival(squares: f64, freedom: usize) -> f64 {
    if freedom == 0 || squares.is_nan() {
        return f64::from(u8::from(freedom == 0 && squares <= 0.0));
    }
    let half = 0.5 * squares.max(0.0);
    // Each two squares more add a term.
    let (mut sum, mut term, first) = if freedom % 2 == 1 {
        (libm::erfc(half.sqrt()), 2.0 * (half / PI).sqrt(), 1)
    } else {
        (libm::exp(-half), half, 2)
    };
    let mut of = first as f64;
    for _ in (first..freedom).step_by(2) {
        sum += term * libm::exp(-half);
        of += 2.0;
        term *= half / (0.5 * of);
    }
    sum
}

/// Probability of a normal number farther off than so many standard deviations.
pub(crate) fn tail(deviations: f64) -> f64 {
    survival(deviations * deviations, 1)
}

/// Volume of a ball of radius 1.
pub(crate) fn ball(dimensions: usize) -> f64 {
    match dimensions {
        0 => 1.0,
        1 => 2.0,
        2 => PI,
        _ => 4.0 / 3.0 * PI,
    }
}

/// How many of the probabilities, in ascending order, are so small that hardly a part of these
/// is chance alone (Benjamini and Hochberg 1995, "Controlling the false discovery rate").
/// `tried` is how many there are, those that are not given included.
pub(crate) fn discoveries(ascending: &[f64], tried: usize, share: f64) -> usize {
    let mut found = 0;
    for (index, chance) in ascending.iter().enumerate() {
        if chance * tried as f64 <= share * (index + 1) as f64 {
            found = index + 1;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_are_as_likely_as_tables_have_it() {
        // The 5 % points of chi-square.
        let table = [3.841, 5.991, 7.815, 9.488, 11.070, 12.592, 14.067];
        for (k, squares) in table.into_iter().enumerate() {
            let p = survival(squares, k + 1);
            assert!((p - 0.05).abs() < 1e-4, "{}: {p}", k + 1);
            assert_eq!(survival(0.0, k + 1), 1.0);
        }
        assert!((tail(3.0) - 0.0027).abs() < 1e-5);
        assert_eq!(survival(f64::NAN, 2), 0.0);
    }

    #[test]
    fn among_many_each_must_be_the_less_likely() {
        assert_eq!(discoveries(&[0.04], 1, 0.05), 1);
        assert_eq!(discoveries(&[0.04], 2, 0.05), 0);
        // Where most are found, one more is no chance.
        assert_eq!(discoveries(&[0.001, 0.002, 0.04], 3, 0.05), 3);
        assert_eq!(discoveries(&[0.001, 0.002, 0.04], 9, 0.05), 2);
        assert_eq!(discoveries(&[], 9, 0.05), 0);
    }
}
