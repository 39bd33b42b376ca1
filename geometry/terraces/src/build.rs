//! A part to a solid.

use std::collections::BTreeSet;

use crate::emit::{Emit, cell_volume};
use crate::error::{BuildError, Warning};
use crate::field::{Field, settle};
use crate::outline::Outline;
use crate::part::{Operation, Part};
use crate::plan::P2;
use crate::regions::Scene;
use crate::shell::Shell;
use crate::solid::Solid;
use crate::treat::{earlier, treat};

/// A solid and what was done otherwise than asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// The solid.
    pub solid: Solid,
    /// In order of the operations.
    pub warnings: Vec<Warning>,
}

/// By how many times [`STEP_MM`] an outline is moved outwards at each attempt.
const STEPS: [f64; 8] = [1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 5.0, -5.0];
/// Least move of an outline that would let the solid touch itself, millimetres.
const STEP_MM: f64 = 0.01;
/// Attempts in all.
const ATTEMPTS: usize = 40;
/// An outline is at a place if it is as near as this, millimetres.
const AT_MM: f64 = 1e-3;

/// What an attempt failed of.
struct Failure {
    at: P2,
    what: String,
}

/// What is changed of the part from attempt to attempt.
#[derive(Debug, Clone)]
struct Changes {
    /// By outline, the block's first: moves that were made of it.
    moves: Vec<usize>,
    /// By operation, the block first: upper and lower edges that are left as they are.
    left: Vec<[bool; 2]>,
}

impl Part {
    /// Builds the solid.
    ///
    /// Where the operations would leave a solid that touches itself in a point or along an edge,
    /// the outline at the place is moved by some hundredths of a millimetre; treated edges that
    /// cannot be built are left out. Both are told as warnings. The same part gives the same solid.
    ///
    /// # Errors
    /// [`BuildError`] where numbers make no sense, nothing of the block is left, or no valid solid
    /// came of it; it names the operation.
    pub fn build(&self) -> Result<Built, BuildError> {
        self.validate()?;
        let count = self.operations.len() + 1;
        let mut changes = Changes {
            moves: vec![0; count],
            left: vec![[false; 2]; count],
        };
        let mut last = Failure {
            at: [0.0; 2],
            what: String::new(),
        };
        for _ in 0..ATTEMPTS {
            let outlines = self.outlines(&changes);
            match self.attempt(&outlines, &changes)? {
                Ok(mut built) => {
                    for (k, operation) in self.operations.iter().enumerate() {
                        let moves = changes.moves[k + 1];
                        if moves > 0 {
                            built.warnings.push(Warning::Moved {
                                operation: operation.name.clone(),
                                by_mm: STEPS[moves - 1] * STEP_MM,
                            });
                        }
                    }
                    return Ok(built);
                }
                Err(failure) => {
                    if !self.change(&mut changes, &outlines, failure.at) {
                        return Err(self.invalid(&outlines, failure));
                    }
                    last = failure;
                }
            }
        }
        Err(self.invalid(&self.outlines(&changes), last))
    }

    fn invalid(&self, outlines: &[Outline], failure: Failure) -> BuildError {
        let named = nearest(outlines, failure.at).checked_sub(1);
        let operation = named.and_then(|k| self.operations.get(k));
        BuildError::Invalid {
            name: operation.map_or(&self.name, |o| &o.name).clone(),
            what: failure.what,
        }
    }

    fn validate(&self) -> Result<(), BuildError> {
        let (top_mm, bottom_mm) = (self.top_mm, self.bottom_mm);
        let is_high = top_mm - bottom_mm > crate::outline::LEAST_MM.max(self.snap_mm);
        if !is_high || top_mm.abs() > 1e6 || bottom_mm.abs() > 1e6 {
            return Err(BuildError::Block { top_mm, bottom_mm });
        }
        if !self.frame.is_valid() {
            return Err(BuildError::Frame);
        }
        let mut names = BTreeSet::from([self.name.as_str()]);
        for operation in &self.operations {
            if !names.insert(&operation.name) {
                let name = operation.name.clone();
                return Err(BuildError::Name { name });
            }
        }
        Ok(())
    }

