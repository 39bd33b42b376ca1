//! Treated edges: bands along an outline, each piece with a surface of its own.

use crate::height::Height;
use crate::outline::{Joint, LEAST_MM, Outline, moved_piece, outward};
use crate::part::Treatment;
use crate::plan::{P2, Piece, Support, add, distance, dot, scale};

/// Which side of the outline a band lies on, and where its edge is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// Outside of the outline, else within.
    pub(crate) is_outside: bool,
    /// The edge at the top of a wall, else at its foot.
    pub(crate) is_upper: bool,
    /// Height of what meets the wall in the edge, millimetres.
    pub(crate) z: f64,
}

/// A piece of a band.
#[derive(Debug, Clone)]
pub(crate) struct Band {
    pub(crate) border: Vec<Piece>,
    pub(crate) height: Height,
    /// Pieces of the border that a face which runs all round may be cut open along.
    pub(crate) ends: [Piece; 2],
}

/// The bands along those pieces of an outline that are wanted; why not, if that cannot be.
pub(crate) fn bands(
    outline: &Outline,
    wanted: &[bool],
    treatment: Treatment,
    place: Place,
) -> Result<Vec<Band>, &'static str> {
    let count = outline.pieces().len();
    let width = treatment.width_mm();
    if !(width > LEAST_MM && treatment.height_mm() > LEAST_MM) {
        return Err("it is smaller than 0.01 mm");
    }
    let out_mm = if place.is_outside { width } else { -width };
    let mitres = outline.moved_joints(out_mm);
    let beside = |k: usize, part: f64| {
        let piece = &outline.pieces()[k];
        add(piece.at(part), scale(outward(piece, part), out_mm))
    };
    // Where the band of piece k meets that of the one before, or ends square.
    let joint = |k: usize, of: usize, part: f64| -> Result<P2, &'static str> {
        let other = if of == k { (k + count - 1) % count } else { k };
        if !wanted[other] {
            return Ok(beside(of, part));
        }
        match outline.joint(k) {
            Joint::Smooth => Ok(beside(of, part)),
            Joint::Corner => {
                let mitres = mitres.as_ref().ok_or("it is wider than a corner allows")?;
                Ok(mitres[k])
            }
            Joint::Other => Err("a line and an arc, or two arcs, meet at an angle"),
        }
    };
    let mut bands = Vec::new();
    for k in (0..count).filter(|&k| wanted[k]) {
        let piece = outline.pieces()[k];
        let from = joint(k, k, 0.0)?;
        let to = joint((k + 1) % count, k, 1.0)?;
        let far = moved_piece(&piece, out_mm, from, to)
            .ok_or("it is wider than a piece of the outline allows")?;
        let ends = [(from, piece.from()), (piece.to(), to)];
        let ends = ends.map(|(from, to)| Piece::Line { from, to });
        let border = vec![piece, ends[1], far.reversed(), ends[0]];
        bands.push(Band {
            border,
            height: height(&piece, treatment, place).ok_or("its corner is as tight as itself")?,
            ends,
        });
    }
    Ok(bands)
}

/// The surface along a piece.
fn height(piece: &Piece, treatment: Treatment, place: Place) -> Option<Height> {
    let (width, rise) = (treatment.width_mm(), treatment.height_mm());
    // Heights at the outline and at the far side of the band.
    let at_wall = if place.is_upper {
        place.z - rise
    } else {
        place.z + rise
    };
    let slope = (place.z - at_wall) / width;
    let sense = if place.is_outside { 1.0 } else { -1.0 };
    let n = scale(outward(piece, 0.0), sense);
    let side = if place.is_upper { 1.0 } else { -1.0 };
    match (*piece, piece.support()) {
        (Piece::Arc { ccw, .. }, Support::Circle { c, r }) => {
            let away = if ccw == place.is_outside { 1.0 } else { -1.0 };
            let far = r + away * width;
            if far < LEAST_MM {
                return None;
            }
            Some(match treatment {
                Treatment::Chamfer { .. } => Height::Cone {
                    c,
                    z: at_wall - away * slope * r,
                    slope: away * slope,
                },
                Treatment::Round { radius_mm } => Height::Ring {
                    c,
                    ring: far,
                    z: at_wall,
                    r: radius_mm,
                    side,
                },
            })
        }
        (_, Support::Line { p, d }) => Some(match treatment {
            Treatment::Chamfer { .. } => Height::Plane {
                z: at_wall - slope * dot(n, p),
                slope: scale(n, slope),
            },
            Treatment::Round { radius_mm } => Height::Bar {
                p: add(p, scale(n, width)),
                d,
                z: at_wall,
                r: radius_mm,
                side,
            },
        }),
        _ => None,
    }
}

/// The piece of an outline that a point lies on.
pub(crate) fn piece_at(outline: &Outline, at: P2) -> Option<usize> {
    let off = |piece: &Piece| {
        let near = piece.support().distance(at);
        let middle = piece.at(0.5);
        // On its line or circle, and no farther from its middle than its ends are.
        let reach = distance(middle, piece.from()).max(distance(middle, piece.to()));
        near + (distance(at, middle) - reach).max(0.0)
    };
    let pieces = outline.pieces().iter().enumerate();
    let nearest = pieces.min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
    nearest.map(|(k, _)| k)
}
