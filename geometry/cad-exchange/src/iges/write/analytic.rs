//! Surfaces by their numbers: planes, cylinders, cones, spheres and tori (entities 190 to 198); and by
//! their profiles: extrusions (122) and revolutions (120).

use core::f64::consts::TAU;

use shapes::Family;

use super::Style;
use super::error::WriteError;
use super::shapes::{Joined, curve, plain_entry};
use super::sheet::{Entry, Pointer, Sheet, Status};
use crate::brep::{Analytic, By, Flat, Generated};

/// Entity 190.
pub(super) fn plane(sheet: &mut Sheet, level: u16, flat: &Flat) -> Result<Pointer, WriteError> {
    let location = point(sheet, level, flat.origin_mm)?;
    let normal = direction(sheet, level, flat.normal)?;
    let reference = direction(sheet, level, flat.x)?;
    let mut record = sheet.begin(parameterised(190, level));
    record.pointer(location);
    record.pointer(normal);
    record.pointer(reference);
    record.finish()
}

/// Entities 192 to 198.
pub(super) fn round_surface(
    sheet: &mut Sheet,
    level: u16,
    of: &Analytic,
) -> Result<Pointer, WriteError> {
    let location = point(sheet, level, of.origin_mm)?;
    let axis = direction(sheet, level, of.axis)?;
    let reference = direction(sheet, level, of.x)?;
    let family = of.shape.family();
    let entity = match family {
        Family::Plane => 190,
        Family::Cylinder => 192,
        Family::Cone => 194,
        Family::Sphere => 196,
        Family::Torus => 198,
    };
    let mut record = sheet.begin(parameterised(entity, level));
    record.pointer(location);
    if family != Family::Sphere {
        record.pointer(axis);
    }
    record.reals(&of.lengths_mm);
    if let Some(angle_rad) = of.angle_rad {
        record.real(angle_rad.to_degrees());
    }
    if family == Family::Sphere {
        record.pointer(axis);
    }
    record.pointer(reference);
    record.finish()
}

/// Entities 120 and 122.
pub(super) fn swept(
    sheet: &mut Sheet,
    style: Style,
    of: &Generated,
) -> Result<Pointer, WriteError> {
    let profile = of.curve();
    let joined = Joined {
        curve: &profile,
        end: profile.end(),
        closed: false,
        flat_mm: style.resolution_mm,
    };
    let generatrix = curve(sheet, style.entities, style.level, &joined)?;
    match &of.by {
        By::Shift { along_mm, .. } => {
            let mut record = sheet.begin(plain_entry(122, style.level, Status::Dependent));
            record.pointer(generatrix);
            // Where the start of the curve comes to.
            let start = profile.start();
            let end: [f64; 3] = core::array::from_fn(|d| start[d] + along_mm[d]);
            record.reals(&end);
            record.finish()
        }
        By::Turn { .. } => {
            let sweep = &of.swept.sweep;
            let mut record = sheet.begin(plain_entry(110, style.level, Status::Dependent));
            record.reals(sweep.origin_mm.as_slice());
            // Its parameters come in the other order than in STEP, and so does its normal.
            record.reals((sweep.origin_mm - sweep.axis).as_slice());
            let axis = record.finish()?;
            let mut record = sheet.begin(plain_entry(120, style.level, Status::Dependent));
            record.pointer(axis);
            record.pointer(generatrix);
            record.reals(&[0.0, TAU]);
            record.finish()
        }
    }
}

/// A surface with a direction from which its parameters count (form 1).
fn parameterised(entity: u16, level: u16) -> Entry<'static> {
    Entry {
        form: 1,
        ..plain_entry(entity, level, Status::Dependent)
    }
}

/// Entity 116.
fn point(sheet: &mut Sheet, level: u16, at_mm: [f64; 3]) -> Result<Pointer, WriteError> {
    let mut record = sheet.begin(plain_entry(116, level, Status::Dependent));
    record.reals(&at_mm);
    // No symbol to draw it by.
    record.integer(0);
    record.finish()
}

/// Entity 123.
fn direction(sheet: &mut Sheet, level: u16, along: [f64; 3]) -> Result<Pointer, WriteError> {
    let entry = plain_entry(123, level, Status::DependentDefinition);
    let mut record = sheet.begin(Entry {
        line_font: 0,
        ..entry
    });
    record.reals(&along);
    record.finish()
}
