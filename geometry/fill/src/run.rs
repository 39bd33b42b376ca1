//! From a mesh with holes to one without.

use std::collections::BTreeSet;

use glam::DVec3;
use range_image::Monitor;
use rayon::prelude::*;

use crate::error::FillError;
use crate::holes::{Hole, HoleKind, holes};
use crate::implicit::{FitSettings, Implicit, Kernel};
use crate::loops::loops;
use crate::meet::meetings;
use crate::mesh::{Edges, Mended, Stars, TriangleMesh, mend, split_fans};
use crate::patch::{Patch, Polygon, Trouble, grow};
use crate::region::around;
use crate::settings::{Method, Precision, Settings};

/// What a mesh is, before anything is closed.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// What was mended.
    pub mended: Mended,
    /// Loops of border edges.
    pub holes: Vec<Hole>,
}

/// What became of a loop.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// Closed.
    Filled {
        /// Radial function of the surface; `None` where the elements are only fair.
        kernel: Option<Kernel>,
        /// Points of the mesh that the surface was put through.
        points: usize,
        /// Radial functions in it.
        centres: usize,
        /// What the points lie off the surface, root mean square, millimetres.
        noise_mm: f64,
        /// New vertices.
        vertices: usize,
        /// New triangles.
        triangles: usize,
    },
    /// Left open since its number was named.
    Kept,
    /// Left open since it is the border of an open sheet.
    Border,
    /// Closed, or left open, with the hole around it.
    Island {
        /// The number of that hole.
        hole: usize,
    },
    /// Left open since it cannot be closed.
    Open {
        /// Why.
        reason: String,
    },
}

/// A loop and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct HoleReport {
    /// The loop.
    pub hole: Hole,
    /// What became of it.
    pub outcome: Outcome,
}

/// A mesh with its holes closed.
#[derive(Debug, Clone, PartialEq)]
pub struct Filled {
    /// The triangles that were there first, in their order, then the new ones.
    pub mesh: TriangleMesh,
    /// How many were there.
    pub old_triangles: usize,
    /// What was mended.
    pub mended: Mended,
    /// What became of every loop.
    pub holes: Vec<HoleReport>,
}

/// Points in the dense part of a fit: as many as these times the loop's vertices, between two bounds.
const CENTRES_PER_VERTEX: usize = 6;
const FEWEST_CENTRES: usize = 160;
const MOST_CENTRES: usize = 600;

struct Prepared {
    mesh: TriangleMesh,
    stars: Stars,
    survey: Survey,
}

fn prepare(mut mesh: TriangleMesh, settings: &Settings) -> Result<Prepared, FillError> {
    settings.validate()?;
    let mended = mend(&mut mesh, settings.weld_mm)?;
    let edges = Edges::of(&mesh.triangles);
    let loops = loops(&mesh, &edges);
    let stars = Stars::of(&mesh);
    let holes = holes(&mesh, loops, &stars);
    for &number in settings.keep.iter().chain(&settings.force) {
        if number == 0 || number > holes.len() {
            return Err(FillError::NoLoop {
                number,
                loops: holes.len(),
            });
        }
    }
    Ok(Prepared {
        mesh,
        stars,
        survey: Survey { mended, holes },
    })
}

/// Mends a mesh and finds its loops.
///
/// # Errors
/// [`FillError`] for what is no mesh, or settings that are out of their ranges.
pub fn survey(mesh: TriangleMesh, settings: &Settings) -> Result<Survey, FillError> {
    Ok(prepare(mesh, settings)?.survey)
}

