//! The comparison of section III (Table 1): a region's spline over its rectangle with
//! the background in it, as Naik & Jain 1988 fit it, and over its extension.

use nurbs::TensorSpline;
use range_image::{RangeImage, RegionMap};

use crate::extension::{ExtendedRegion, bounding_rectangle, extend};
use crate::fit::{FitError, rectangle_spline};
use crate::metrics::{RangeScale, psnr_db};

/// Distinct knots along each side of the rectangle: the paper's "26 nodes".
pub const TABLE_1_KNOTS: usize = 26;

/// A row of Table 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// The region.
    pub label: u16,
    /// Peak signal-to-noise ratio at the region's nodes with the background in the
    /// rectangle, decibels. The background's range value R is 0, which puts it 0.75 m
    /// behind the middle of the scan.
    pub background_psnr_db: f64,
    /// The same with the region extended instead.
    pub extended_psnr_db: f64,
}

/// One region made into a full rectangle, and the spline fitted over it.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedRectangle {
    /// What the spline was fitted to.
    pub region: ExtendedRegion,
    /// Bi-quadratic, with [`TABLE_1_KNOTS`] knots a side.
    pub spline: TensorSpline,
}

/// Both ways of making a region into a rectangle.
#[derive(Debug, Clone, PartialEq)]
pub struct BothWays {
    /// With the background around the region, as Naik & Jain 1988.
    pub background: FittedRectangle,
    /// With the region extended.
    pub extended: FittedRectangle,
}

/// Fits one region both ways, bi-quadratic splines with [`TABLE_1_KNOTS`] knots a side.
///
/// # Errors
/// [`FitError`] when the region has no node, or fewer than three along a side.
pub fn fit_both_ways(
    image: &RangeImage,
    map: &RegionMap,
    label: u16,
) -> Result<BothWays, FitError> {
    let member = |column: usize, row: usize| map.label(column, row) == label;
    let rectangle = bounding_rectangle(image, member).ok_or(FitError::Empty)?;
    let extended = extend(image, member, rectangle).ok_or(FitError::Empty)?;
    let background = RangeScale::of(image)
        .ok_or(FitError::Empty)?
        .background_mm();
    let mut flat = extended.clone();
    for (k, z) in flat.z_mm.iter_mut().enumerate() {
        let column = k / rectangle.rows + rectangle.column_first as usize;
        let row = k % rectangle.rows + rectangle.row_first as usize;
        if !member(column, row) {
            *z = background;
        }
    }
    let fitted = |region: ExtendedRegion| -> Result<FittedRectangle, FitError> {
        let spline = rectangle_spline(image, &region, TABLE_1_KNOTS)?;
        Ok(FittedRectangle { region, spline })
    };
    Ok(BothWays {
        background: fitted(flat)?,
        extended: fitted(extended)?,
    })
}

/// Fits one region both ways, and holds the splines against the range image at the region's
/// nodes.
///
/// # Errors
/// As [`fit_both_ways`].
pub fn compare(image: &RangeImage, map: &RegionMap, label: u16) -> Result<Comparison, FitError> {
    let both = fit_both_ways(image, map, label)?;
    let ratio = |fitted: &FittedRectangle| {
        let (mut sum, mut count) = (0.0, 0.0);
        for column in 0..image.columns() {
            for row in (0..image.rows()).filter(|&row| map.label(column, row) == label) {
                if let Some(z) = image.z_mm(column, row) {
                    let off = fitted.spline.value(image.x_mm(column), image.y_mm(row)) - z;
                    sum += off * off;
                    count += 1.0;
                }
            }
        }
        psnr_db(f64::sqrt(sum / count))
    };
    Ok(Comparison {
        label,
        background_psnr_db: ratio(&both.background),
        extended_psnr_db: ratio(&both.extended),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::image::Lattice;

    #[test]
    fn extension_wins_by_tens_of_decibels() {
        let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, 0, 0, 80, 80);
        let mut labels = vec![0; 80 * 80];
        for column in 0..80 {
            for row in 0..80 {
                let (x, y) = (column as f64 - 39.5, row as f64 - 39.5);
                if x * x + y * y < 38.0 * 38.0 {
                    image.set_z_mm(column, row, Some(0.2 * x - 0.1 * y));
                    labels[column * 80 + row] = 1;
                }
            }
        }
        let map = RegionMap::new(&image, labels);
        let row = compare(&image, &map, 1).unwrap();
        assert!((20.0..45.0).contains(&row.background_psnr_db), "{row:?}");
        assert!(
            row.extended_psnr_db > row.background_psnr_db + 25.0,
            "{row:?}"
        );
        assert!(compare(&image, &map, 9).is_err());
    }
}
