//! What a smooth profile would cost, to compare a chain with.

use nalgebra::{DMatrix, DVector};

use super::stations::Station;

/// Spans of splines that are looked at: each so many times the last, rounded up.
const NEXT: f64 = 1.4;

/// The least cost of cubic splines with equal spans (weighted squares left, and the price of their
/// numbers), of those with at most `most` numbers.
pub(super) fn smooth(stations: &[Station], price: f64, most: usize) -> f64 {
    let low = stations
        .iter()
        .map(|s| s.s_mm)
        .fold(f64::INFINITY, f64::min);
    let high = stations
        .iter()
        .map(|s| s.s_mm)
        .fold(f64::NEG_INFINITY, f64::max);
    let mut least = f64::INFINITY;
    let mut spans = 1;
    while spans + 3 <= most {
        if let Some(left) = left(stations, low, high, spans) {
            least = least.min(left + price * (spans + 3) as f64);
        }
        spans = (spans as f64 * NEXT).ceil() as usize;
    }
    least
}

/// Weighted squares that the best spline leaves. `None` where stations do not tell all of it.
fn left(stations: &[Station], low: f64, high: f64, spans: usize) -> Option<f64> {
    let numbers = spans + 3;
    let mut matrix = DMatrix::<f64>::zeros(numbers, numbers);
    let mut right = DVector::<f64>::zeros(numbers);
    let terms = |station: &Station| {
        let at = (station.s_mm - low) / (high - low).max(f64::MIN_POSITIVE) * spans as f64;
        let first = (at as usize).min(spans - 1);
        (first, basis(at - first as f64))
    };
    // Squares are of distances along the normal.
    let weight = |station: &Station| station.weight / (1.0 + station.slope * station.slope);
    for station in stations {
        let (first, terms) = terms(station);
        for (i, a) in terms.iter().enumerate() {
            right[first + i] += weight(station) * a * station.t_mm;
            for (j, b) in terms.iter().enumerate() {
                matrix[(first + i, first + j)] += weight(station) * a * b;
            }
        }
    }
    let solved = matrix.cholesky()?.solve(&right);
    let square = |station: &Station| {
        let (first, terms) = terms(station);
        let told = (0..4).map(|k| terms[k] * solved[first + k]).sum::<f64>();
        weight(station) * (station.t_mm - told).powi(2)
    };
    Some(stations.iter().map(square).sum())
}

/// The four cubic B-splines of a span, so far along it.
fn basis(u: f64) -> [f64; 4] {
    let v = 1.0 - u;
    let (u2, u3) = (u * u, u * u * u);
    [
        v * v * v / 6.0,
        (3.0 * u3 - 6.0 * u2 + 4.0) / 6.0,
        (3.0 * (u + u2 - u3) + 1.0) / 6.0,
        u3 / 6.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stations(t_mm: impl Fn(f64) -> f64) -> Vec<Station> {
        let station = |k: u32| {
            let s_mm = 0.2 * f64::from(k);
            Station {
                s_mm,
                t_mm: t_mm(s_mm),
                slope: 0.0,
                weight: 1e5,
            }
        };
        (0..200).map(station).collect()
    }

    #[test]
    fn a_cubic_needs_four_numbers_and_a_crease_many() {
        let cubic = smooth(&stations(|s| 0.001 * s * s * s - 0.2 * s), 10.0, 100);
        assert!((cubic - 40.0).abs() < 1e-3, "{cubic}");
        let crease = smooth(&stations(|s| 0.1 * (s - 17.3).abs()), 10.0, 100);
        assert!(crease > 200.0, "{crease}");
        assert_eq!(smooth(&stations(|_| 0.0), 10.0, 3), f64::INFINITY);
    }
}
