//! Which edges can be treated, and the regions that treat them.

use crate::bands::{Place, bands, piece_at};
use crate::field::Field;
use crate::height::Height;
use crate::outline::Outline;
use crate::part::{Kind, Part, Treatment};
use crate::plan::Piece;
use crate::regions::{Region, Role, Rule, Scene};

/// What stands along an outline once its operation is done.
#[derive(Debug, Clone)]
struct Walls {
    /// By piece of the outline: a wall stands there; there could be one, but there is none.
    stands: Vec<bool>,
    is_open: Vec<bool>,
    /// Surfaces at the top and at the foot of the walls.
    tops: Vec<usize>,
    feet: Vec<usize>,
    /// The least height of a wall.
    least_mm: f64,
}

/// Looks along the outline of an operation (0 is the block). `region` is the operation's own.
fn walls(scene: &Scene, field: &Field, outline: &Outline, region: usize, is_cut: bool) -> Walls {
    let count = outline.pieces().len();
    let mut walls = Walls {
        stands: vec![false; count],
        is_open: vec![false; count],
        tops: Vec::new(),
        feet: Vec::new(),
        least_mm: f64::INFINITY,
    };
    let own = scene.regions[region].height;
    let (plan, after) = (&field.plan, &field.after[region]);
    for (index, edge) in plan.edges.iter().enumerate() {
        if !edge.owners.contains(&region) {
            continue;
        }
        let is_inside = |cell: usize| plan.cells[cell].within[region];
        let [left, right] = edge.cells;
        let (inside, outside) = if is_inside(left) {
            (left, right)
        } else {
            (right, left)
        };
        let is_block = |cell: usize| plan.cells[cell].within[0];
        if !is_block(inside) || after[inside] != own || (is_cut && !is_block(outside)) {
            continue;
        }
        let Some(piece) = piece_at(outline, plan.on_edge(index, 0.5)) else {
            continue;
        };
        let (top, foot) = if is_cut {
            (outside, inside)
        } else {
            (inside, outside)
        };
        let (top, foot) = (after[top], after[foot]);
        let height = [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| {
            let at = plan.on_edge(index, part);
            scene.heights[top].at(at) - scene.heights[foot].at(at)
        });
        let height_mm = height.into_iter().fold(f64::INFINITY, f64::min);
        if height_mm < crate::outline::LEAST_MM {
            walls.is_open[piece] = true;
            continue;
        }
        walls.stands[piece] = true;
        walls.least_mm = walls.least_mm.min(height_mm);
        walls.tops.push(top);
        // What is open down to the bottom has no lower edge.
        if foot != 0 {
            walls.feet.push(foot);
        }
    }
    for list in [&mut walls.tops, &mut walls.feet] {
        list.sort_unstable();
        list.dedup();
    }
    walls
}

/// Adds the bands of an operation's edges to a scene, after the operation itself. What is left
/// out is returned, with why.
pub(crate) fn treat(
    target: &mut Scene,
    (scene, field): (&Scene, &Field),
    part: &Part,
    index: usize,
    outline: &Outline,
    left_out: [bool; 2],
) -> Vec<(&'static str, String)> {
    let (upper, lower, is_cut) = match index.checked_sub(1).map(|k| &part.operations[k]) {
        None => (part.upper, None, false),
        Some(of) => (of.upper, of.lower, of.kind == Kind::Cut),
    };
    let mut warnings = Vec::new();
    if upper.is_none() && lower.is_none() {
        return warnings;
    }
    let walls = walls(scene, field, outline, index, is_cut);
    let both = upper.map_or(0.0, |t| t.height_mm()) + lower.map_or(0.0, |t| t.height_mm());
    for (treatment, is_upper, is_left) in [(lower, false, left_out[1]), (upper, true, left_out[0])]
    {
        let Some(treatment) = treatment else { continue };
        let edge = if is_upper { "upper" } else { "lower" };
        let done = if is_left {
            Err("no valid solid comes of it".to_owned())
        } else if both > walls.least_mm - 1e-9 {
            Err(format!("its walls are only {:.3} mm high", walls.least_mm))
        } else {
            add(
                target,
                (scene, &walls),
                (index, outline),
                (treatment, is_upper, is_cut),
            )
        };
        if let Err(why) = done {
            warnings.push((edge, why));
        }
    }
    warnings
}

fn add(
    target: &mut Scene,
    (scene, walls): (&Scene, &Walls),
    (index, outline): (usize, &Outline),
    (treatment, is_upper, is_cut): (Treatment, bool, bool),
) -> Result<(), String> {
    if !walls.stands.contains(&true) {
        return Err("there is no wall".to_owned());
    }
    let partly = walls
        .stands
        .iter()
        .zip(&walls.is_open)
        .any(|(&a, &b)| a && b);
    if partly {
        return Err("its walls do not stand all along".to_owned());
    }
    let met = if is_upper { &walls.tops } else { &walls.feet };
    let z = match met[..] {
        [surface] => match scene.heights[surface] {
            Height::Level { z } => z,
            _ => return Err("the surface that it meets is not level".to_owned()),
        },
        [] => return Err("there is no floor".to_owned()),
        _ => return Err("it meets several surfaces".to_owned()),
    };
    let place = Place {
        is_outside: is_cut == is_upper,
        is_upper,
        z,
    };
    let made = bands(outline, &walls.stands, treatment, place).map_err(str::to_owned)?;
    for band in made {
        let height = target.height(band.height, 1e-9);
        let mut bounds = outline.bounds();
        for (bound, by) in bounds.iter_mut().zip([-1.0, 1.0]) {
            *bound = bound.map(|c| c + by * treatment.width_mm());
        }
        let region = Region {
            operation: index,
            role: if is_upper {
                Role::UpperEdge
            } else {
                Role::LowerEdge
            },
            height,
            rule: if is_upper {
                Rule::Lower { ceiling: z }
            } else {
                Rule::Lift { floor: z }
            },
            bounds,
        };
        target.add(region, &band.border);
        for end in &band.ends {
            target.drawing.add(end, None, true);
        }
    }
    Ok(())
}

/// All pieces of outlines so far, for later ones to be snapped to.
pub(crate) fn earlier(outlines: &[Outline]) -> Vec<Piece> {
    outlines
        .iter()
        .flat_map(|of| of.pieces().iter().copied())
        .collect()
}
