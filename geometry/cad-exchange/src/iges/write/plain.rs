//! Whole surfaces, without trims: entity 128 or 114 for each, with its name.

use std::io;

use nurbs::{BSplineSurface, PatchSurface};

use super::error::WriteError;
use super::options::WriteOptions;
use super::shapes::{bspline_parameters, patch_parameters, plain_entry};
use super::sheet::{Entry, Record, Sheet, Status};
use super::{Summary, global_fields, write_name};

/// A surface of a file.
#[derive(Debug, Clone, Copy)]
pub struct NamedSurface<'a> {
    /// Its name in a CAD program's tree.
    pub name: &'a str,
    /// Millimetres.
    pub surface: &'a BSplineSurface,
    /// Whether it ends along u, and along v, where it begins.
    pub is_closed: [bool; 2],
}

/// Writes B-spline surfaces as an IGES 5.3 file, as they are: readers take each over its whole
/// domain. Of the options those that concern entities, trims and colours are not used.
///
/// # Errors
/// [`WriteError::Option`] for an option that cannot stand in a file, or a control point that is not
/// finite; [`WriteError::Io`] when `out` fails.
pub fn write_surfaces(
    surfaces: &[NamedSurface<'_>],
    options: &WriteOptions,
    out: &mut impl io::Write,
) -> Result<Summary, WriteError> {
    whole(surfaces, 128, options, out, |record, own| {
        bspline_parameters(record, own.surface, own.is_closed);
        Ok(())
    })
}

/// The same as parametric splines, entity 114: patches of polynomials in powers of their parameters,
/// one for each span, which are the same surface but for rounding.
///
/// # Errors
/// As [`write_surfaces`], and [`WriteError::Option`] for a surface of a degree above 3, or one whose
/// parameters are not its x and y.
pub fn write_parametric_surfaces(
    surfaces: &[NamedSurface<'_>],
    options: &WriteOptions,
    out: &mut impl io::Write,
) -> Result<Summary, WriteError> {
    whole(surfaces, 114, options, out, |record, own| {
        let patches = PatchSurface::from_bspline(own.surface).ok_or(WriteError::Option {
            option: "surfaces",
            value: own.name.to_owned(),
            expected: "a surface over x and y of a degree of 3 at most",
        })?;
        patch_parameters(record, &patches);
        Ok(())
    })
}

fn whole(
    surfaces: &[NamedSurface<'_>],
    entity: u16,
    options: &WriteOptions,
    out: &mut impl io::Write,
    parameters: impl Fn(&mut Record<'_>, &NamedSurface<'_>) -> Result<(), WriteError>,
) -> Result<Summary, WriteError> {
    options.validate()?;
    let coordinates = surfaces
        .iter()
        .flat_map(|own| own.surface.points().as_flattened());
    let mut largest_mm = 0.0_f64;
    for coordinate in coordinates {
        if !coordinate.is_finite() {
            return Err(WriteError::Option {
                option: "surfaces",
                value: coordinate.to_string(),
                expected: "control points with finite coordinates",
            });
        }
        largest_mm = largest_mm.max(coordinate.abs());
    }
    let mut sheet = Sheet::default();
    for (index, own) in surfaces.iter().enumerate() {
        let level = u16::try_from(index + 1).unwrap_or(u16::MAX);
        let name = write_name(&mut sheet, level, own.name)?;
        let mut record = sheet.begin(Entry {
            label: "SURFACE",
            subscript: index + 1,
            ..plain_entry(entity, level, Status::Independent)
        });
        parameters(&mut record, own)?;
        // No associativities, one property.
        record.integer(0);
        record.integer(1);
        record.pointer(name);
        record.finish()?;
    }
    let start = format!("{}: surfaces from a scan", options.system);
    let global = global_fields(options, options.resolution_mm, largest_mm);
    let bytes = sheet.write(&start, &global, out)?;
    Ok(Summary {
        faces: surfaces.len(),
        entities: sheet.entities(),
        bytes,
        resolution_mm: options.resolution_mm,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nurbs::KnotVector;

    #[test]
    fn a_surface_has_its_numbers_and_its_name() {
        let (u, v) = (
            KnotVector::uniform(2, 1, 0.0, 1.0).unwrap(),
            KnotVector::uniform(1, 1, 0.0, 2.0).unwrap(),
        );
        let points = (0..6).map(|k| [f64::from(k / 2), f64::from(k % 2), 0.25 * f64::from(k)]);
        let surface = BSplineSurface::new(u, v, points.collect()).unwrap();
        let named = NamedSurface {
            name: "torso",
            surface: &surface,
            is_closed: [true, false],
        };
        let options = WriteOptions::new("torso", "20261121.093000");
        let mut file = Vec::new();
        let summary = write_surfaces(&[named], &options, &mut file).unwrap();
        let text = String::from_utf8(file).unwrap();
        assert_eq!((summary.faces, summary.bytes), (1, text.len()));
        assert!(text.contains("406,1,5Htorso;"));
        let parameters: String = text
            .lines()
            .filter(|line| {
                line.ends_with(|c: char| c.is_ascii_digit()) && line.as_bytes()[72] == b'P'
            })
            .map(|line| line[..64].trim_end())
            .collect();
        // Indices, degrees, flags, knots, weights; then points with u fastest, the domain, the name.
        let expected = "128,2,1,2,1,1,0,1,0,0,0.,0.,0.,1.,1.,1.,0.,0.,2.,2.,1.,1.,1.,1.,1.,1.,\
                        0.,0.,0.,1.,0.,0.5,2.,0.,1.,0.,1.,0.25,1.,1.,0.75,2.,1.,1.25,\
                        0.,1.,0.,2.,0,1,1;";
        assert!(parameters.contains(expected), "{parameters}");
    }

    #[test]
    fn what_is_not_a_number_is_not_written() {
        let knots = KnotVector::uniform(1, 1, 0.0, 1.0).unwrap();
        let points = vec![[0.0, 0.0, f64::NAN]; 4];
        let surface = BSplineSurface::new(knots.clone(), knots, points).unwrap();
        let named = NamedSurface {
            name: "a",
            surface: &surface,
            is_closed: [false; 2],
        };
        let mut file = Vec::new();
        let options = WriteOptions::new("a", "20261121.093000");
        assert!(write_surfaces(&[named], &options, &mut file).is_err());
        assert!(file.is_empty());
    }
}
