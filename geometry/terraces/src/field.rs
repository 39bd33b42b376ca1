//! The surface of each cell, after all that was done.

use crate::arrange::{Arrangement, Cell, POINT_MM, Torn};
use crate::contour::contour;
use crate::height::Height;
use crate::plan::{P2, add, distance, encloses, scale};
use crate::regions::{Rule, Scene};

/// Heights nearer to each other are one, millimetres.
pub(crate) const LEVEL_MM: f64 = 5e-6;
/// Places along an edge at which two heights are compared.
const ALONG: usize = 32;
/// Rounds of drawing where surfaces cross.
const ROUNDS: usize = 12;

/// The divided plan with the surface of each cell.
#[derive(Debug, Clone, Default)]
pub(crate) struct Field {
    pub(crate) plan: Arrangement,
    /// By cell: its surface; 0 where there is nothing above the bottom.
    pub(crate) surface: Vec<usize>,
    /// By region, then by cell: the surfaces after it was done.
    pub(crate) after: Vec<Vec<usize>>,
    /// Operations whose floors cross others along no line or circle.
    pub(crate) stepped: Vec<usize>,
}

/// Divides the plan until no cell has surfaces that cross, and no edge heights that do.
pub(crate) fn settle(scene: &mut Scene) -> Result<Field, Torn> {
    for round in 0.. {
        let plan = Arrangement::new(&scene.drawing, scene.regions.len())?;
        let drawn = scene.drawing.curves.len();
        let field = evaluate(plan, scene);
        if scene.drawing.curves.len() > drawn && round < ROUNDS {
            continue;
        }
        let cuts = cuts(&field, scene);
        if cuts.is_empty() || round >= ROUNDS {
            return Ok(field);
        }
        scene.drawing.cuts.extend(cuts);
    }
    Ok(Field::default())
}

/// Applies all regions; draws where surfaces cross.
fn evaluate(plan: Arrangement, scene: &mut Scene) -> Field {
    let samples: Vec<Vec<P2>> = plan.cells.iter().map(|cell| samples(&plan, cell)).collect();
    let mut field = Field {
        surface: vec![0; plan.cells.len()],
        ..Field::default()
    };
    let is_block: Vec<bool> = plan
        .cells
        .iter()
        .map(|cell| cell.within.first() == Some(&true))
        .collect();
    for index in 0..scene.regions.len() {
        let region = scene.regions[index].clone();
        for (cell, samples) in samples.iter().enumerate().skip(1) {
            if !plan.cells[cell].within[index] || !is_block[cell] {
                continue;
            }
            let old = field.surface[cell];
            let (sign, is_kept) = match region.rule {
                Rule::Fill => {
                    field.surface[cell] = region.height;
                    continue;
                }
                Rule::Lower { ceiling } => {
                    let top = extreme(&scene.heights[old], samples, 1.0);
                    (1.0, top > ceiling + LEVEL_MM)
                }
                Rule::Lift { floor } => {
                    let low = -extreme(&scene.heights[old], samples, -1.0);
                    (-1.0, low < floor - LEVEL_MM)
                }
            };
            if is_kept || old == region.height {
                continue;
            }
            let change = compare(scene, region.height, old, sign, samples);
            let is_new = match change {
                Change::None => false,
                Change::All => true,
                Change::Some { most } => {
                    let key = (Some(index), old, region.height);
                    if !draw(scene, key, region.bounds) {
                        field.stepped.push(region.operation);
                    }
                    most
                }
            };
            if is_new {
                field.surface[cell] = region.height;
            }
        }
        field.after.push(field.surface.clone());
    }
    for (cell, samples) in samples.iter().enumerate().skip(1) {
        let old = field.surface[cell];
        let is_void = old != 0
            && match compare(scene, 0, old, -1.0, samples) {
                Change::None => false,
                Change::All => true,
                Change::Some { most } => {
                    let bounds = scene.regions[0].bounds;
                    draw(scene, (None, old, 0), bounds);
                    most
                }
            };
        if is_void {
            field.surface[cell] = 0;
        }
    }
    field.stepped.sort_unstable();
    field.stepped.dedup();
    field.plan = plan;
    field
}

enum Change {
    None,
    All,
    /// In part; `most` where that is the larger one.
    Some {
        most: bool,
    },
}

/// Whether a surface is below another (sign 1) or above it (-1).
fn compare(scene: &Scene, new: usize, old: usize, sign: f64, at: &[P2]) -> Change {
    let (new, old) = (&scene.heights[new], &scene.heights[old]);
    let (mut least, mut most, mut sum) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
    for &q in at {
        let by = sign * (old.at(q) - new.at(q));
        least = least.min(by);
        most = most.max(by);
        sum += by;
    }
    if most <= LEVEL_MM {
        Change::None
    } else if least >= -LEVEL_MM {
        Change::All
    } else {
        Change::Some { most: sum > 0.0 }
    }
}

