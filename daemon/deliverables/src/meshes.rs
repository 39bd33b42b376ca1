//! The model as triangles, and the points that it was made of, where they are asked for.

use std::collections::BTreeSet;
use std::io::{self, Write};

use cad_exchange::step::DEFAULT_PALETTE;
use jiff::Timestamp;
use mesh_files::{MeshDetails, Point, Points, ScanDetails, write_mesh, write_points};
use pipeline::{Columns, ReadAgainError};
use range_image::Monitor;
use reconstruct::Model;
use tessellate::{Accuracy, Mesh, SettingsError, TessellateError, TessellateSettings, tessellate};

pub use mesh_files::{MeshFormat, PointFormat};

use crate::export::{WriteError, file_stem};
use crate::extras::Extras;
use crate::file::sha256_of;
use crate::report::{MeshReport, ScanReport};
use crate::write::{DeliverError, Inputs};

/// Name and version of this program in files.
pub(crate) const GENERATOR: &str = concat!("Relief ", env!("CARGO_PKG_VERSION"));

/// Which files of triangles and of points are written.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshOptions {
    /// Formats of the model's triangles.
    pub meshes: BTreeSet<MeshFormat>,
    /// Farthest that a triangle may lie off the model, millimetres.
    pub tolerance_mm: f64,
    /// Formats of the measured points.
    pub points: BTreeSet<PointFormat>,
}

impl Default for MeshOptions {
    /// None.
    fn default() -> Self {
        Self {
            meshes: BTreeSet::new(),
            tolerance_mm: TessellateSettings::default().tolerance_mm,
            points: BTreeSet::new(),
        }
    }
}

impl MeshOptions {
    /// Checks the tolerance.
    ///
    /// # Errors
    /// One that cannot be kept.
    pub fn check(&self) -> Result<(), SettingsError> {
        self.settings().validate()
    }

    fn settings(&self) -> TessellateSettings {
        TessellateSettings {
            tolerance_mm: self.tolerance_mm,
            ..TessellateSettings::default()
        }
    }
}

/// The columns of a scan as points.
#[derive(Clone, Copy)]
pub struct MeasuredPoints<'a>(pub &'a dyn Columns);

impl core::fmt::Debug for MeasuredPoints<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("MeasuredPoints")
    }
}

impl Points for MeasuredPoints<'_> {
    fn visit(&self, take: &mut dyn FnMut(Point) -> io::Result<()>) -> io::Result<()> {
        let mut taken = Ok(());
        let read: Result<(), ReadAgainError> = self.0.visit(&mut |column| {
            taken = column.samples().iter().try_for_each(|sample| {
                take(Point {
                    place_mm: [column.x_mm(), sample.y_mm, sample.z_mm],
                    intensity: sample.intensity,
                })
            });
            taken.is_ok()
        });
        taken?;
        read.map_err(io::Error::other)
    }
}

/// Tolerances, beyond what seams are apart, by which triangles may lie off: those that bridge the
/// steep walls of a rough surface lie farther off, and cover too much.
const FAR: f64 = 10.0;

/// Why there are no triangles to be delivered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrianglesError {
    /// None were made.
    #[error(transparent)]
    Tessellate(#[from] TessellateError),
    /// They are not what the model is.
    #[error(
        "triangles would lie {off_mm:.3} mm off the model, where {tolerance_mm} mm are asked for: \
         some of its faces are too steep and rough for them; the IGES and STEP files have all of it"
    )]
    TooFar {
        /// How far the farthest would lie off.
        off_mm: f64,
        /// What was asked for.
        tolerance_mm: f64,
    },
}

