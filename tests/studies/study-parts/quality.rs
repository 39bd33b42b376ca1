//! How near the numbers of many faces are to the truth, in terms of the bound on each.

use crate::numbers::Number;

/// How good the numbers of a group are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Quality {
    pub(crate) numbers: usize,
    /// Root mean square of error over bound.
    pub(crate) ratio: f64,
    /// The same of an estimator that knows which readings are of the face.
    pub(crate) informed_ratio: f64,
    /// The ratio by the median, as if errors were normal: not moved by a few that are far off.
    pub(crate) median_ratio: f64,
    /// Share of the stated 95 % intervals that hold the truth.
    pub(crate) covered: f64,
    /// Median of stated uncertainty over bound.
    pub(crate) width: f64,
    /// Median of the bound of readings deep within faces, over bound.
    pub(crate) inner_width: f64,
}

/// Of a normal variable, the median of its size over its deviation.
const MEDIAN_OF_NORMAL: f64 = 0.674_49;

pub(crate) fn quality(numbers: &[&Number]) -> Option<Quality> {
    if numbers.is_empty() {
        return None;
    }
    let count = numbers.len() as f64;
    let ratios: Vec<f64> = numbers.iter().map(|n| (n.error / n.bound).abs()).collect();
    let informed = numbers.iter().map(|n| n.informed_error / n.bound);
    let covered = numbers.iter().filter(|n| n.is_covered()).count();
    Some(Quality {
        numbers: numbers.len(),
        ratio: (ratios.iter().map(|ratio| ratio * ratio).sum::<f64>() / count).sqrt(),
        informed_ratio: (informed.map(|ratio| ratio * ratio).sum::<f64>() / count).sqrt(),
        covered: covered as f64 / count,
        width: median(numbers.iter().map(|n| n.stated / n.bound).collect()),
        inner_width: median(numbers.iter().map(|n| n.inner_bound / n.bound).collect()),
        median_ratio: median(ratios) / MEDIAN_OF_NORMAL,
    })
}

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    if values.len().is_multiple_of(2) {
        (values[half - 1] + values[half]) / 2.0
    } else {
        values[half]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(error: f64, stated: f64) -> Number {
        Number {
            name: "radius, mm",
            error,
            stated,
            bound: 0.01,
            inner_bound: 0.015,
            informed_error: -0.01,
        }
    }

    #[test]
    fn ratios_are_those_of_the_hand() {
        let numbers = [
            number(0.01, 0.01),
            number(-0.02, 0.012),
            number(0.0, 0.02),
            number(0.02, 0.02),
        ];
        let all: Vec<&Number> = numbers.iter().collect();
        let quality = quality(&all).unwrap();
        assert_eq!(quality.numbers, 4);
        assert!((quality.ratio - 1.5).abs() < 1e-12);
        assert!((quality.inner_width - 1.5).abs() < 1e-12);
        assert!((quality.informed_ratio - 1.0).abs() < 1e-12);
        // 0.02 is within 1.96 times 0.012.
        assert_eq!(quality.covered, 1.0);
        assert!((quality.width - 1.6).abs() < 1e-12);
        assert!((quality.median_ratio - 1.5 / MEDIAN_OF_NORMAL).abs() < 1e-12);
        assert!(super::quality(&[]).is_none());
        let beyond = number(0.02, 0.01);
        assert_eq!(super::quality(&[&beyond]).unwrap().covered, 0.0);
    }

    #[test]
    fn the_median_of_an_even_number_is_between_the_middle_two() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
    }
}
