//! Pieces trimmed where they end.

use std::collections::BTreeMap;

use nurbs::PatchSurface;
use range_image::{Monitor, RangeImage, RegionMap};
use reconstruct::{
    Evidence, Face, Fitted, Model, ReconstructError, ReconstructSettings, Surface, check,
};

use super::Lines;
use super::regions::{Link, links};
use crate::error::SurfaceError;
use crate::grid::HeightGrid;
use crate::surface::Piece;

/// Fewest nodes of a connected part of a region that becomes a face.
const FEWEST_NODES: usize = 4;
/// Places along an edge, for each pitch, at which both sides are compared.
const PER_PITCH: f64 = 4.0;

/// The model of the pieces, one for each label, and its lines. `None` where they cannot all be
/// trimmed on their own surfaces.
///
/// # Errors
/// [`SurfaceError::Cancelled`] at the monitor's wish.
pub(super) fn trimmed(
    grid: &HeightGrid,
    image: &RangeImage,
    map: &RegionMap,
    pieces: &[Piece],
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Option<(Model, Lines)>, SurfaceError> {
    // The image lies on its lattice, the grid where it was measured.
    let off_mm = [image.x_mm(0) - grid.x_mm(0), image.y_mm(0) - grid.y_mm(0)];
    let mut surfaces = Vec::with_capacity(pieces.len());
    for piece in pieces {
        let Some(mut patches) = PatchSurface::from_bspline(&piece.surface) else {
            return Ok(None);
        };
        shift(&mut patches, off_mm);
        surfaces.push((patches, piece.knots.control_points()));
    }
    let settings = ReconstructSettings {
        min_piece_nodes: FEWEST_NODES,
        ..ReconstructSettings::default()
    };
    let made = Fitted::given(image, map, &surfaces, &settings, monitor)
        .and_then(|fitted| fitted.reconstruct(Evidence::default(), monitor));
    let made = match made {
        Ok(made) => made,
        Err(ReconstructError::Cancelled(cancelled)) => return Err(cancelled.into()),
        Err(_) => return Ok(None),
    };
    let is_own = |face: &Face| {
        let Surface::Patches(patches) = &face.surface;
        surfaces
            .get(usize::from(face.region).wrapping_sub(1))
            .is_some_and(|own| own.0 == *patches)
    };
    if !made.model.faces.iter().all(is_own) || check::model(&made.model).is_err() {
        return Ok(None);
    }
    let mut nodes_across = 0;
    for (n, (label, face)) in map.raw_labels().iter().zip(&made.face_at).enumerate() {
        let z_mm = grid.raw_z_mm()[n];
        let face = (*face as usize)
            .checked_sub(1)
            .and_then(|k| made.model.faces.get(k));
        if z_mm.is_nan() || face.is_some_and(|face| face.region == *label) {
            continue;
        }
        let (i, j) = (n / grid.rows(), n % grid.rows());
        let is_near = face.is_some_and(|face| {
            let Surface::Patches(patches) = &face.surface;
            (patches.z(image.x_mm(i), image.y_mm(j)) - z_mm).abs() <= tolerance_mm
        });
        nodes_across += usize::from(!is_near);
    }
    let lines = Lines {
        nodes_across,
        ..meetings(grid, image, map, &made.model, tolerance_mm)
    };
    let mut model = made.model;
    move_model(&mut model, off_mm.map(|mm| -mm));
    Ok(Some((model, lines)))
}

/// How pieces meet on the edges of the model, which is where the image is.
fn meetings(
    grid: &HeightGrid,
    image: &RangeImage,
    map: &RegionMap,
    model: &Model,
    tolerance_mm: f64,
) -> Lines {
    let (labels, z) = (map.raw_labels(), grid.raw_z_mm());
    let left_out = labels
        .iter()
        .zip(z)
        .filter(|(l, z)| **l == 0 && !z.is_nan());
    let mut lines = Lines {
        meeting_mm: 0.0,
        step_mm: 0.0,
        open_mm: 0.0,
        greatest_gap_mm: 0.0,
        nodes_across: 0,
        left_out: left_out.count(),
    };
    let mut near: BTreeMap<[usize; 2], Vec<Link>> = BTreeMap::new();
    for link in links(grid, labels) {
        let [n, _] = link.nodes;
        near.entry([n / grid.rows(), n % grid.rows()])
            .or_default()
            .push(link);
    }
    let mut sides: Vec<Vec<&Face>> = vec![Vec::new(); model.edges.len()];
    for face in &model.faces {
        let loops = core::iter::once(&face.outer).chain(&face.inner);
        for coedge in loops.flat_map(|of_loop| &of_loop.coedges) {
            if let Some(sides) = sides.get_mut(coedge.edge.0) {
                sides.push(face);
            }
        }
    }
    let pitch_mm = grid.pitch_mm();
    for (edge, sides) in model.edges.iter().zip(&sides) {
        let &[a, b] = sides.as_slice() else { continue };
        let (Surface::Patches(over), Surface::Patches(under)) = (&a.surface, &b.surface);
        let (first, last) = edge.path.domain();
        let count = ((last - first) / pitch_mm * PER_PITCH).ceil().max(1.0) as usize;
        let part_mm = (last - first) / count as f64;
        for k in 0..count {
            let [x, y] = edge.path.evaluate(first + part_mm * (k as f64 + 0.5));
            let gap_mm = (over.z(x, y) - under.z(x, y)).abs();
            let at = [
                (x - image.x_mm(0)) / pitch_mm,
                (y - image.y_mm(0)) / pitch_mm,
            ]
            .map(|nodes| nodes.max(0.0) as usize);
            // A step is where the data beside have one.
            let cells = (at[0].saturating_sub(1)..at[0] + 2)
                .flat_map(|i| (at[1].saturating_sub(1)..at[1] + 2).map(move |j| [i, j]));
            let is_step = cells
                .filter_map(|cell| near.get(&cell))
                .flatten()
                .filter(|link| link.labels.contains(&a.region) && link.labels.contains(&b.region))
                .any(|link| link.jump_mm > tolerance_mm);
            if gap_mm <= tolerance_mm {
                lines.meeting_mm += part_mm;
                lines.greatest_gap_mm = lines.greatest_gap_mm.max(gap_mm);
            } else if is_step {
                lines.step_mm += part_mm;
            } else {
                lines.open_mm += part_mm;
                lines.greatest_gap_mm = lines.greatest_gap_mm.max(gap_mm);
            }
        }
    }
    lines
}

fn shift(patches: &mut PatchSurface, by_mm: [f64; 2]) {
    patches.u_breaks.iter_mut().for_each(|b| *b += by_mm[0]);
    patches.v_breaks.iter_mut().for_each(|b| *b += by_mm[1]);
}

/// Moves a model along x and y.
fn move_model(model: &mut Model, by_mm: [f64; 2]) {
    if by_mm == [0.0; 2] {
        return;
    }
    for vertex in &mut model.vertices {
        vertex.x_mm += by_mm[0];
        vertex.y_mm += by_mm[1];
    }
    let on_plane = |pieces: &mut [[[f64; 4]; 2]]| {
        for piece in pieces {
            piece[0][0] += by_mm[0];
            piece[1][0] += by_mm[1];
        }
    };
    for edge in &mut model.edges {
        on_plane(&mut edge.path.pieces);
    }
    for face in &mut model.faces {
        let Surface::Patches(patches) = &mut face.surface;
        shift(patches, by_mm);
        for of_loop in core::iter::once(&mut face.outer).chain(&mut face.inner) {
            for coedge in &mut of_loop.coedges {
                on_plane(&mut coedge.parameter_curve.pieces);
                for piece in &mut coedge.space_curve.pieces {
                    piece[0][0] += by_mm[0];
                    piece[1][0] += by_mm[1];
                }
            }
        }
    }
}
