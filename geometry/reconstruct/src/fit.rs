//! Surfaces of regions.

use nurbs::uniform::Lines;
use nurbs::{KnotVector, Observation, PatchSurface, TensorSpline};
use range_image::RangeImage;

use crate::extension::{ExtendedRegion, NodeRectangle, extend};
use crate::refine;

pub use crate::refine::Demand;

/// Degree of the splines over whole rectangles: bi-quadratic, as in section III.
pub const DEGREE: usize = 2;

/// Residuals beyond this many robust standard deviations count as mistakes.
const GROSS: f64 = 8.0;

/// Residuals beyond this many robust standard deviations lose weight.
const HUBER: f64 = 2.5;

/// Why a surface could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The knots were refused.
    #[error(transparent)]
    Knots(#[from] nurbs::KnotError),
    /// The data do not determine the spline.
    #[error(transparent)]
    Singular(#[from] nurbs::Singular),
    /// The patches are not finite.
    #[error(transparent)]
    Patches(#[from] nurbs::PiecewiseError),
    /// No node of the region has a value.
    #[error("no node of the region has a range value")]
    Empty,
}

/// A rectangle in the x-y plane, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// Least and greatest x.
    pub x_mm: (f64, f64),
    /// Least and greatest y.
    pub y_mm: (f64, f64),
}

impl Domain {
    /// The smallest rectangle that holds both.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        let both = |a: (f64, f64), b: (f64, f64)| (a.0.min(b.0), a.1.max(b.1));
        Self {
            x_mm: both(self.x_mm, other.x_mm),
            y_mm: both(self.y_mm, other.y_mm),
        }
    }

    /// Whether the surface covers the rectangle.
    #[must_use]
    pub fn is_within(&self, surface: &PatchSurface) -> bool {
        let covers = |(low, high): (f64, f64), (from, to): (f64, f64)| from <= low && high <= to;
        covers(self.x_mm, surface.u_domain()) && covers(self.y_mm, surface.v_domain())
    }
}

/// Least-squares spline over a full rectangle of nodes with `knots_per_side` distinct
/// uniform knots along each side, the ends included. A side with too few nodes for that
/// gets as many knots as its nodes determine.
///
/// # Errors
/// [`FitError`] when a side has fewer than 3 nodes or a value is not finite.
pub fn rectangle_spline(
    image: &RangeImage,
    region: &ExtendedRegion,
    knots_per_side: usize,
) -> Result<TensorSpline, FitError> {
    let NodeRectangle {
        column_first,
        row_first,
        columns,
        rows,
    } = region.rectangle;
    let at = |origin: f64, first: i64, count: usize| -> Vec<f64> {
        (0..count)
            .map(|k| origin + (first + k as i64) as f64 * image.pitch_mm())
            .collect()
    };
    let (x, y) = (
        at(image.x_mm(0), column_first, columns),
        at(image.y_mm(0), row_first, rows),
    );
    let knots = |places: &[f64]| {
        let (Some(&first), Some(&last)) = (places.first(), places.last()) else {
            return Err(FitError::Empty);
        };
        let spans = (knots_per_side - 1).min(places.len().saturating_sub(DEGREE));
        Ok(KnotVector::uniform(DEGREE, spans, first, last)?)
    };
    let (u, v) = (knots(&x)?, knots(&y)?);
    Ok(TensorSpline::fit_grid(u, v, &x, &y, |i, j| region.z(i, j))?)
}

