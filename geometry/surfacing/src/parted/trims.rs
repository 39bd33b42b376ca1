//! Pieces trimmed where they end.

use std::collections::{BTreeMap, BTreeSet};

use nurbs::PatchSurface;
use range_image::{Monitor, RangeImage, RegionMap};
use reconstruct::{
    Evidence, Face, Fitted, Model, ReconstructError, ReconstructSettings, Reconstruction, Surface,
    check,
};

use super::Lines;
use super::regions::{Link, links, square};
use crate::error::SurfaceError;
use crate::grid::HeightGrid;
use crate::surface::Piece;

/// Fewest nodes of a connected part of a region that becomes a face.
const FEWEST_NODES: usize = 4;
/// Nodes so near to a line tell whether z steps there, and by how much more than at a crease z, carried
/// on straight from both sides, is apart at a step, in tolerances.
const BESIDE_NODES: usize = 2;
const LEAST_STEP: f64 = 0.5;
/// Nodes so near to a place on a line far from all nodes have the borders beside them drawn anew.
const FAR_NODES: usize = 4;
/// How closely a border can be drawn to the nodes.
const CLOSEST: u8 = 3;
/// A node of another face that is off by no more than this many tolerances lies beside a crease, where
/// both surfaces nearly pass it: a border drawn closer to the nodes would leave the crease.
const BESIDE_CREASE: f64 = 3.0;
/// Times that borders are drawn: as a rule, two for each step by which they can be drawn closer.
const MOST_DRAWINGS: usize = 12;
/// Places along an edge, for each pitch, at which both sides are compared.
const PER_PITCH: f64 = 4.0;

/// Trimmed pieces.
pub(super) struct Trimmed {
    pub(super) model: Model,
    pub(super) lines: Lines,
    /// Labels of pieces that part where there is no step.
    pub(super) open: BTreeSet<u16>,
    /// Nodes on the face of another region than their own, and data minus that, millimetres.
    pub(super) elsewhere: Vec<(usize, f64)>,
    /// Nodes that no face passes, and the label of the face that is there.
    pub(super) across: Vec<(usize, Option<u16>)>,
}

