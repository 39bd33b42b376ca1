//! Faces by their numbers: planes, cylinders, cones, spheres and tori (entities 190 to 198), on
//! the edges that they share; what is none of these is a B-spline (128).
//!
//! Curves of the former are given in space alone: a reader's parameters of these surfaces are its
//! own affair. On a B-spline over x and y, they are x and y.

use nurbs::PiecewiseCubic;
use reconstruct::{Face, Surface};
use shapes::Family;

use super::error::WriteError;
use super::shapes::{Joined, curve, curve_status, plain_entry, surface};
use super::sheet::{Entry, Pointer, Sheet, Status};
use super::{PREFER_SPACE_CURVE, Style};
use crate::brep::{Analytic, Carrier, Flat, Topology, Use};

/// The surface of a face and its borders, the outer one first: entities 142.
pub(super) fn bounded_surface(
    sheet: &mut Sheet,
    style: Style,
    (face, carrier): (&Face, &Carrier),
    topology: &Topology,
    loops: &[Vec<Use>],
) -> Result<(Pointer, Vec<Pointer>), WriteError> {
    let (surface, is_spline) = carrier_surface(sheet, style, face, carrier)?;
    let borders = loops
        .iter()
        .map(|uses| {
            let uses = as_the_surface_sees(carrier, uses);
            border(sheet, style, (surface, is_spline), topology, &uses)
        })
        .collect::<Result<Vec<_>, _>>()?;
    Ok((surface, borders))
}

/// What a face lies on, and whether that is a B-spline over x and y.
pub(super) fn carrier_surface(
    sheet: &mut Sheet,
    style: Style,
    face: &Face,
    carrier: &Carrier,
) -> Result<(Pointer, bool), WriteError> {
    let Surface::Patches(patches) = &face.surface;
    Ok(match carrier {
        Carrier::Plane(flat) => (plane(sheet, style.level, flat)?, false),
        Carrier::Round(round) => (round_surface(sheet, style.level, round)?, false),
        Carrier::Spline => (surface(sheet, style.entities, style.level, patches)?, true),
    })
}

/// A loop in the sense in which the surface's own normal sees it: outer ones counter-clockwise.
/// The normal of entities 192 to 198 always points outwards: a face that is seen from within shows
/// its back, and its loops run the other way.
pub(super) fn as_the_surface_sees(carrier: &Carrier, uses: &[Use]) -> Vec<Use> {
    if carrier.same_sense() {
        return uses.to_vec();
    }
    let reversed = uses.iter().rev().map(|of| Use {
        forward: !of.forward,
        ..*of
    });
    reversed.collect()
}

/// Entity 142 and the curves below it.
fn border(
    sheet: &mut Sheet,
    style: Style,
    (surface, is_spline): (Pointer, bool),
    topology: &Topology,
    uses: &[Use],
) -> Result<Pointer, WriteError> {
    let spatial: Vec<PiecewiseCubic<3>> = uses
        .iter()
        .map(|of| topology.edges[of.edge].directed(of.forward))
        .collect();
    let flat = is_spline.then(|| spatial.iter().map(plan).collect::<Vec<_>>());
    let flat = flat.map(|flat| chain(sheet, style, &flat)).transpose()?;
    let spatial = chain(sheet, style, &spatial)?;
    let status = Status::DependentInParameterPlane;
    let mut record = sheet.begin(plain_entry(142, style.level, status));
    // How the curve came about is left open.
    record.integer(0);
    record.pointer(surface);
    match flat {
        Some(flat) => record.pointer(flat),
        None => record.integer(0),
    }
    record.pointer(spatial);
    record.integer(PREFER_SPACE_CURVE);
    record.finish()
}

/// x and y of a curve.
pub(super) fn plan(curve: &PiecewiseCubic<3>) -> PiecewiseCubic<2> {
    PiecewiseCubic {
        breaks: curve.breaks.clone(),
        pieces: curve.pieces.iter().map(|&[x, y, _]| [x, y]).collect(),
    }
}

/// The curves of a closed loop (126), and entity 102 over them where there are several.
fn chain<const D: usize>(
    sheet: &mut Sheet,
    style: Style,
    curves: &[PiecewiseCubic<D>],
) -> Result<Pointer, WriteError> {
    let mut pointers = Vec::with_capacity(curves.len());
    for (of, next) in curves.iter().zip(curves.iter().cycle().skip(1)) {
        let joined = Joined {
            curve: of,
            end: next.start(),
            closed: curves.len() == 1,
            flat_mm: style.resolution_mm,
        };
        pointers.push(curve(sheet, style.entities, style.level, &joined)?);
    }
    if let &[single] = pointers.as_slice() {
        return Ok(single);
    }
    let mut record = sheet.begin(plain_entry(102, style.level, curve_status(D)));
    record.integer(pointers.len());
    for pointer in pointers {
        record.pointer(pointer);
    }
    record.finish()
}

/// Entity 190.
fn plane(sheet: &mut Sheet, level: u16, flat: &Flat) -> Result<Pointer, WriteError> {
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
fn round_surface(sheet: &mut Sheet, level: u16, of: &Analytic) -> Result<Pointer, WriteError> {
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