fn extreme(height: &Height, at: &[P2], sign: f64) -> f64 {
    let heights = at.iter().map(|&q| sign * height.at(q));
    heights.fold(f64::NEG_INFINITY, f64::max)
}

/// Draws where two surfaces cross; false if that is not known, or was to no avail.
fn draw(scene: &mut Scene, key: (Option<usize>, usize, usize), bounds: [P2; 2]) -> bool {
    if !scene.crossed.insert(key) {
        return false;
    }
    let (a, b) = (&scene.heights[key.1], &scene.heights[key.2]);
    if let Some(supports) = a.crossing(b) {
        for support in supports {
            scene.drawing.add_across(support, bounds);
        }
        return true;
    }
    // Nothing is done beyond the block.
    let block = scene.regions[0].bounds;
    let bounds = [
        [0, 1].map(|k| bounds[0][k].max(block[0][k])),
        [0, 1].map(|k| bounds[1][k].min(block[1][k])),
    ];
    let Some(pieces) = contour(a, b, bounds) else {
        return false;
    };
    for piece in &pieces {
        scene.drawing.add(piece, None, false);
    }
    true
}

/// Places of a cell: along its border and within.
fn samples(plan: &Arrangement, cell: &Cell) -> Vec<P2> {
    let mut at: Vec<P2> = Vec::new();
    for half in cell.loops.iter().flatten() {
        at.extend([0.0, 0.25, 0.5, 0.75, 1.0].map(|part| plan.on_edge(half.edge, part)));
    }
    let pieces: Vec<Vec<_>> = cell
        .loops
        .iter()
        .map(|halves| halves.iter().map(|&half| plan.half_piece(half)).collect())
        .collect();
    let (count, step) = (at.len(), (at.len() / 12).max(1));
    for k in (0..count).step_by(step) {
        let across = at[(k + count / 2) % count];
        for part in [0.25, 0.5] {
            let q = add(scale(at[k], 1.0 - part), scale(across, part));
            let mut within = pieces.iter().enumerate();
            if within.all(|(n, pieces)| encloses(pieces, q) == (n == 0)) {
                at.push(q);
            }
        }
    }
    at
}

/// Where edges must be divided, since the heights on both sides change places along them.
fn cuts(field: &Field, scene: &Scene) -> Vec<(usize, f64)> {
    let mut cuts = Vec::new();
    for (index, edge) in field.plan.edges.iter().enumerate() {
        let [a, b] = edge.cells.map(|cell| field.surface[cell]);
        if a == b {
            continue;
        }
        let (a, b) = (&scene.heights[a], &scene.heights[b]);
        let at = |part: f64| field.plan.on_edge(index, part);
        let by = |part: f64| a.at(at(part)) - b.at(at(part));
        let part = |k: usize| k as f64 / ALONG as f64;
        let values: Vec<f64> = (0..=ALONG).map(|k| by(part(k))).collect();
        let mut found = |part: f64| {
            let near = |end: f64| distance(at(part), at(end)) < 2.0 * POINT_MM;
            if !near(0.0) && !near(1.0) {
                cuts.push((edge.support, edge.from + part * (edge.to - edge.from)));
            }
        };
        if values.iter().all(|value| value.abs() < LEVEL_MM) {
            continue;
        }
        for k in 0..ALONG {
            let (before, after) = (values[k], values[k + 1]);
            if before.abs() < LEVEL_MM {
                if k > 0 {
                    found(part(k));
                }
            } else if before * after < 0.0 && after.abs() >= LEVEL_MM {
                found(bisect(&by, part(k), part(k + 1)));
            } else if k > 0 && before.abs() < values[k - 1].abs() && before.abs() <= after.abs() {
                let low = lowest(&|p| by(p).abs(), part(k - 1), part(k + 1));
                if by(low).abs() < LEVEL_MM {
                    found(low);
                } else if by(low) * before < 0.0 {
                    found(bisect(&by, part(k - 1), low));
                    found(bisect(&by, low, part(k + 1)));
                }
            }
        }
    }
    cuts
}

fn bisect(f: &impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    let first = f(a);
    for _ in 0..60 {
        let middle = 0.5 * (a + b);
        if f(middle) * first > 0.0 {
            a = middle;
        } else {
            b = middle;
        }
    }
    0.5 * (a + b)
}

fn lowest(f: &impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    for _ in 0..60 {
        let (p, q) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
        if f(p) < f(q) {
            b = q;
        } else {
            a = p;
        }
    }
    0.5 * (a + b)
}