    /// The outlines, the block's first, snapped to earlier ones and moved.
    fn outlines(&self, changes: &Changes) -> Vec<Outline> {
        let mut outlines: Vec<Outline> = vec![self.outline.clone()];
        for (k, operation) in self.operations.iter().enumerate() {
            let moves = changes.moves[k + 1];
            let outline = if moves > 0 {
                let moved = operation.outline.moved(STEPS[moves - 1] * STEP_MM);
                moved.unwrap_or_else(|| operation.outline.clone())
            } else if self.snap_mm > 0.0 {
                let snapped = operation.outline.snapped(&earlier(&outlines), self.snap_mm);
                snapped.unwrap_or_else(|| operation.outline.clone())
            } else {
                operation.outline.clone()
            };
            outlines.push(outline);
        }
        outlines
    }

    /// One attempt, with outlines as they are.
    fn attempt(
        &self,
        outlines: &[Outline],
        changes: &Changes,
    ) -> Result<Result<Built, Failure>, BuildError> {
        let plain = |part: &Self| -> Result<Scene, BuildError> {
            let mut scene = Scene::new(part);
            for (index, outline) in outlines.iter().enumerate() {
                scene.add_operation(part, index, outline)?;
            }
            Ok(scene)
        };
        let mut scene = plain(self)?;
        let mut warnings = Vec::new();
        let mut field = match settle(&mut scene) {
            Ok(field) => field,
            Err(torn) => return Ok(Err(failed(torn.at, "its outline meets others ambiguously"))),
        };
        let has_edges = |o: &Operation| o.upper.is_some() || o.lower.is_some();
        if self.upper.is_some() || self.operations.iter().any(has_edges) {
            let mut target = Scene::new(self);
            for (index, outline) in outlines.iter().enumerate() {
                target.add_operation(self, index, outline)?;
                let left = treat(
                    &mut target,
                    (&scene, &field),
                    self,
                    index,
                    outline,
                    changes.left[index],
                );
                warnings.extend(left.into_iter().map(|(edge, why)| Warning::EdgeLeft {
                    operation: self.operation_name(index),
                    edge,
                    why,
                }));
            }
            scene = target;
            field = match settle(&mut scene) {
                Ok(field) => field,
                Err(torn) => return Ok(Err(failed(torn.at, "its treated edges meet ambiguously"))),
            };
        }
        for &operation in &field.stepped {
            let operation = self.operation_name(operation);
            warnings.push(Warning::Crossing { operation });
        }
        let parts = largest(&mut field, &scene);
        match parts {
            0 => return Err(BuildError::Nothing),
            1 => {}
            parts => warnings.push(Warning::Parted { parts }),
        }
        let shell = match Shell::new(&field, &scene.heights) {
            Ok(shell) => shell,
            Err(torn) => return Ok(Err(failed(torn.at, "faces touch along an edge"))),
        };
        let emit = Emit {
            part: self,
            heights: &scene.heights,
            regions: &scene.regions,
            field: &field,
            shell: &shell,
        };
        let solid = emit.solid();
        if let Err(unsound) = solid.check() {
            let local = self.local(unsound.at_mm);
            return Ok(Err(failed(local, unsound.what)));
        }
        Ok(Ok(Built { solid, warnings }))
    }

    fn operation_name(&self, index: usize) -> String {
        let operation = index.checked_sub(1).and_then(|k| self.operations.get(k));
        operation.map_or(&self.name, |o| &o.name).clone()
    }

    /// A point of space in the plan.
    fn local(&self, p: [f64; 3]) -> P2 {
        let from: [f64; 3] = core::array::from_fn(|k| p[k] - self.frame.origin_mm[k]);
        [self.frame.x, self.frame.y()].map(|d| d.iter().zip(from).map(|(d, f)| d * f).sum())
    }

