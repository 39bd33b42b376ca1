//! What is looked for, and how a sample moves with it.

use nalgebra::{SMatrix, Vector3};
use range_image::calibration::Head;
use range_image::correction::DEVIATIONS;
use range_image::{Calibration, Correction};

use crate::scan::RawSample;

/// Unknowns of the scanner: the deviations of a [`Correction`], and the lean of the laser plane
/// against the frame in which places are known.
pub const UNKNOWNS: usize = DEVIATIONS + 2;

/// One of the unknowns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Deviation {
    /// [`Correction::angle_offset_rad`].
    AngleOffset,
    /// [`Correction::angle_scale`].
    AngleScale,
    /// [`Correction::range_offset_mm`].
    RangeOffset,
    /// [`Correction::range_scale`].
    RangeScale,
    /// x of [`Correction::camera_mm`].
    CameraX,
    /// y of [`Correction::camera_mm`].
    CameraY,
    /// z of [`Correction::camera_mm`].
    CameraZ,
    /// [`Correction::table_y_rad`].
    TableY,
    /// [`Correction::table_z_rad`].
    TableZ,
    /// [`Correction::table_scale`].
    TableScale,
    /// The laser plane is turned about y against the frame of the known places. Told, but not
    /// corrected: parts are told in the plane's frame.
    PlaneAboutY,
    /// The laser plane is turned about z against the frame of the known places. Told, but not
    /// corrected.
    PlaneAboutZ,
}

/// What a deviation is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Radians.
    Radians,
    /// Millimetres.
    Millimetres,
    /// A share of one.
    Share,
}

impl Deviation {
    /// All of them, in the order of their index.
    pub const ALL: [Self; UNKNOWNS] = [
        Self::AngleOffset,
        Self::AngleScale,
        Self::RangeOffset,
        Self::RangeScale,
        Self::CameraX,
        Self::CameraY,
        Self::CameraZ,
        Self::TableY,
        Self::TableZ,
        Self::TableScale,
        Self::PlaneAboutY,
        Self::PlaneAboutZ,
    ];

    /// Those that spheres at unknown places can tell come first, and of two that can hardly be
    /// told from each other the one that more often is not zero.
    pub(crate) const BY_IMPORTANCE: [Self; UNKNOWNS] = [
        Self::AngleScale,
        Self::TableScale,
        Self::RangeScale,
        Self::TableY,
        Self::TableZ,
        Self::CameraX,
        Self::CameraY,
        Self::CameraZ,
        Self::AngleOffset,
        Self::PlaneAboutY,
        Self::PlaneAboutZ,
        Self::RangeOffset,
    ];

    pub(crate) fn index(self) -> usize {
        self as usize
    }

    /// Its name, for people and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::AngleOffset => "angle offset",
            Self::AngleScale => "angle scale",
            Self::RangeOffset => "range offset",
            Self::RangeScale => "range scale",
            Self::CameraX => "camera x",
            Self::CameraY => "camera y",
            Self::CameraZ => "camera z",
            Self::TableY => "table towards y",
            Self::TableZ => "table towards z",
            Self::TableScale => "table scale",
            Self::PlaneAboutY => "laser plane about y",
            Self::PlaneAboutZ => "laser plane about z",
        }
    }

    /// What it is measured in.
    #[must_use]
    pub fn unit(self) -> Unit {
        match self {
            Self::AngleOffset
            | Self::TableY
            | Self::TableZ
            | Self::PlaneAboutY
            | Self::PlaneAboutZ => Unit::Radians,
            Self::RangeOffset | Self::CameraX | Self::CameraY | Self::CameraZ => Unit::Millimetres,
            Self::AngleScale | Self::RangeScale | Self::TableScale => Unit::Share,
        }
    }

    /// How large it may well be in a scanner that was mounted with care, in its unit. What is
    /// known no better than to a tenth of this counts as not determined: zero is as good a guess.
    #[must_use]
    pub fn usual(self) -> f64 {
        const DEGREE: f64 = core::f64::consts::PI / 180.0;
        match self.unit() {
            Unit::Radians => DEGREE,
            Unit::Share => 0.01,
            Unit::Millimetres => match self {
                Self::RangeOffset => 2.0,
                _ => 5.0,
            },
        }
    }

    /// Why scans may not tell it, and what to scan.
    #[must_use]
    pub fn advice(self) -> &'static str {
        match self {
            Self::AngleOffset
            | Self::CameraX
            | Self::CameraY
            | Self::CameraZ
            | Self::PlaneAboutY
            | Self::PlaneAboutZ => {
                "it moves or turns all that is seen as one, so no size depends on it; spheres at \
                 known places tell it: four or more, not in one plane"
            }
            Self::RangeOffset => {
                "it shows only in how sizes change with the distance; scan the sphere as near to \
                 and as far from the camera as its range allows"
            }
            Self::AngleScale | Self::RangeScale | Self::TableScale => {
                "scan the sphere with more samples on it, or at more places"
            }
            Self::TableY | Self::TableZ => "scan the sphere with closer columns, or at more places",
        }
    }
}

