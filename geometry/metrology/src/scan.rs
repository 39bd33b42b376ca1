//! A scan in counts, and what of it a fit looks at.

use nalgebra::Vector3;
use range_image::Calibration;

/// One return, in device counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawSample {
    /// Position of the slide table.
    pub table_counts: i32,
    /// Angle of the ray, or y, as the head has it.
    pub lateral_counts: i32,
    /// Distance along the ray, or z.
    pub range_counts: i32,
}

/// A scan as the scanner sent it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// From counts to millimetres.
    pub calibration: Calibration,
    /// The samples of each column, in the order of the device.
    pub columns: Vec<Vec<RawSample>>,
}

impl Scan {
    /// Every sample in the part frame, column by column in ascending x, and within a column in
    /// ascending y.
    #[must_use]
    pub fn placed(&self) -> Placed {
        let mut columns: Vec<Vec<(RawSample, Vector3<f64>)>> = self
            .columns
            .iter()
            .filter(|column| !column.is_empty())
            .map(|column| {
                let mut placed: Vec<_> = column
                    .iter()
                    .map(|&raw| (raw, position_mm(&self.calibration, raw)))
                    .collect();
                placed.sort_by(|(_, a), (_, b)| a.y.total_cmp(&b.y).then(a.z.total_cmp(&b.z)));
                placed
            })
            .collect();
        columns.sort_by(|a, b| {
            let x = |column: &[(RawSample, Vector3<f64>)]| column.first().map_or(0.0, |(_, p)| p.x);
            x(a).total_cmp(&x(b))
        });
        Placed {
            calibration: self.calibration,
            columns,
        }
    }
}

/// A scan in millimetres.
#[derive(Debug, Clone)]
pub struct Placed {
    pub(crate) calibration: Calibration,
    pub(crate) columns: Vec<Vec<(RawSample, Vector3<f64>)>>,
}

impl Placed {
    /// Columns of which something may lie within these limits of x, millimetres.
    pub(crate) fn columns_within(
        &self,
        low_mm: f64,
        high_mm: f64,
    ) -> &[Vec<(RawSample, Vector3<f64>)>] {
        let x = |column: &Vec<(RawSample, Vector3<f64>)>| column.first().map_or(0.0, |(_, p)| p.x);
        let from = self.columns.partition_point(|column| x(column) < low_mm);
        let to = self.columns.partition_point(|column| x(column) <= high_mm);
        self.columns.get(from..to).unwrap_or_default()
    }
}

/// Samples of a column within these limits of y, millimetres.
pub(crate) fn within(
    column: &[(RawSample, Vector3<f64>)],
    low_mm: f64,
    high_mm: f64,
) -> &[(RawSample, Vector3<f64>)] {
    let from = column.partition_point(|(_, p)| p.y < low_mm);
    let to = column.partition_point(|(_, p)| p.y <= high_mm);
    column.get(from..to).unwrap_or_default()
}

/// A sample in the part frame, millimetres.
pub(crate) fn position_mm(calibration: &Calibration, raw: RawSample) -> Vector3<f64> {
    let at = calibration.position(raw.table_counts, raw.lateral_counts, raw.range_counts);
    Vector3::new(at.x_mm, at.y_mm, at.z_mm)
}

/// Unit direction of the ray that brought a sample, from the camera; straight along -z where the
/// device does not tell where its rays come from.
pub(crate) fn ray(calibration: &Calibration, raw: RawSample) -> Vector3<f64> {
    if calibration.camera_mm().is_none() {
        return Vector3::new(0.0, 0.0, -1.0);
    }
    // The ray is straight, so two ranges along it tell its direction.
    const FAR_COUNTS: i32 = 1 << 20;
    let at = |range_counts| {
        position_mm(
            calibration,
            RawSample {
                range_counts,
                ..raw
            },
        )
    };
    (at(FAR_COUNTS) - at(0)).normalize()
}