/// Patches through the nodes of the extended range image (section V): `third` pitches
/// between the points that cut a patch in thirds, breaks uniform, the rectangle the
/// smallest that covers `domain`. With them the number of members that they pass through.
///
/// # Errors
/// [`FitError::Empty`] when no member has a value.
pub fn patches_through_nodes(
    image: &RangeImage,
    member: impl Fn(usize, usize) -> bool,
    domain: &Domain,
    third: usize,
) -> Result<(PatchSurface, usize), FitError> {
    let pitch = image.pitch_mm();
    let cover = |(low, high): (f64, f64), origin: f64| {
        let first = ((low - origin) / pitch).floor() as i64;
        let last = ((high - origin) / pitch).ceil() as i64;
        let side = 3 * third;
        let patches = ((last - first).max(1) as usize).div_ceil(side);
        // The surplus is shared between both ends.
        let first = first - ((patches * side) as i64 - (last - first)) / 2;
        let breaks = (0..=patches)
            .map(|k| origin + (first + (k * side) as i64) as f64 * pitch)
            .collect::<Vec<_>>();
        (first, patches * side + 1, breaks)
    };
    let (column_first, columns, u_breaks) = cover(domain.x_mm, image.x_mm(0));
    let (row_first, rows, v_breaks) = cover(domain.y_mm, image.y_mm(0));
    let rectangle = NodeRectangle {
        column_first,
        row_first,
        columns,
        rows,
    };
    let is_met = |i: usize, j: usize| {
        let column = usize::try_from(column_first + (i * third) as i64);
        let row = usize::try_from(row_first + (j * third) as i64);
        let on_image = column.ok().zip(row.ok());
        on_image.is_some_and(|(column, row)| {
            column < image.columns() && row < image.rows() && member(column, row)
        })
    };
    let lines =
        (0..columns.div_ceil(third)).flat_map(|i| (0..rows.div_ceil(third)).map(move |j| (i, j)));
    let met = lines.filter(|(i, j)| is_met(*i, *j)).count();
    let extended = extend(image, &member, rectangle).ok_or(FitError::Empty)?;
    let surface =
        PatchSurface::through_thirds(u_breaks, v_breaks, |i, j| extended.z(i * third, j * third))?;
    Ok((surface, met))
}

/// Patches of a bicubic spline with continuous curvature, fitted to the observations
/// alone and refined where they ask for it. Few grossly wrong values do not count.
/// Observations should come line by line of equal u. With them the number of coefficients that
/// the observations were asked for.
///
/// # Errors
/// [`FitError`] when the observations lie on a line or are fewer than three.
pub fn patches_from_spline(
    observations: &mut [Observation],
    domain: &Domain,
    demand: &Demand,
) -> Result<(PatchSurface, usize), FitError> {
    let (mut spline, mut parameters) = refine::fit(observations, domain, demand)?;
    let residuals = spline.residuals(&Lines::new(observations));
    if reweigh(&residuals, observations) {
        (spline, parameters) = refine::fit(observations, domain, demand)?;
    }
    Ok((spline.to_patches()?, parameters))
}

