//! The comparison of section III (Table 1): a region's spline over its rectangle with
//! the background in it, as Naik & Jain 1988 fit it, and over its extension.

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

/// Fits one region both ways, bi-quadratic splines with [`TABLE_1_KNOTS`] knots a side.
///
/// # Errors
/// [`FitError`] when the region has no node, or fewer than three along a side.
pub fn compare(image: &RangeImage, map: &RegionMap, label: u16) -> Result<Comparison, FitError> {
    let member = |column: usize, row: usize| map.label(column, row) == label;
    let rectangle = bounding_rectangle(image, member).ok_or(FitError::Empty)?;
    let extended = extend(image, member, rectangle).ok_or(FitError::Empty)?;
    let background = RangeScale::of(image)
        .ok_or(FitError::Empty)?
        .background_mm();
    let mut flat = extended.clone();
    let nodes: Vec<(usize, usize)> = (0..rectangle.columns)
        .flat_map(|c| (0..rectangle.rows).map(move |r| (c, r)))
        .collect();
    let address = |(c, r): (usize, usize)| {
        (
            c + rectangle.column_first as usize,
            r + rectangle.row_first as usize,
        )
    };
    for (z, &node) in flat.z_mm.iter_mut().zip(&nodes) {
        let (column, row) = address(node);
        if !member(column, row) {
            *z = background;
        }
    }
    let ratio = |region: &ExtendedRegion| -> Result<f64, FitError> {
        let spline = rectangle_spline(image, region, TABLE_1_KNOTS)?;
        let (mut sum, mut count) = (0.0, 0.0);
        for &node in &nodes {
            let (column, row) = address(node);
            if let (true, Some(z)) = (member(column, row), image.z_mm(column, row)) {
                let off = spline.value(image.x_mm(column), image.y_mm(row)) - z;
                sum += off * off;
                count += 1.0;
            }
        }
        Ok(psnr_db(f64::sqrt(sum / count)))
    };
    Ok(Comparison {
        label,
        background_psnr_db: ratio(&flat)?,
        extended_psnr_db: ratio(&extended)?,
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