/// What gives way where a node lies a little on the wrong side of a crease.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mend {
    /// The surfaces, which are to pass the node both.
    Surfaces,
    /// The border, which is drawn around the node.
    Borders,
}

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
    mend: Mend,
    monitor: &dyn Monitor,
) -> Result<Option<Trimmed>, SurfaceError> {
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
    let is_own = |face: &Face| {
        let Surface::Patches(patches) = &face.surface;
        surfaces
            .get(usize::from(face.region).wrapping_sub(1))
            .is_some_and(|own| own.0 == *patches)
    };
    let least_mm = match mend {
        Mend::Surfaces => BESIDE_CREASE * tolerance_mm,
        Mend::Borders => tolerance_mm,
    };
    let mut closeness = vec![0; grid.raw_z_mm().len()];
    for _ in 0..MOST_DRAWINGS {
        let made = Fitted::given(image, map, &surfaces, &settings, monitor).and_then(|fitted| {
            let fitted = fitted.closely(closeness.clone());
            fitted.reconstruct(Evidence::default(), monitor)
        });
        let made = match made {
            Ok(made) => made,
            Err(ReconstructError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Err(_) => return Ok(None),
        };
        if check::model(&made.model).is_err() {
            return Ok(None);
        }
        let elsewhere = elsewhere(grid, map, &made);
        let is_across =
            |(_, off_mm): &&(usize, f64)| off_mm.is_nan() || off_mm.abs() > tolerance_mm;
        let across: Vec<usize> = elsewhere
            .iter()
            .filter(is_across)
            .map(|(n, _)| *n)
            .collect();
        let foreign = made.model.faces.iter().filter(|face| !is_own(face));
        let foreign: BTreeSet<u16> = foreign.map(|face| face.region).collect();
        let (lines, open) = meetings(grid, image, map, &made.model, tolerance_mm);
        // Borders that leave nodes out, or the surface, or run far from all nodes, are drawn anew,
        // nearer to the nodes.
        let labels = map.raw_labels();
        let beyond = (0..labels.len()).filter(|n| foreign.contains(&labels[*n]));
        let far = open.iter().filter(|open| open.is_far).flat_map(|open| {
            let [i, j] = [0, 1].map(|d| open.at[d].min([grid.columns(), grid.rows()][d] - 1));
            square(i * grid.rows() + j, FAR_NODES, grid.columns(), grid.rows())
        });
        let by_border = elsewhere
            .iter()
            .filter(|(_, off_mm)| off_mm.is_nan() || off_mm.abs() > least_mm)
            .map(|(n, _)| *n);
        let asking: BTreeSet<usize> = by_border.chain(beyond).chain(far).collect();
        let mut is_nearer = false;
        for n in asking {
            is_nearer |= closeness[n] < CLOSEST;
            closeness[n] = (closeness[n] + 1).min(CLOSEST);
        }
        if is_nearer {
            continue;
        }
        if !foreign.is_empty() {
            return Ok(None);
        }
        let across: Vec<_> = across
            .into_iter()
            .map(|n| (n, region_at(&made, n)))
            .collect();
        let mut model = made.model;
        move_model(&mut model, off_mm.map(|mm| -mm));
        return Ok(Some(Trimmed {
            model,
            lines: Lines {
                nodes_across: across.len(),
                ..lines
            },
            open: open.iter().flat_map(|open| open.regions).collect(),
            elsewhere,
            across,
        }));
    }
    Ok(None)
}

/// The region of the face that is at a node.
fn region_at(made: &Reconstruction, n: usize) -> Option<u16> {
    let face = (made.face_at[n] as usize).checked_sub(1)?;
    Some(made.model.faces.get(face)?.region)
}

/// Nodes on the face of another region, or on none, with their distance from it.
fn elsewhere(grid: &HeightGrid, map: &RegionMap, made: &Reconstruction) -> Vec<(usize, f64)> {
    let faces_mm = made.restored.raw_z_mm();
    let nodes = grid.raw_z_mm().iter().zip(map.raw_labels()).enumerate();
    nodes
        .filter(|(n, (z_mm, label))| !z_mm.is_nan() && region_at(made, *n) != Some(**label))
        .map(|(n, (z_mm, _))| (n, z_mm - faces_mm[n]))
        .collect()
}

/// A place on a line where two pieces part though there is no step.
struct Open {
    /// Column and row of the node before it.
    at: [usize; 2],
    regions: [u16; 2],
    /// No nodes of both are beside it.
    is_far: bool,
}

/// Neighbouring nodes of different regions, by the column and row of the first.
struct Beside(BTreeMap<[usize; 2], Vec<Link>>);

impl Beside {
    fn of(grid: &HeightGrid, labels: &[u16]) -> Self {
        let mut beside: BTreeMap<[usize; 2], Vec<Link>> = BTreeMap::new();
        for link in links(grid, labels) {
            let [n, _] = link.nodes;
            let at = [n / grid.rows(), n % grid.rows()];
            beside.entry(at).or_default().push(link);
        }
        Self(beside)
    }

    /// Those of two regions near to a node.
    fn links(&self, at: [usize; 2], regions: [u16; 2]) -> impl Iterator<Item = &Link> {
        let around = |at: usize| at.saturating_sub(BESIDE_NODES)..=at + BESIDE_NODES;
        let nodes = around(at[0]).flat_map(move |i| around(at[1]).map(move |j| [i, j]));
        nodes
            .filter_map(|node| self.0.get(&node))
            .flatten()
            .filter(move |link| regions.iter().all(|region| link.labels.contains(region)))
    }
}

/// Whether the data step as high as a gap between two pieces, each of which may be off by the
/// tolerance, and by more than a crease explains.
fn is_step(link: &Link, z: &[f64], gap_mm: f64, tolerance_mm: f64) -> bool {
    let [n, m] = link.nodes;
    let is_as_high = (z[n] - z[m]).abs() + 2.0 * tolerance_mm >= gap_mm;
    is_as_high && link.jump_mm > LEAST_STEP * tolerance_mm + link.turn_mm / 2.0
}

/// The faces on each edge.
fn sides(model: &Model) -> Vec<Vec<&Face>> {
    let mut sides: Vec<Vec<&Face>> = vec![Vec::new(); model.edges.len()];
    for face in &model.faces {
        let loops = core::iter::once(&face.outer).chain(&face.inner);
        for coedge in loops.flat_map(|of_loop| &of_loop.coedges) {
            if let Some(sides) = sides.get_mut(coedge.edge.0) {
                sides.push(face);
            }
        }
    }
    sides
}

/// How pieces meet on the edges of the model, which is where the image is.
fn meetings(
    grid: &HeightGrid,
    image: &RangeImage,
    map: &RegionMap,
    model: &Model,
    tolerance_mm: f64,
) -> (Lines, Vec<Open>) {
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
    let beside = Beside::of(grid, labels);
    let mut open = Vec::new();
    let pitch_mm = grid.pitch_mm();
    for (edge, sides) in model.edges.iter().zip(sides(model)) {
        let &[a, b] = sides.as_slice() else { continue };
        let (Surface::Patches(over), Surface::Patches(under)) = (&a.surface, &b.surface);
        let regions = [a.region, b.region];
        let (first, last) = edge.path.domain();
        let count = ((last - first) / pitch_mm * PER_PITCH).ceil().max(1.0) as usize;
        let part_mm = (last - first) / count as f64;
        for k in 0..count {
            let [x, y] = edge.path.evaluate(first + part_mm * (k as f64 + 0.5));
            let gap_mm = (over.z(x, y) - under.z(x, y)).abs();
            let at =
                [x - image.x_mm(0), y - image.y_mm(0)].map(|mm| (mm / pitch_mm).max(0.0) as usize);
            let mut links = beside.links(at, regions).peekable();
            let is_far = links.peek().is_none();
            let is_step = links.any(|link| is_step(link, z, gap_mm, tolerance_mm));
            if gap_mm <= tolerance_mm {
                lines.meeting_mm += part_mm;
                lines.greatest_gap_mm = lines.greatest_gap_mm.max(gap_mm);
            } else if is_step {
                lines.step_mm += part_mm;
            } else {
                open.push(Open {
                    at,
                    regions,
                    is_far,
                });
                lines.open_mm += part_mm;
                lines.greatest_gap_mm = lines.greatest_gap_mm.max(gap_mm);
            }
        }
    }
    (lines, open)
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