/// Gives each observation the weight that its residual leaves it; false when every one
/// keeps full weight.
fn reweigh(residuals: &[f64], observations: &mut [Observation]) -> bool {
    let mut sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return false;
    }
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    // Median absolute deviation to standard deviation of a normal distribution.
    let sigma = 1.4826 * *median;
    if sigma < 1e-12 {
        return false;
    }
    let mut changed = false;
    for (o, r) in observations.iter_mut().zip(residuals) {
        let size = r.abs() / sigma;
        o.weight = if size > GROSS {
            0.0
        } else {
            (HUBER / size).min(1.0)
        };
        changed |= o.weight < 1.0;
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::image::Lattice;

    fn image(z: impl Fn(f64, f64) -> f64) -> RangeImage {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, -20, 10, 60, 50);
        for column in 0..60 {
            for row in 0..50 {
                let z = z(image.x_mm(column), image.y_mm(row));
                image.set_z_mm(column, row, Some(z));
            }
        }
        image
    }

    fn disc(image: &RangeImage) -> impl Fn(usize, usize) -> bool + use<> {
        let _ = image;
        |column, row| {
            let (x, y) = (column as f64 - 30.0, row as f64 - 25.0);
            x * x + y * y < 400.0
        }
    }

    fn domain(image: &RangeImage) -> Domain {
        Domain {
            x_mm: (image.x_mm(8), image.x_mm(52)),
            y_mm: (image.y_mm(3), image.y_mm(47)),
        }
    }

    fn demand(tolerance_mm: f64) -> Demand {
        Demand {
            tolerance_mm,
            noise_density_mm2: 1e-6,
            least_span_mm: 1.0,
            most_spans: 100,
            margin_mm: 3.0,
        }
    }

    fn observations(image: &RangeImage, member: impl Fn(usize, usize) -> bool) -> Vec<Observation> {
        let mut seen = Vec::new();
        for column in 0..image.columns() {
            for row in 0..image.rows() {
                if member(column, row) {
                    seen.push(Observation {
                        u: image.x_mm(column),
                        v: image.y_mm(row),
                        value: image.z_mm(column, row).unwrap(),
                        weight: 1.0,
                    });
                }
            }
        }
        seen
    }

    #[test]
    fn a_plane_is_met_exactly_by_one_patch() {
        let plane = |x: f64, y: f64| 3.0 + 0.4 * x - 0.7 * y;
        let image = image(plane);
        let mut seen = observations(&image, disc(&image));
        let fitted = patches_from_spline(&mut seen, &domain(&image), &demand(0.01)).unwrap();
        let (surface, parameters) = fitted;
        assert_eq!((surface.patches.len(), parameters), (1, 3));
        for o in &seen {
            assert!((surface.z(o.u, o.v) - o.value).abs() < 1e-9);
        }
    }

    #[test]
    fn curvature_brings_knots_and_outliers_do_not_bend() {
        let wave = |x: f64, y: f64| libm::sin(0.4 * x) * libm::cos(0.3 * y);
        let image = image(wave);
        let mut seen = observations(&image, disc(&image));
        for k in (0..seen.len()).step_by(97) {
            seen[k].value += 5.0;
        }
        let (surface, _) = patches_from_spline(&mut seen, &domain(&image), &demand(1e-3)).unwrap();
        let worst = seen
            .iter()
            .map(|o| (surface.z(o.u, o.v) - wave(o.u, o.v)).abs())
            .fold(0.0, f64::max);
        assert!(worst < 0.12, "{worst}");
    }

    #[test]
    fn patches_pass_through_the_nodes() {
        let image = image(|x, y| x * x - y + x * y);
        let member = disc(&image);
        let (surface, met) = patches_through_nodes(&image, &member, &domain(&image), 1).unwrap();
        let places = (0..60).flat_map(|column| (0..50).map(move |row| (column, row)));
        let members = places.filter(|(column, row)| member(*column, *row)).count();
        assert_eq!(met, members);
        // One node in four, or where the disc's rim falls otherwise, about that.
        let (_, met) = patches_through_nodes(&image, &member, &domain(&image), 2).unwrap();
        assert!(
            (4 * met).abs_diff(members) < members / 10,
            "{met} of {members}"
        );
        for column in 12..48 {
            for row in 8..42 {
                if member(column, row) {
                    let z = surface.z(image.x_mm(column), image.y_mm(row));
                    assert!((z - image.z_mm(column, row).unwrap()).abs() < 1e-9);
                }
            }
        }
        assert!(surface.u_domain().0 <= image.x_mm(8) && surface.u_domain().1 >= image.x_mm(52));
    }

    #[test]
    fn a_small_rectangle_gets_fewer_knots() {
        let image = image(|x, y| x + y);
        let rectangle = NodeRectangle {
            column_first: 0,
            row_first: 0,
            columns: 5,
            rows: 40,
        };
        let region = extend(&image, |_, _| true, rectangle).unwrap();
        let spline = rectangle_spline(&image, &region, 26).unwrap();
        assert_eq!(spline.u_knots().breaks().len(), 4);
        assert_eq!(spline.v_knots().breaks().len(), 26);
    }
}