    /// Changes something at the place of a failure; false if all has been tried. First treated
    /// edges are left out, then the last of the outlines there is moved.
    fn change(&self, changes: &mut Changes, outlines: &[Outline], at: P2) -> bool {
        let off = |index: usize| {
            let pieces = outlines[index].pieces().iter();
            let near = pieces.map(|piece| crate::build::off(piece, at));
            near.fold(f64::INFINITY, f64::min)
        };
        let treatments = |index: usize| match index {
            0 => [self.upper, None],
            _ => [
                self.operations[index - 1].upper,
                self.operations[index - 1].lower,
            ],
        };
        let mut order: Vec<(f64, usize)> = (0..outlines.len())
            .map(|index| {
                let wide = treatments(index)
                    .into_iter()
                    .flatten()
                    .map(|t| t.width_mm());
                let reach = wide.fold(0.0, f64::max);
                ((off(index) - 1.5 * reach).max(0.0), index)
            })
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        let near = order.iter().filter(|(off, _)| *off < AT_MM);
        // What is near the place first, then all the rest.
        for &(_, index) in near.chain(order.iter().filter(|(off, _)| *off >= AT_MM)) {
            let is_treated = treatments(index).map(|t| t.is_some());
            for k in [1, 0] {
                if is_treated[k] && !changes.left[index][k] {
                    changes.left[index][k] = true;
                    return true;
                }
            }
            if index > 0 && off(index) < AT_MM && changes.moves[index] < STEPS.len() {
                changes.moves[index] += 1;
                return true;
            }
        }
        // Torn at no outline in particular: the last that may still be moved.
        let movable = (1..outlines.len()).rev();
        let mut movable = movable.filter(|&index| changes.moves[index] < STEPS.len());
        movable.next().is_some_and(|index| {
            changes.moves[index] += 1;
            true
        })
    }
}

fn failed(at: P2, what: &str) -> Failure {
    Failure {
        at,
        what: what.to_owned(),
    }
}

/// Distance of a point from a piece.
fn off(piece: &crate::plan::Piece, at: P2) -> f64 {
    let ends = [piece.from(), piece.to()].map(|end| crate::plan::distance(end, at));
    let support = piece.support();
    let t = support.parameter(at);
    let foot = support.at(t);
    let middle = piece.at(0.5);
    let reach = crate::plan::distance(middle, piece.from());
    let on = if crate::plan::distance(foot, middle) <= reach {
        support.distance(at)
    } else {
        f64::INFINITY
    };
    on.min(ends[0]).min(ends[1])
}

fn nearest(outlines: &[Outline], at: P2) -> usize {
    let least = |outline: &Outline| {
        let pieces = outline.pieces().iter().map(|piece| off(piece, at));
        pieces.fold(f64::INFINITY, f64::min)
    };
    let all = (0..outlines.len()).rev();
    all.min_by(|&a, &b| {
        let round = |x: f64| (x / AT_MM).floor();
        round(least(&outlines[a])).total_cmp(&round(least(&outlines[b])))
    })
    .unwrap_or(0)
}

/// Leaves only the largest of the parts that hang together; returns how many there were.
fn largest(field: &mut Field, scene: &Scene) -> usize {
    let count = field.plan.cells.len();
    let mut parent: Vec<usize> = (0..count).collect();
    for edge in &field.plan.edges {
        let [a, b] = edge.cells;
        if field.surface[a] != 0 && field.surface[b] != 0 {
            crate::union::join(&mut parent, a, b);
        }
    }
    let roots: Vec<usize> = (0..count)
        .map(|cell| crate::union::root(&mut parent, cell))
        .collect();
    let mut volumes = vec![0.0; count];
    for cell in (1..count).filter(|&cell| field.surface[cell] != 0) {
        volumes[roots[cell]] += cell_volume(field, &scene.heights, cell);
    }
    let parts: Vec<usize> = (1..count)
        .filter(|&cell| roots[cell] == cell && field.surface[cell] != 0)
        .collect();
    let kept = parts
        .iter()
        .copied()
        .max_by(|&a, &b| volumes[a].total_cmp(&volumes[b]));
    for (surface, root) in field.surface.iter_mut().zip(&roots) {
        if Some(*root) != kept {
            *surface = 0;
        }
    }
    parts.len()
}
