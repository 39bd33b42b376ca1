//! The surface of a face, and its borders on the edges that it shares.
//!
//! On a surface by its numbers or its profile curves are given in space alone: a reader's parameters of it are its
//! own affair. On patches over x and y they are given as x and y, too.

use nurbs::PiecewiseCubic;
use reconstruct::{Face, Surface};

use super::error::WriteError;
use super::shapes::{Joined, curve, curve_status, plain_entry, surface};
use super::sheet::{Pointer, Sheet, Status};
use super::{Style, analytic};
use crate::brep::{Carrier, Topology, Use};
use crate::common::shifted;

/// Preference of 142 for the curve in space. Neighbours share it, and readers that take
/// one curve only (Autodesk Alias among them) take this one.
const PREFER_SPACE_CURVE: usize = 2;

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

/// What a face lies on, and whether that is given over x and y.
pub(super) fn carrier_surface(
    sheet: &mut Sheet,
    style: Style,
    face: &Face,
    carrier: &Carrier,
) -> Result<(Pointer, bool), WriteError> {
    let Surface::Patches(patches) = &face.surface;
    Ok(match carrier {
        Carrier::Plane(flat) => (analytic::plane(sheet, style.level, flat)?, false),
        Carrier::Swept(generated) => (analytic::swept(sheet, style, generated)?, false),
        Carrier::Round(round) => (analytic::round_surface(sheet, style.level, round)?, false),
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

/// Pieces of a path are one where both are one cubic, but for this, millimetres.
const SAME_PIECE_MM: f64 = 1e-10;

/// x and y of a curve. What lies over one cubic is one piece of it, however often the surface has it
/// broken.
pub(super) fn plan(curve: &PiecewiseCubic<3>) -> PiecewiseCubic<2> {
    let mut path = PiecewiseCubic {
        breaks: vec![curve.breaks[0]],
        pieces: Vec::new(),
    };
    for (&[x, y, _], ends) in curve.pieces.iter().zip(curve.breaks.windows(2)) {
        let width = ends[1] - ends[0];
        let begin = path.breaks[path.pieces.len().saturating_sub(1)];
        let continues = path.pieces.last().is_some_and(|last: &[[f64; 4]; 2]| {
            let on = last.map(|c| shifted(&c, ends[0] - begin));
            let mut both = on.iter().zip([x, y]);
            both.all(|(on, c)| {
                let apart = on.iter().zip(c).map(|(a, b)| (a - b).abs());
                // Slopes agree as well, however short the piece is: readers split curves at kinks.
                let width = width.max(1.0);
                let powers = [1.0, width, width * width, width * width * width];
                apart.zip(powers).all(|(off, by)| off * by <= SAME_PIECE_MM)
            })
        });
        if continues {
            path.breaks.pop();
        } else {
            path.pieces.push([x, y]);
        }
        path.breaks.push(ends[1]);
    }
    path
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
