//! Scan files of other programs (text and PLY, plain or gzip-compressed) read into columns.
//!
//! [`read`] takes a path, [`read_from`] any byte source, [`from_points_mm`] points that
//! another reader has found. All three end in the same [`PointScan`], whatever the order
//! of the points in the file:
//!
//! 1. Coordinates become millimetres ([`Units`]) and are rounded to a lattice of 10 nm
//!    ([`LATTICE_MM`]), so that a file read here and the same file sent over a wire in
//!    counts of 10 nm give the same numbers.
//! 2. Points that share one x, within a tenth of the pitch, make a column; a cloud
//!    without columns is binned (see [`ReadOptions::column_pitch_mm`]).
//!
//! What was decided on the user's behalf (units, ignored values, binning) is said in
//! [`PointScan::notes`].
//!
//! Formats are told apart by content, never by name: `ply` at the start is PLY, the gzip
//! magic number is gzip, anything else must be text with `x y z` on each line.

mod columns;
mod error;
mod gather;
mod lattice;
mod pitch;
mod ply;
mod sections;
mod source;
mod spacing;
mod text;
mod units;
mod unpack;

use std::fs::File;
use std::io::Read;
use std::path::Path;

pub use error::{Place, ScanFileError};
pub use lattice::{LATTICE_MM, lattice_counts, lattice_mm};
pub use pitch::recommended_pitch_mm;
pub use sections::{RawSection, read_sections};
pub use units::Units;
pub use unpack::{MOST_UNPACKED_BYTES, Unpacked};

use gather::Gather;

/// Most points that are read by default: as many as 4096 columns of 4096 have, which keeps
/// memory below 1 GB whatever the file holds.
pub const MOST_POINTS: usize = 1 << 24;

/// What a caller may prescribe; everything else is found in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    /// Unit of the coordinates in the file. `None`: millimetres, except for PLY files of
    /// Cyberware scanners (`obj_info is_cyberware_data 1`), which are in metres.
    pub units: Option<Units>,
    /// Distance of the columns in x, millimetres. `None`: the most frequent distance of
    /// neighbouring distinct x; for a cloud without columns a quarter of the mean
    /// distance of its points (the square root of the covered area per point).
    /// Given: points are put into columns of exactly this pitch, anchored at x = 0.
    pub column_pitch_mm: Option<f64>,
    /// Most points accepted, as a bound on memory (about 60 bytes a point at the peak).
    pub max_points: usize,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            units: None,
            column_pitch_mm: None,
            max_points: MOST_POINTS,
        }
    }
}

/// One point of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointSample {
    /// Height in the column, millimetres, on the 10 nm lattice.
    pub y_mm: f64,
    /// Towards the camera, millimetres, on the 10 nm lattice.
    pub z_mm: f64,
    /// Strength of the returned light, 0 to 255; 255 where the file gives none.
    pub intensity: u8,
}

/// All points taken at one position of the table, in ascending y, then z.
#[derive(Debug, Clone, PartialEq)]
pub struct PointColumn {
    /// Position along the table, millimetres, on the 10 nm lattice.
    pub x_mm: f64,
    /// The points, at least one.
    pub samples: Vec<PointSample>,
}

/// A scan file as columns.
#[derive(Debug, Clone, PartialEq)]
pub struct PointScan {
    /// The columns in strictly ascending x, none of them empty.
    pub columns: Vec<PointColumn>,
    /// Distance of neighbouring columns in x, millimetres.
    pub column_pitch_mm: f64,
    /// Median distance in y of neighbouring samples within a column, millimetres; for a
    /// cloud the mean one, as it follows from the area that the points cover.
    pub sample_spacing_mm: f64,
    /// What was decided or left out while reading, one sentence each, for the user.
    pub notes: Vec<String>,
    /// Why the unit of the coordinates is probably another one, if it is; stands among
    /// the notes, too.
    pub units_suspected: Option<String>,
}

impl PointScan {
    /// Number of points in all columns.
    #[must_use]
    pub fn points(&self) -> usize {
        self.columns.iter().map(|c| c.samples.len()).sum()
    }

    /// The grid pitch that suits this scan's density: [`recommended_pitch_mm`].
    #[must_use]
    pub fn recommended_pitch_mm(&self) -> f64 {
        recommended_pitch_mm(self.column_pitch_mm, self.sample_spacing_mm)
    }
}

/// Reads a scan file of any known format.
///
/// # Errors
/// [`ScanFileError`], which names the file and the line, vertex or byte.
pub fn read(path: &Path, options: &ReadOptions) -> Result<PointScan, ScanFileError> {
    let name = path.display().to_string();
    let file = File::open(path).map_err(|source| ScanFileError::Open {
        file: name.clone(),
        source,
    })?;
    read_from(file, &name, options)
}

/// Reads a scan file from a byte source; `name` stands for the file in errors.
///
/// # Errors
/// [`ScanFileError`], which names the file and the line, vertex or byte.
pub fn read_from(
    source: impl Read,
    name: &str,
    options: &ReadOptions,
) -> Result<PointScan, ScanFileError> {
    read_unpacked(&mut Unpacked::new(source, name)?, name, options)
}

/// As [`read_from`], for a caller that has looked at the head of the file.
///
/// # Errors
/// As [`read_from`].
pub fn read_unpacked(
    source: &mut Unpacked<'_>,
    name: &str,
    options: &ReadOptions,
) -> Result<PointScan, ScanFileError> {
    let mut gather = Gather::new(name, options)?;
    // Damage in compressed data first shows as content that makes no sense.
    source::parse(source, &mut gather).map_err(|error| match error {
        ScanFileError::Read { .. } => error,
        other => source.damage().unwrap_or(other),
    })?;
    columns::build(gather)
}

/// Columns from points that were read elsewhere, in millimetres; `name` stands for the
/// source in errors. [`ReadOptions::units`] plays no part.
///
/// # Errors
/// [`ScanFileError`] when most points are not finite, for coordinates too large, and when
/// there is
/// no point at all.
pub fn from_points_mm(
    points: impl IntoIterator<Item = [f64; 3]>,
    name: &str,
    options: &ReadOptions,
) -> Result<PointScan, ScanFileError> {
    let mut gather = Gather::new(name, options)?;
    for (index, point) in points.into_iter().enumerate() {
        gather.push(
            point,
            None,
            Units::Millimetre,
            Place::Point(index as u64 + 1),
        )?;
    }
    columns::build(gather)
}