/// Mends a mesh and closes its holes. The result does not depend on the number of threads.
///
/// # Errors
/// [`FillError`] for what is no mesh, or settings that are out of their ranges; a hole that cannot be
/// closed is none: it is left open, with its reason.
pub fn fill(
    mesh: TriangleMesh,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Filled, FillError> {
    let prepared = prepare(mesh, settings)?;
    monitor.check()?;
    let plan = planned(&prepared.survey.holes, settings);
    let mut outcomes: Vec<Outcome> = plan
        .iter()
        .map(|own| match own {
            Planned::Leave(outcome) => outcome.clone(),
            Planned::Close(_) => Outcome::Open {
                reason: String::new(),
            },
        })
        .collect();
    let mut patches: Vec<Option<Patch>> = vec![None; plan.len()];
    let mut left: Vec<usize> = (0..plan.len())
        .filter(|&k| matches!(plan[k], Planned::Close(_)))
        .collect();
    let there: Vec<[DVec3; 3]> = prepared
        .mesh
        .triangles
        .iter()
        .map(|&t| prepared.mesh.corners(t))
        .collect();
    let attempts = attempts(settings);
    let total = left.len().max(1);
    for (number, attempt) in attempts.iter().enumerate() {
        if left.is_empty() {
            break;
        }
        let is_first = number == 0;
        let done = std::sync::atomic::AtomicUsize::new(0);
        let told = std::sync::Mutex::new(0);
        let close = |&k: &usize| {
            if monitor.is_cancelled() {
                return None;
            }
            let Planned::Close(islands) = &plan[k] else {
                return None;
            };
            let own = attempted(&prepared, k, islands, *attempt, settings);
            let count = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            if is_first
                && let Ok(mut told) = told.lock()
                && count > *told
            {
                *told = count;
                monitor.progress(0.9 * count as f64 / total as f64);
            }
            Some(own)
        };
        let found: Vec<_> = left.par_iter().with_max_len(1).map(close).collect();
        monitor.check()?;
        for (&k, found) in left.iter().zip(found) {
            match found {
                Some(Ok((patch, outcome))) => {
                    patches[k] = Some(patch);
                    outcomes[k] = outcome;
                }
                Some(Err(trouble)) => outcomes[k] = open(trouble),
                None => {}
            }
        }
        let groups: Vec<Vec<[DVec3; 3]>> = patches
            .iter()
            .map(|patch| patch.as_ref().map_or_else(Vec::new, |own| corners(&prepared.mesh, own)))
            .collect();
        let bad = meetings(&groups, &there);
        left.retain(|&k| patches[k].is_none());
        for (k, count) in bad.into_iter().enumerate() {
            if count > 0 {
                patches[k] = None;
                outcomes[k] = open(Trouble::Intersects(count));
                left.push(k);
            }
        }
        left.sort_unstable();
    }
    monitor.progress(1.0);
    Ok(joined(prepared, patches, outcomes))
}

fn open(trouble: Trouble) -> Outcome {
    Outcome::Open {
        reason: trouble.to_string(),
    }
}

enum Planned {
    /// With islands, by their places among the loops.
    Close(Vec<usize>),
    Leave(Outcome),
}

fn planned(holes: &[Hole], settings: &Settings) -> Vec<Planned> {
    let is_forced = |hole: &Hole| settings.force.contains(&hole.number);
    holes
        .iter()
        .map(|hole| match hole.kind {
            _ if settings.keep.contains(&hole.number) => Planned::Leave(Outcome::Kept),
            HoleKind::Border if !is_forced(hole) => Planned::Leave(Outcome::Border),
            HoleKind::Island(number) if !is_forced(hole) => {
                Planned::Leave(Outcome::Island { hole: number })
            }
            _ => {
                let is_in = |other: &&Hole| {
                    other.kind == HoleKind::Island(hole.number)
                        && !settings.keep.contains(&other.number)
                        && !is_forced(other)
                };
                let islands = holes.iter().filter(is_in).map(|own| own.number - 1);
                Planned::Close(islands.collect())
            }
        })
        .collect()
}

/// Ways to close a hole, in the order in which they are tried.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Attempt {
    /// By an implicit surface.
    Surface(Kernel),
    /// By a fair net alone.
    Fair,
}

fn attempts(settings: &Settings) -> Vec<Attempt> {
    let first = settings.kernel();
    let mut kernels: Vec<Kernel> = vec![first];
    if settings.method == Method::Relief && first == Kernel::Quintic {
        kernels.push(Kernel::Triharmonic);
    }
    let mut own: Vec<Attempt> = kernels.into_iter().map(Attempt::Surface).collect();
    own.push(Attempt::Fair);
    own
}

