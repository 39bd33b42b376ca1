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

/// The ray that brought a sample.
///
/// A scanner errs along its rays far more than across them: encoders know the angle and the
/// table's place. So residuals are taken along the ray, to where it should have met the reference,
/// and the slopes are those of that place. To the nearest point of the surface, from wherever noise
/// put the sample, would be biased by about (noise / radius)^2 (Al-Sharadqah and Chernov 2009),
/// which is more than many samples leave of the noise itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where the range is 0, millimetres.
    pub origin_mm: Vector3<f64>,
    /// Unit direction away from the camera; straight along -z where the device does not tell where
    /// its rays come from.
    pub along: Vector3<f64>,
    /// Way along it for a range count, millimetres.
    pub count_mm: f64,
}

impl Ray {
    pub(crate) fn of(calibration: &Calibration, raw: RawSample) -> Self {
        // The ray is straight, so two ranges along it tell its direction.
        const FAR_COUNTS: i32 = 1 << 20;
        let at = |range_counts| {
            let raw = RawSample {
                range_counts,
                ..raw
            };
            position_mm(calibration, raw)
        };
        let origin_mm = at(0);
        let far = at(FAR_COUNTS) - origin_mm;
        let long_mm = far.norm();
        let sign = if far.z > 0.0 { -1.0 } else { 1.0 };
        Self {
            origin_mm,
            along: far * (sign / long_mm),
            count_mm: sign * long_mm / f64::from(FAR_COUNTS),
        }
    }

    /// How far from a point it passes by, millimetres.
    pub(crate) fn passes_by_mm(&self, point_mm: Vector3<f64>) -> f64 {
        let to = point_mm - self.origin_mm;
        (to - self.along * to.dot(&self.along)).norm()
    }

    /// Where it meets a sphere, with the unit normal there; `None` where it passes by.
    pub(crate) fn meets(&self, centre_mm: Vector3<f64>, radius_mm: f64) -> Option<Met> {
        let to = centre_mm - self.origin_mm;
        let along_mm = to.dot(&self.along);
        let beside_squared = (to - self.along * along_mm).norm_squared();
        let half_squared = radius_mm * radius_mm - beside_squared;
        if half_squared <= 0.0 {
            return None;
        }
        let range_mm = along_mm - libm::sqrt(half_squared);
        let point_mm = self.origin_mm + self.along * range_mm;
        Some(Met {
            range_mm,
            normal: (point_mm - centre_mm) / radius_mm,
        })
    }
}

/// Where a ray should have met a reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Met {
    /// Way along the ray, millimetres.
    pub(crate) range_mm: f64,
    /// Unit normal of the reference there.
    pub(crate) normal: Vector3<f64>,
}

impl Met {
    /// Distance of a sample from the reference's tangent plane there, positive outside,
    /// millimetres.
    pub(crate) fn off_mm(&self, ray: &Ray, point_mm: Vector3<f64>) -> f64 {
        self.normal.dot(&ray.along) * ((point_mm - ray.origin_mm).dot(&ray.along) - self.range_mm)
    }

    /// The range counts of that place.
    pub(crate) fn range_counts(&self, ray: &Ray) -> f64 {
        self.range_mm / ray.count_mm
    }
}
