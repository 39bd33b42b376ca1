//! Cross-sections as they come.

use crate::error::{MOST_MM, SkinError};
use crate::space::{distance, farthest_apart};

/// A cross-section: points in their order along it, millimetres.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// What errors and warnings call it, such as "section 3 (line 40)".
    pub name: String,
    /// Its points.
    pub points: Vec<[f64; 3]>,
    /// Whether the last point is followed by the first.
    pub is_closed: bool,
    /// Whether its sense is known to be that of the others, as of rows of a grid: it is not turned.
    pub is_directed: bool,
}

/// Points nearer than this part of the section's size are one.
const SAME: f64 = 1e-9;

/// A section closes itself if its ends are no farther apart than this many times its widest gap.
const CLOSING: f64 = 1.5;

/// Least number of points.
pub(crate) const LEAST_POINTS: usize = 4;

impl Section {
    /// A section that is closed if its last point is the first again, or as near to it as the
    /// others are to each other.
    #[must_use]
    pub fn by_its_ends(name: String, points: Vec<[f64; 3]>) -> Self {
        let is_closed = match points.as_slice() {
            [first, middle @ .., last] if !middle.is_empty() => {
                let gaps = points.windows(2).map(|pair| distance(pair[0], pair[1]));
                let widest = gaps.fold(0.0, f64::max);
                points.len() >= LEAST_POINTS && distance(*first, *last) <= CLOSING * widest
            }
            _ => false,
        };
        Self {
            name,
            points,
            is_closed,
            is_directed: false,
        }
    }

    /// The points without those that repeat the one before.
    pub(crate) fn distinct(&self) -> Result<Vec<[f64; 3]>, SkinError> {
        let is_bad = |place: &[f64; 3]| place.iter().any(|c| c.is_nan() || c.abs() > MOST_MM);
        if let Some(index) = self.points.iter().position(is_bad) {
            return Err(SkinError::NotFinite {
                section: self.name.clone(),
                index: index + 1,
            });
        }
        let same_mm = SAME * farthest_apart(&self.points);
        let mut points: Vec<[f64; 3]> = Vec::with_capacity(self.points.len());
        for &place in &self.points {
            if points
                .last()
                .is_none_or(|last| distance(*last, place) > same_mm)
            {
                points.push(place);
            }
        }
        if self.is_closed {
            while points.len() > 1 && distance(points[0], points[points.len() - 1]) <= same_mm {
                points.pop();
            }
        }
        if points.len() < LEAST_POINTS {
            return Err(SkinError::TooFewPoints {
                section: self.name.clone(),
                points: points.len(),
            });
        }
        Ok(points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(count: usize, share: f64) -> Vec<[f64; 3]> {
        let angle = |k: usize| core::f64::consts::TAU * share * k as f64 / count as f64;
        (0..count)
            .map(|k| [libm::cos(angle(k)), libm::sin(angle(k)), 0.0])
            .collect()
    }

    #[test]
    fn a_section_is_closed_if_its_ends_are_near() {
        let closed = |points: Vec<[f64; 3]>| Section::by_its_ends("a".into(), points).is_closed;
        assert!(closed(ring(40, 1.0)));
        let mut repeated = ring(40, 1.0);
        repeated.push(repeated[0]);
        assert!(closed(repeated));
        assert!(!closed(ring(40, 0.9)) && !closed(ring(2, 1.0)) && !closed(Vec::new()));
    }

    #[test]
    fn repeated_points_count_once() {
        let mut points = ring(6, 1.0);
        points.insert(3, points[3]);
        points.push(points[0]);
        let section = |points| Section::by_its_ends("a".into(), points);
        assert_eq!(section(points.clone()).distinct().unwrap(), ring(6, 1.0));
        points[4][1] = f64::NAN;
        let error = section(points).distinct().unwrap_err();
        assert_eq!(
            error,
            SkinError::NotFinite {
                section: "a".into(),
                index: 5
            }
        );
        let two = Section {
            name: "b".into(),
            points: ring(2, 1.0),
            is_closed: true,
            is_directed: false,
        };
        let error = two.distinct().unwrap_err();
        assert_eq!(
            error,
            SkinError::TooFewPoints {
                section: "b".into(),
                points: 2
            }
        );
    }
}