fn attempted(
    prepared: &Prepared,
    k: usize,
    islands: &[usize],
    attempt: Attempt,
    settings: &Settings,
) -> Result<(Patch, Outcome), Trouble> {
    let Prepared {
        mesh,
        stars,
        survey,
    } = prepared;
    let hole = &survey.holes[k];
    let islands: Vec<&Hole> = islands.iter().map(|&k| &survey.holes[k]).collect();
    let loops: Vec<&Hole> = std::iter::once(hole).chain(islands.iter().copied()).collect();
    let polygon = Polygon::of(mesh, stars, hole, &islands);
    let mut points = 0;
    let surface = match attempt {
        Attempt::Fair => None,
        Attempt::Surface(kernel) => {
            let samples = around(mesh, stars, &loops, hole.size_mm);
            points = samples.len();
            let most = (CENTRES_PER_VERTEX * polygon.chain.len()).clamp(FEWEST_CENTRES, MOST_CENTRES);
            let fit = FitSettings {
                kernel,
                most_centres: most,
                ..FitSettings::default()
            };
            Implicit::fit(&samples, hole.size_mm, &fit).ok()
        }
    };
    let mut patch = grow(mesh, stars, &polygon, surface.as_ref(), settings.max_edge_mm)?;
    if settings.precision == Precision::Single {
        for place in &mut patch.places {
            *place = DVec3::from_array(place.to_array().map(|c| f64::from(c as f32)));
        }
    }
    let outcome = Outcome::Filled {
        kernel: match attempt {
            Attempt::Surface(kernel) if surface.is_some() => Some(kernel),
            _ => None,
        },
        points,
        centres: surface.as_ref().map_or(0, Implicit::centres),
        noise_mm: surface.as_ref().map_or(0.0, Implicit::noise_mm),
        vertices: patch.places.len(),
        triangles: patch.triangles.len(),
    };
    Ok((patch, outcome))
}

fn corners(mesh: &TriangleMesh, patch: &Patch) -> Vec<[DVec3; 3]> {
    let border = patch.border.len();
    let at = |v: u32| match patch.border.get(v as usize) {
        Some(&own) => mesh.place(own),
        None => patch.places[v as usize - border],
    };
    patch.triangles.iter().map(|t| t.map(at)).collect()
}

fn joined(prepared: Prepared, patches: Vec<Option<Patch>>, outcomes: Vec<Outcome>) -> Filled {
    let Prepared {
        mut mesh, survey, ..
    } = prepared;
    let old_triangles = mesh.triangles.len();
    for patch in patches.into_iter().flatten() {
        let (first, border) = (mesh.vertices_mm.len() as u32, patch.border.len() as u32);
        mesh.vertices_mm.extend(patch.places.iter().map(DVec3::to_array));
        let id = |v: u32| match patch.border.get(v as usize) {
            Some(&own) => own,
            None => v - border + first,
        };
        mesh.triangles.extend(patch.triangles.iter().map(|t| t.map(id)));
    }
    let mut mended = survey.mended;
    mended.split_vertices = split_fans(&mut mesh);
    let holes = survey.holes.into_iter().zip(outcomes);
    Filled {
        mesh,
        old_triangles,
        mended,
        holes: holes
            .map(|(hole, outcome)| HoleReport { hole, outcome })
            .collect(),
    }
}

impl Filled {
    /// Numbers of holes that could not be closed.
    #[must_use]
    pub fn open(&self) -> BTreeSet<usize> {
        let is_open = |own: &&HoleReport| matches!(own.outcome, Outcome::Open { .. });
        self.holes
            .iter()
            .filter(is_open)
            .map(|own| own.hole.number)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Unmonitored;

    #[test]
    fn nothing_is_filled_without_triangles() {
        let settings = Settings::default();
        let empty = fill(TriangleMesh::default(), &settings, &Unmonitored);
        assert_eq!(empty, Err(FillError::Empty));
    }
}
