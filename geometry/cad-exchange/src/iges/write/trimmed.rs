//! B-spline surfaces with trims of their own: entity 144 over 142, 128 and 126, with names.

use std::io;

use nurbs::{BSplineCurve, BSplineSurface};

use super::error::WriteError;
use super::options::WriteOptions;
use super::shapes::{bspline_parameters, curve_parameters, curve_status, plain_entry};
use super::sheet::{Entry, Pointer, Sheet, Status};
use super::{Summary, global_fields, write_name, write_trims};

/// A trimmed surface of a file.
#[derive(Debug, Clone, Copy)]
pub struct NamedPatch<'a> {
    /// Its name in a CAD program's tree.
    pub name: &'a str,
    /// Millimetres.
    pub surface: &'a BSplineSurface,
    /// Closed trims in the parameter plane, the outer one first.
    pub parameter_curves: &'a [BSplineCurve<2>],
    /// The same in space.
    pub space_curves: &'a [BSplineCurve<3>],
}

/// Preference of 142 for the curve in the parameter plane, which is exact here.
const PREFER_PARAMETER_CURVE: usize = 1;

/// Writes trimmed B-spline surfaces as an IGES 5.3 file. `gap_mm` is how far curves in space may lie off
/// their surfaces; the file's resolution is no finer.
///
/// # Errors
/// [`WriteError::Option`] for an option that cannot stand in a file, a coordinate that is not finite, or
/// a surface without an outer trim in both forms; [`WriteError::Io`] when `out` fails.
pub fn write_trimmed(
    patches: &[NamedPatch<'_>],
    gap_mm: f64,
    options: &WriteOptions,
    out: &mut impl io::Write,
) -> Result<Summary, WriteError> {
    options.validate()?;
    let mut largest_mm = 0.0_f64;
    for own in patches {
        largest_mm = largest_mm.max(largest(own)?);
    }
    let mut sheet = Sheet::default();
    for (index, own) in patches.iter().enumerate() {
        patch(&mut sheet, index + 1, own)?;
    }
    let resolution_mm = options.resolution_mm.max(gap_mm);
    let start = format!("{}: trimmed surfaces of a mesh's holes", options.system);
    let global = global_fields(options, resolution_mm, largest_mm);
    let bytes = sheet.write(&start, &global, out)?;
    Ok(Summary {
        faces: patches.len(),
        entities: sheet.entities(),
        bytes,
        resolution_mm,
    })
}

/// The largest coordinate; what is wrong with a patch.
fn largest(own: &NamedPatch<'_>) -> Result<f64, WriteError> {
    let refuse = |value: String, expected: &'static str| WriteError::Option {
        option: "patches",
        value,
        expected,
    };
    let count = own.parameter_curves.len();
    if count == 0 || count != own.space_curves.len() {
        return Err(refuse(
            own.name.to_owned(),
            "a trim in the parameter plane and in space for each border",
        ));
    }
    let mut largest_mm = 0.0_f64;
    let curves = own.space_curves.iter().flat_map(BSplineCurve::points);
    let flat = own.parameter_curves.iter().flat_map(BSplineCurve::points);
    let coordinates = own
        .surface
        .points()
        .iter()
        .chain(curves)
        .flatten()
        .chain(flat.flatten());
    for coordinate in coordinates {
        if !coordinate.is_finite() {
            return Err(refuse(coordinate.to_string(), "finite coordinates"));
        }
        largest_mm = largest_mm.max(coordinate.abs());
    }
    Ok(largest_mm)
}

fn patch(sheet: &mut Sheet, number: usize, own: &NamedPatch<'_>) -> Result<(), WriteError> {
    let level = u16::try_from(number).unwrap_or(u16::MAX);
    let mut record = sheet.begin(plain_entry(128, level, Status::Dependent));
    bspline_parameters(&mut record, own.surface, [false; 2]);
    let surface = record.finish()?;
    let mut borders = Vec::new();
    for (flat, spatial) in own.parameter_curves.iter().zip(own.space_curves) {
        let flat = curve(sheet, level, flat)?;
        let spatial = curve(sheet, level, spatial)?;
        let status = Status::DependentInParameterPlane;
        let mut record = sheet.begin(plain_entry(142, level, status));
        // A projection onto the surface.
        record.integer(2);
        record.pointer(surface);
        record.pointer(flat);
        record.pointer(spatial);
        record.integer(PREFER_PARAMETER_CURVE);
        borders.push(record.finish()?);
    }
    let name = write_name(sheet, level, own.name)?;
    let entry = Entry {
        label: "PATCH",
        subscript: number,
        ..plain_entry(144, level, Status::Independent)
    };
    write_trims(sheet, entry, surface, &borders, name)
}

fn curve<const D: usize>(
    sheet: &mut Sheet,
    level: u16,
    own: &BSplineCurve<D>,
) -> Result<Pointer, WriteError> {
    let mut record = sheet.begin(plain_entry(126, level, curve_status(D)));
    let end = own.points().first().copied();
    curve_parameters(&mut record, own, end, true, 0.0);
    record.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::iges::{SplineCurve, TrimmedSurface, read_model};
    use nurbs::KnotVector;

    fn chain<const D: usize>(points: Vec<[f64; D]>) -> BSplineCurve<D> {
        let spans = points.len() - 1;
        BSplineCurve::new(
            KnotVector::uniform(1, spans, 0.0, spans as f64).unwrap(),
            points,
        )
        .unwrap()
    }

    #[test]
    fn a_patch_is_read_as_it_was_written() {
        let knots = || KnotVector::uniform(3, 2, 0.0, 2.0).unwrap();
        let at = |i: f64, j: f64| [i, j, 0.1 * i * j];
        let points = (0..25)
            .map(|k| at(f64::from(k / 5), f64::from(k % 5)))
            .collect();
        let surface = BSplineSurface::new(knots(), knots(), points).unwrap();
        let flat = vec![[0.5, 0.5], [1.5, 0.5], [1.0, 1.5], [0.5, 0.5]];
        let spatial = flat.iter().map(|&[u, v]| surface.evaluate(u, v)).collect();
        let (flat, spatial) = ([chain(flat)], [chain(spatial)]);
        let patch = NamedPatch {
            name: "hole-7",
            surface: &surface,
            parameter_curves: &flat,
            space_curves: &spatial,
        };
        let options = WriteOptions::new("holes", "20261128.120000");
        let mut file = Vec::new();
        let summary = write_trimmed(&[patch], 1e-2, &options, &mut file).unwrap();
        assert_eq!((summary.faces, summary.resolution_mm), (1, 1e-2));
        let model = read_model(&file[..]).unwrap();
        let [face] = &model.faces[..] else {
            panic!("{} faces", model.faces.len());
        };
        assert_eq!(face.name.as_deref(), Some("hole-7"));
        assert_eq!(face.surface, TrimmedSurface::BSpline(surface.clone()));
        let border = &face.outer[0];
        assert_eq!(
            border.parameter_curve,
            Some(SplineCurve::BSpline(flat[0].clone()))
        );
        assert_eq!(border.space_curve, SplineCurve::BSpline(spatial[0].clone()));
        // Without a trim there is no outer border.
        let bare = NamedPatch {
            parameter_curves: &[],
            ..patch
        };
        assert!(write_trimmed(&[bare], 0.0, &options, &mut Vec::new()).is_err());
    }
}