/// The triangles of a model.
///
/// # Errors
/// As [`tessellate`]; [`TrianglesError::TooFar`] where they lie farther off than ten tolerances.
pub fn triangles(
    model: &Model,
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Mesh, TrianglesError> {
    let options = MeshOptions {
        tolerance_mm,
        ..MeshOptions::default()
    };
    let mesh = tessellate(model, &options.settings(), monitor)?;
    near_enough(mesh.accuracy, tolerance_mm)?;
    Ok(mesh)
}

fn near_enough(accuracy: Accuracy, tolerance_mm: f64) -> Result<(), TrianglesError> {
    let off_mm = accuracy.surface_mm;
    if off_mm > FAR * tolerance_mm + accuracy.seam_mm {
        return Err(TrianglesError::TooFar {
            off_mm,
            tolerance_mm,
        });
    }
    Ok(())
}

/// What the report says of triangles.
#[must_use]
pub fn mesh_report(mesh: &Mesh) -> MeshReport {
    MeshReport {
        triangles: mesh.triangle_count(),
        free_edges: mesh.free_edges(),
        area_mm2: mesh.area_mm2(),
        surface_mm: mesh.accuracy.surface_mm,
        seam_mm: mesh.accuracy.seam_mm,
    }
}

/// Writes triangles in a format, with the names and colours that the CAD files have.
///
/// # Errors
/// As [`write_mesh`].
pub fn write_triangles(
    mesh: &Mesh,
    format: MeshFormat,
    name: &str,
    sink: &mut dyn Write,
) -> Result<(), WriteError> {
    let details = MeshDetails {
        name: &file_stem(name),
        generator: GENERATOR,
        palette: &DEFAULT_PALETTE,
    };
    Ok(write_mesh(mesh, format, &details, sink)?)
}

/// Writes measured points in a format.
///
/// # Errors
/// As [`write_points`].
pub fn write_measured(
    points: MeasuredPoints<'_>,
    format: PointFormat,
    (name, timestamp): (&str, Timestamp),
    scan: &ScanReport,
    sink: &mut dyn Write,
) -> Result<(), WriteError> {
    let serial = scan.source.rsplit_once("serial number ");
    // The same scan has the same identifiers, whoever writes it, and no other has them.
    let guid = |what: &str| -> io::Result<String> {
        let told = format!(
            "{what}\n{name}\n{timestamp}\n{:?}\n{}\n{}",
            scan.id, scan.source, scan.samples
        );
        Ok(guid(&sha256_of(told.as_bytes())?))
    };
    let (of_file, of_scan) = (guid("file")?, guid("scan")?);
    let details = ScanDetails {
        name: &file_stem(name),
        generator: GENERATOR,
        source: &scan.source,
        serial: serial.map(|(_, serial)| serial),
        taken_s: timestamp.as_second() as f64,
        guids: [&of_file, &of_scan],
    };
    Ok(write_points(&points, format, &details, sink)?)
}

/// Hexadecimal digits in groups of 8, 4, 4, 4 and 12, marked as of version 8: by another rule than
/// those that the standard for such identifiers has.
fn guid(digits: &str) -> String {
    let part = |range: core::ops::Range<usize>| digits.get(range).unwrap_or_default();
    format!(
        "{{{}-{}-8{}-8{}-{}}}",
        part(0..8),
        part(8..12),
        part(12..15),
        part(15..18),
        part(18..30)
    )
}

/// Writes what is asked for. What there is no room for is left out, and so are triangles of a model
/// that none can be made of: all that they hold is in the IGES file, and the points in the journal.
pub(crate) fn write_meshes(
    extras: &mut Extras<'_>,
    inputs: &Inputs<'_>,
) -> Result<Option<MeshReport>, DeliverError> {
    let wanted = &inputs.cad.meshes;
    let stem = file_stem(inputs.name);
    let mut report = None;
    if !wanted.meshes.is_empty() {
        let model = &inputs.outcome.reconstruction.model;
        match triangles(model, wanted.tolerance_mm, extras.monitor) {
            Ok(mesh) => {
                report = Some(mesh_report(&mesh));
                for &format in &wanted.meshes {
                    let name = format!("{stem}.{}", format.ending());
                    extras.put(&name, &|sink| {
                        write_triangles(&mesh, format, inputs.name, sink)
                    })?;
                }
            }
            Err(TrianglesError::Tessellate(TessellateError::Cancelled(cancelled))) => {
                return Err(cancelled.into());
            }
            Err(error) => extras
                .left_out
                .push(format!("the files of triangles were left out: {error}")),
        }
    }
    if let Some(points) = inputs.points {
        for &format in &wanted.points {
            let name = format!("{stem}-points.{}", format.ending());
            extras.put(&name, &|sink| {
                let named = (inputs.name, inputs.timestamp);
                write_measured(points, format, named, &inputs.scan, sink)
            })?;
        }
    }
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_that_bridge_walls_are_refused() {
        let accuracy = |surface_mm, seam_mm| Accuracy {
            surface_mm,
            seam_mm,
        };
        assert_eq!(near_enough(accuracy(0.012, 0.0), 0.01), Ok(()));
        assert_eq!(near_enough(accuracy(0.12, 0.025), 0.01), Ok(()));
        let refused = near_enough(accuracy(1.577, 0.025), 0.01);
        let told = refused.map_err(|error| error.to_string()).unwrap_err();
        assert!(
            told.contains("1.577 mm off the model, where 0.01 mm"),
            "{told}"
        );
    }

    #[test]
    fn identifiers_have_the_usual_form() {
        let digits = crate::file::hexadecimal(&[0xab; 32]);
        let id = guid(&digits);
        assert_eq!(id, "{abababab-abab-8aba-8bab-abababababab}");
        let groups: Vec<usize> = id
            .trim_matches(['{', '}'])
            .split('-')
            .map(str::len)
            .collect();
        assert_eq!(groups, [8, 4, 4, 4, 12]);
    }

    #[test]
    fn tolerances_are_bounded() {
        let with = |tolerance_mm| MeshOptions {
            tolerance_mm,
            ..MeshOptions::default()
        };
        assert!(MeshOptions::default().check().is_ok() && with(0.5).check().is_ok());
        for wrong in [0.0, -1.0, f64::NAN, 100.0] {
            assert!(with(wrong).check().is_err(), "{wrong}");
        }
    }
}
