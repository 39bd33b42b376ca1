//! Rational splines.

use nalgebra::Vector4;
use nurbs::KnotVector;

use crate::Point;

/// Places of a curve in each span for each degree, where it is asked which one is near.
const PER_DEGREE: usize = 8;

/// A rational B-spline curve.
#[derive(Debug, Clone, PartialEq)]
pub struct SplineCurve {
    knots: KnotVector,
    /// Control points times their weights, and the weights.
    controls: Vec<Vector4<f64>>,
}

/// A rational B-spline surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SplineSurface {
    knots: [KnotVector; 2],
    /// As of a curve, v running fastest.
    controls: Vec<Vector4<f64>>,
}

fn weighted(points: &[Point], weights: &[f64]) -> Option<Vec<Vector4<f64>>> {
    let is_sound = |w: &f64| *w > 0.0 && w.is_finite();
    if points.len() != weights.len() || !weights.iter().all(is_sound) {
        return None;
    }
    let control = |(p, w): (&Point, &f64)| Vector4::new(p.x * w, p.y * w, p.z * w, *w);
    Some(points.iter().zip(weights).map(control).collect())
}

/// A point and its derivative from those of weighted coordinates.
fn projected(value: &Vector4<f64>, derivative: &Vector4<f64>) -> (Point, Point) {
    let at = value.xyz() / value.w;
    (at, (derivative.xyz() - at * derivative.w) / value.w)
}

/// Knots in ascending order, some of them equal; those at the ends need not be.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots {
    /// Degree of the spline.
    pub degree: usize,
    /// As many as control points, and one more than the degree.
    pub values: Vec<f64>,
}

/// Knots and rows of control points that end where the spline does, by insertion of the knots
/// there (Boehm). `None` where they make no spline.
fn clamped(
    knots: &Knots,
    mut rows: Vec<Vec<Vector4<f64>>>,
) -> Option<(KnotVector, Vec<Vec<Vector4<f64>>>)> {
    let p = knots.degree;
    let mut values = knots.values.clone();
    let count = rows.first()?.len();
    let is_sound = p > 0
        && count > p
        && values.len() == count + p + 1
        && values.iter().all(|v| v.is_finite())
        && values.windows(2).all(|pair| pair[0] <= pair[1]);
    if !is_sound {
        return None;
    }
    let (first, last) = (values[p], values[count]);
    for end in [first, last] {
        let at = |values: &[f64]| values.iter().filter(|v| **v == end).count();
        while at(&values) < p {
            // The span that begins with the last knot not above it, or ends with it.
            let span = values.partition_point(|v| *v <= end) - 1;
            for row in &mut rows {
                let mut next = Vec::with_capacity(row.len() + 1);
                for i in 0..=row.len() {
                    let share = if i + p <= span {
                        1.0
                    } else if i > span {
                        0.0
                    } else {
                        (end - values[i]) / (values[i + p] - values[i])
                    };
                    let before = if i > 0 { row[i - 1] } else { Vector4::zeros() };
                    let own = row.get(i).copied().unwrap_or_default();
                    next.push(own * share + before * (1.0 - share));
                }
                *row = next;
            }
            values.insert(span + 1, end);
        }
    }
    // What lies before and behind is of no use any more.
    let from = values.partition_point(|v| *v < first);
    let own_first = values.iter().filter(|v| **v == first).count();
    let begin = from + own_first - p;
    let to = values.partition_point(|v| *v < last) + p;
    let mut inner = vec![first];
    inner.extend_from_slice(values.get(begin..to)?);
    inner.push(last);
    let controls = inner.len() - p - 1;
    let start = begin.checked_sub(1).map_or(0, |k| k);
    for row in &mut rows {
        *row = row.get(start..start + controls)?.to_vec();
    }
    Some((KnotVector::new(p, inner).ok()?, rows))
}

/// Values from one to another in equal steps.
pub(crate) fn spread(low: f64, high: f64, count: usize) -> impl Iterator<Item = f64> {
    (0..=count).map(move |k| low + (high - low) * k as f64 / count as f64)
}

