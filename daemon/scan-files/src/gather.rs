//! Points as they come out of a parser.

use crate::error::{Place, ScanFileError};
use crate::lattice::lattice_counts;
use crate::units::Units;
use crate::{LATTICE_MM, ReadOptions};

/// A point in lattice counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Point {
    pub(crate) x: i32,
    pub(crate) y: i32,
    pub(crate) z: i32,
    /// Bits of the file's intensity, a non-negative `f32`, whose order they share.
    intensity_bits: u32,
}

/// Stands for "no intensity given": above the bits of every finite `f32`.
const NO_INTENSITY: u32 = u32::MAX;

impl Point {
    /// The intensity in the file's own scale.
    pub(crate) fn intensity(&self) -> Option<f32> {
        (self.intensity_bits != NO_INTENSITY).then(|| f32::from_bits(self.intensity_bits))
    }
}

/// Collects points and notes for one file.
pub(crate) struct Gather<'a> {
    pub(crate) file: &'a str,
    pub(crate) options: &'a ReadOptions,
    pub(crate) points: Vec<Point>,
    pub(crate) notes: Vec<String>,
    /// Points left out since a coordinate was no finite number, and the first of them.
    pub(crate) unmeasured: usize,
    pub(crate) first_unmeasured: Option<Place>,
}

impl<'a> Gather<'a> {
    pub(crate) fn new(file: &'a str, options: &'a ReadOptions) -> Result<Self, ScanFileError> {
        if let Some(pitch_mm) = options.column_pitch_mm
            && !(pitch_mm.is_finite() && pitch_mm >= 10.0 * LATTICE_MM)
        {
            return Err(ScanFileError::ColumnPitch { pitch_mm });
        }
        Ok(Self {
            file,
            options,
            points: Vec::new(),
            notes: Vec::new(),
            unmeasured: 0,
            first_unmeasured: None,
        })
    }

    /// Takes a point in the file's units. Points without a measurement, which many
    /// programs write as NaN, are counted and left out.
    pub(crate) fn push(
        &mut self,
        xyz: [f64; 3],
        intensity: Option<f64>,
        units: Units,
        place: Place,
    ) -> Result<(), ScanFileError> {
        // Those without a measurement take no memory, but time.
        if self.points.len() + self.unmeasured >= self.options.max_points {
            return Err(ScanFileError::TooManyPoints {
                file: self.file.to_owned(),
                limit: self.options.max_points,
            });
        }
        if xyz.iter().any(|value| !value.is_finite()) {
            self.unmeasured += 1;
            self.first_unmeasured.get_or_insert(place);
            return Ok(());
        }
        let mut counts = [0; 3];
        for (count, value) in counts.iter_mut().zip(xyz) {
            let value_mm = value * units.in_mm();
            *count = lattice_counts(value_mm).ok_or_else(|| ScanFileError::TooFar {
                file: self.file.to_owned(),
                place,
                value_mm,
            })?;
        }
        let [x, y, z] = counts;
        let intensity_bits = intensity.map_or(NO_INTENSITY, |value| {
            // `max` also turns NaN and -0 into 0, so that bits order as values do.
            ((value as f32).max(0.0) + 0.0).min(f32::MAX).to_bits()
        });
        self.points.push(Point {
            x,
            y,
            z,
            intensity_bits,
        });
        Ok(())
    }

    pub(crate) fn note(&mut self, text: impl Into<String>) {
        self.notes.push(text.into());
    }
}