/// Values of the unknowns, in the order of [`Deviation::ALL`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviations(pub [f64; UNKNOWNS]);

impl Deviations {
    /// One of them, in its unit.
    #[must_use]
    pub fn get(&self, deviation: Deviation) -> f64 {
        self.0.get(deviation.index()).copied().unwrap_or_default()
    }

    /// What of them is corrected.
    #[must_use]
    pub fn correction(&self) -> Correction {
        let mut numbers = [0.0; DEVIATIONS];
        for (number, value) in numbers.iter_mut().zip(self.0) {
            *number = value;
        }
        Correction::from_array(numbers)
    }

    /// A place of the reference in the frame of the laser plane, and how it moves with the plane's
    /// lean about y and about z.
    pub(crate) fn seen_from_plane(
        &self,
        place_mm: Vector3<f64>,
    ) -> (Vector3<f64>, [Vector3<f64>; 2]) {
        let (sin_y, cos_y) = libm::sincos(self.get(Deviation::PlaneAboutY));
        let (sin_z, cos_z) = libm::sincos(self.get(Deviation::PlaneAboutZ));
        // The transpose of Rz Ry: back about z, then about y.
        let about_z = |p: Vector3<f64>| {
            Vector3::new(cos_z * p.x + sin_z * p.y, cos_z * p.y - sin_z * p.x, p.z)
        };
        let about_y = |p: Vector3<f64>| {
            Vector3::new(cos_y * p.x - sin_y * p.z, p.y, sin_y * p.x + cos_y * p.z)
        };
        let level = about_z(place_mm);
        let by_y = Vector3::new(
            -sin_y * level.x - cos_y * level.z,
            0.0,
            cos_y * level.x - sin_y * level.z,
        );
        let by_z = about_y(Vector3::new(level.y, -level.x, 0.0));
        (about_y(level), [by_y, by_z])
    }
}