/// Each break, and so many equal steps from it to the next.
pub(crate) fn spread_in_spans(breaks: &[f64], count: usize) -> Vec<f64> {
    let spans = breaks.windows(2);
    let mut all: Vec<f64> = spans
        .flat_map(|pair| spread(pair[0], pair[1], count).take(count))
        .collect();
    all.extend(breaks.last());
    all
}

impl SplineCurve {
    /// `None` where numbers of knots, points and weights do not match, the knots make no spline, or
    /// a weight is not above zero.
    #[must_use]
    pub fn new(knots: &Knots, points: &[Point], weights: &[f64]) -> Option<Self> {
        let (knots, mut rows) = clamped(knots, vec![weighted(points, weights)?])?;
        let controls = rows.pop()?;
        Some(Self { knots, controls })
    }

    pub(crate) fn domain(&self) -> (f64, f64) {
        self.knots.domain()
    }

    /// Parameters that every bend has some of.
    pub(crate) fn places(&self) -> Vec<f64> {
        spread_in_spans(&self.knots.breaks(), PER_DEGREE * self.knots.degree())
    }

    pub(crate) fn breaks(&self) -> Vec<f64> {
        self.knots.breaks()
    }

    fn weighted_at(&self, t: f64, order: usize) -> Vector4<f64> {
        let basis = self.knots.basis_derivative(t, order);
        let controls = self.controls.iter().skip(basis.first);
        let values = basis.values.iter().take(self.knots.degree() + 1);
        controls.zip(values).map(|(c, b)| c * *b).sum()
    }

    /// The point at a parameter, and the derivative there.
    pub(crate) fn at(&self, t: f64) -> (Point, Point) {
        projected(&self.weighted_at(t, 0), &self.weighted_at(t, 1))
    }
}

impl SplineSurface {
    /// As [`SplineCurve::new`]; `v` runs fastest among points and weights.
    #[must_use]
    pub fn new(knots: &[Knots; 2], points: &[Point], weights: &[f64]) -> Option<Self> {
        let controls = weighted(points, weights)?;
        let width = knots[1].values.len().checked_sub(knots[1].degree + 1)?;
        if width == 0 || controls.len() % width != 0 {
            return None;
        }
        let rows = controls.chunks(width).map(<[_]>::to_vec).collect();
        let (along_v, rows) = clamped(&knots[1], rows)?;
        let columns = (0..along_v.control_count()).map(|k| rows.iter().map(|row| row[k]).collect());
        let (along_u, columns) = clamped(&knots[0], columns.collect())?;
        let rows = (0..along_u.control_count()).flat_map(|k| columns.iter().map(move |c| c[k]));
        Some(Self {
            controls: rows.collect(),
            knots: [along_u, along_v],
        })
    }

    pub(crate) fn domain(&self, axis: usize) -> (f64, f64) {
        self.knots[axis].domain()
    }

    pub(crate) fn degree(&self, axis: usize) -> usize {
        self.knots[axis].degree()
    }

    pub(crate) fn breaks(&self, axis: usize) -> Vec<f64> {
        self.knots[axis].breaks()
    }

    fn weighted_at(&self, [u, v]: [f64; 2], [p, q]: [usize; 2]) -> Vector4<f64> {
        let (of_u, of_v) = (
            self.knots[0].basis_derivative(u, p),
            self.knots[1].basis_derivative(v, q),
        );
        let width = self.knots[1].control_count();
        let mut sum = Vector4::zeros();
        for (k, b) in of_u
            .values
            .iter()
            .take(self.knots[0].degree() + 1)
            .enumerate()
        {
            let row = self
                .controls
                .iter()
                .skip((of_u.first + k) * width + of_v.first);
            let values = of_v.values.iter().take(self.knots[1].degree() + 1);
            sum += row.zip(values).map(|(c, b)| c * *b).sum::<Vector4<f64>>() * *b;
        }
        sum
    }

    /// The point at parameters, and the derivatives there.
    pub(crate) fn at(&self, place: [f64; 2]) -> (Point, [Point; 2]) {
        let value = self.weighted_at(place, [0, 0]);
        let (at, along_u) = projected(&value, &self.weighted_at(place, [1, 0]));
        let (_, along_v) = projected(&value, &self.weighted_at(place, [0, 1]));
        (at, [along_u, along_v])
    }
}