/// How a sample in the part frame moves with each of the deviations that are corrected,
/// millimetres per unit; `range` is its range in counts and parts of counts.
#[must_use]
pub fn derivatives(
    announced: &Calibration,
    correction: &Correction,
    raw: RawSample,
    range: f64,
) -> SMatrix<f64, 3, DEVIATIONS> {
    let mut columns = [[0.0; 3]; DEVIATIONS];
    let lateral = f64::from(raw.lateral_counts);
    let in_plane = |[y, z]: [f64; 2]| [0.0, y, z];
    let (by_angle, by_angle_scale, by_offset, by_range_scale) = match announced.head {
        Head::Polar {
            angle_count_rad,
            range_count_mm,
            ..
        } => {
            let angle_rad = lateral * angle_count_rad;
            let range_mm = range * range_count_mm;
            let (sin, cos) = libm::sincos(
                correction.angle_offset_rad + (1.0 + correction.angle_scale) * angle_rad,
            );
            let far_mm = correction.range_offset_mm + (1.0 + correction.range_scale) * range_mm;
            (
                [far_mm * cos, far_mm * sin],
                [far_mm * angle_rad * cos, far_mm * angle_rad * sin],
                [sin, -cos],
                [range_mm * sin, -range_mm * cos],
            )
        }
        Head::Cartesian { count_mm } => {
            let (sin, cos) = libm::sincos(correction.angle_offset_rad);
            let (y_mm, z_mm) = (lateral * count_mm, range * count_mm);
            let (wide_mm, deep_mm) = (
                (1.0 + correction.angle_scale) * y_mm,
                (1.0 + correction.range_scale) * z_mm,
            );
            (
                [
                    -wide_mm * sin - deep_mm * cos,
                    wide_mm * cos - deep_mm * sin,
                ],
                [y_mm * cos, y_mm * sin],
                [0.0, 0.0],
                [-z_mm * sin, z_mm * cos],
            )
        }
    };
    let travelled_mm = announced.as_announced().x_mm(raw.table_counts);
    let (sin_y, cos_y) = libm::sincos(correction.table_y_rad);
    let (sin_z, cos_z) = libm::sincos(correction.table_z_rad);
    let far_mm = travelled_mm * (1.0 + correction.table_scale);
    for (deviation, column) in [
        (Deviation::AngleOffset, in_plane(by_angle)),
        (Deviation::AngleScale, in_plane(by_angle_scale)),
        (Deviation::RangeOffset, in_plane(by_offset)),
        (Deviation::RangeScale, in_plane(by_range_scale)),
        (Deviation::CameraX, [1.0, 0.0, 0.0]),
        (Deviation::CameraY, [0.0, 1.0, 0.0]),
        (Deviation::CameraZ, [0.0, 0.0, 1.0]),
        (
            Deviation::TableY,
            [-far_mm * sin_y * cos_z, far_mm * cos_y * cos_z, 0.0],
        ),
        (
            Deviation::TableZ,
            [
                -far_mm * cos_y * sin_z,
                -far_mm * sin_y * sin_z,
                far_mm * cos_z,
            ],
        ),
        (
            Deviation::TableScale,
            [
                travelled_mm * cos_y * cos_z,
                travelled_mm * sin_y * cos_z,
                travelled_mm * sin_z,
            ],
        ),
    ] {
        if let Some(slot) = columns.get_mut(deviation.index()) {
            *slot = column;
        }
    }
    SMatrix::from_fn(|row, column| columns[column][row])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::position_mm;

    const POLAR: Head = Head::Polar {
        camera_y_mm: 5.0,
        camera_z_mm: 750.0,
        angle_count_rad: 1e-6,
        range_count_mm: 0.1,
    };

    fn somewhere() -> [f64; UNKNOWNS] {
        [
            0.02, -0.007, 1.3, 0.004, 0.3, -2.0, 1.5, 0.013, -0.009, 0.003, 0.011, -0.017,
        ]
    }

    fn calibration(head: Head, deviations: &Deviations) -> Calibration {
        Calibration {
            table_origin_mm: -60.0,
            table_count_mm: 0.01,
            head,
            correction: Some(deviations.correction()),
        }
    }

    #[test]
    fn derivatives_are_those_of_the_calibration() {
        let deviations = Deviations(somewhere());
        let samples = [(9_000, 40_000, 7_200), (300, -55_000, 7_900)];
        for head in [POLAR, Head::Cartesian { count_mm: 0.01 }] {
            for (table_counts, lateral_counts, range_counts) in samples {
                let raw = RawSample {
                    table_counts,
                    lateral_counts,
                    range_counts,
                };
                let own = calibration(head, &deviations);
                let closed =
                    derivatives(&own, &deviations.correction(), raw, f64::from(range_counts));
                for index in 0..DEVIATIONS {
                    let step = 1e-5;
                    let at = |side: f64| {
                        let mut moved = deviations;
                        moved.0[index] += side * step;
                        position_mm(&calibration(head, &moved), raw)
                    };
                    let slope = (at(1.0) - at(-1.0)) / (2.0 * step);
                    let off = (slope - closed.column(index)).norm();
                    let size = slope.norm().max(1.0);
                    assert!(off < 1e-6 * size, "{head:?} {index}: {slope} {closed}");
                }
            }
        }
    }

    #[test]
    fn places_move_with_the_planes_lean_as_told() {
        let deviations = Deviations(somewhere());
        let place = Vector3::new(30.0, -20.0, 11.0);
        let (seen, by) = deviations.seen_from_plane(place);
        assert!((seen.norm() - place.norm()).abs() < 1e-12, "it is turned");
        for (deviation, by) in [Deviation::PlaneAboutY, Deviation::PlaneAboutZ]
            .into_iter()
            .zip(by)
        {
            let step = 1e-5;
            let at = |side: f64| {
                let mut moved = deviations;
                moved.0[deviation.index()] += side * step;
                moved.seen_from_plane(place).0
            };
            let slope = (at(1.0) - at(-1.0)) / (2.0 * step);
            assert!((slope - by).norm() < 1e-7, "{deviation:?}");
        }
    }
}
