//! From a mesh with holes to one without.

use std::collections::BTreeSet;

use glam::DVec3;
use range_image::Monitor;
use rayon::prelude::*;

use crate::error::FillError;
use crate::holes::{Hole, HoleKind, holes};
use crate::implicit::{FitSettings, Implicit, Kernel, Solver};
use crate::loops::loops;
use crate::meet::meetings;
use crate::mesh::{Edges, Mended, Stars, TriangleMesh, mend, split_fans};
use crate::patch::{Ground, Patch, Polygon, Trouble, grow};
use crate::region::{around, edge_length, mean_normal};
use crate::settings::{Method, Precision, Settings};
use crate::yoo::{Base, Trim, TrimmedPatch, Unseen, base, elements, trim};

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
    /// The hole as a trimmed surface, where that was asked for; or why it has none.
    pub patch: Option<Result<TrimmedPatch, String>>,
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
/// Most points whose whole system is eliminated by the paper's way.
const MOST_ELIMINATED: usize = 2500;

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
    let mut trimmed: Vec<Option<Result<TrimmedPatch, String>>> = vec![None; plan.len()];
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
            // The surface beside a border leads away from it.
            let attempt = match prepared.survey.holes[k].kind {
                HoleKind::Border => Attempt::Fair,
                _ => *attempt,
            };
            let own = attempted(&prepared, k, islands, attempt, settings);
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
                Some(Ok(closed)) => {
                    patches[k] = Some(closed.patch);
                    outcomes[k] = closed.outcome;
                    trimmed[k] = closed.trimmed;
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
                trimmed[k] = None;
                outcomes[k] = open(Trouble::Intersects(count));
                left.push(k);
            }
        }
        left.sort_unstable();
    }
    monitor.progress(1.0);
    Ok(joined(prepared, patches, outcomes, trimmed))
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
    /// On a trimmed surface of patches through an implicit surface.
    Trimmed(Kernel),
    /// On an implicit surface.
    Surface(Kernel),
    /// By a fair net alone.
    Fair,
}

impl Attempt {
    fn kernel(self) -> Option<Kernel> {
        match self {
            Self::Trimmed(kernel) | Self::Surface(kernel) => Some(kernel),
            Self::Fair => None,
        }
    }
}

fn attempts(settings: &Settings) -> Vec<Attempt> {
    let kernel = settings.kernel();
    match settings.method {
        // What its mean normal does not see whole is closed on the same surface itself.
        Method::Yoo => vec![Attempt::Trimmed(kernel), Attempt::Surface(kernel), Attempt::Fair],
        Method::Relief if kernel == Kernel::Quintic => vec![
            Attempt::Surface(kernel),
            Attempt::Surface(Kernel::Triharmonic),
            Attempt::Fair,
        ],
        Method::Relief => vec![Attempt::Surface(kernel), Attempt::Fair],
    }
}

/// A hole that is closed, as far as its own elements go.
struct Closed {
    patch: Patch,
    outcome: Outcome,
    trimmed: Option<Result<TrimmedPatch, String>>,
}

fn fit_settings(kernel: Kernel, method: Method, points: usize, border: usize) -> FitSettings {
    let most = (CENTRES_PER_VERTEX * border).clamp(FEWEST_CENTRES, MOST_CENTRES);
    let is_whole = method == Method::Yoo && points <= MOST_ELIMINATED;
    FitSettings {
        kernel,
        most_centres: most,
        solver: if is_whole {
            Solver::Elimination
        } else {
            Solver::Levels
        },
        ..FitSettings::default()
    }
}

fn attempted(
    prepared: &Prepared,
    k: usize,
    islands: &[usize],
    attempt: Attempt,
    settings: &Settings,
) -> Result<Closed, Trouble> {
    let Prepared {
        mesh,
        stars,
        survey,
    } = prepared;
    let hole = &survey.holes[k];
    let islands: Vec<&Hole> = islands.iter().map(|&k| &survey.holes[k]).collect();
    let loops: Vec<&Hole> = std::iter::once(hole).chain(islands.iter().copied()).collect();
    let samples = match attempt {
        Attempt::Fair => Vec::new(),
        _ => around(mesh, stars, &loops, hole.size_mm),
    };
    let border: usize = loops.iter().map(|own| own.vertices.len()).sum();
    let surface = attempt.kernel().and_then(|kernel| {
        let fit = fit_settings(kernel, settings.method, samples.len(), border);
        Implicit::fit(&samples, hole.size_mm, &fit).ok()
    });
    let seen = surface.as_ref().map(|own| {
        let wanted = settings.patches || matches!(attempt, Attempt::Trimmed(_));
        wanted.then(|| Seen::of(prepared, &loops, own, mean_normal(&samples), settings))
    });
    let seen = seen.flatten();
    let mut patch = match (attempt, &seen) {
        (Attempt::Trimmed(_), Some(Ok(seen))) => seen.elements(&loops)?,
        (Attempt::Trimmed(_), Some(Err(unseen))) => return Err(Trouble::Unseen(*unseen)),
        _ => {
            let polygon = Polygon::of(mesh, stars, hole, &islands);
            let ground = match &surface {
                Some(own) => Ground::Surface(own),
                None if hole.kind == HoleKind::Border => Ground::Flat,
                None => Ground::Fair,
            };
            grow(mesh, stars, &polygon, ground, settings.max_edge_mm)?
        }
    };
    if settings.precision == Precision::Single {
        for place in &mut patch.places {
            *place = DVec3::from_array(place.to_array().map(|c| f64::from(c as f32)));
        }
    }
    let outcome = Outcome::Filled {
        kernel: attempt.kernel().filter(|_| surface.is_some()),
        points: samples.len(),
        centres: surface.as_ref().map_or(0, Implicit::centres),
        noise_mm: surface.as_ref().map_or(0.0, Implicit::noise_mm),
        vertices: patch.places.len(),
        triangles: patch.triangles.len(),
    };
    let trimmed = settings.patches.then(|| match seen {
        Some(Ok(seen)) => {
            let patch = seen.trim.patch(hole.number, &seen.base);
            patch.ok_or_else(|| Unseen::NoElements.to_string())
        }
        Some(Err(unseen)) => Err(unseen.to_string()),
        None => Err("no implicit surface closes it".to_owned()),
    });
    Ok(Closed {
        patch,
        outcome,
        trimmed,
    })
}

/// A hole on its base surface.
struct Seen {
    base: Base,
    trim: Trim,
    edge_mm: f64,
}

impl Seen {
    fn of(
        prepared: &Prepared,
        loops: &[&Hole],
        surface: &Implicit,
        normal: DVec3,
        settings: &Settings,
    ) -> Result<Self, Unseen> {
        let Prepared { mesh, stars, .. } = prepared;
        let places = |own: &&Hole| own.vertices.iter().map(|&v| mesh.place(v)).collect();
        let rings: Vec<Vec<DVec3>> = loops.iter().map(places).collect();
        let (mut sum, mut count) = (0.0, 0.0);
        for &vertex in loops.iter().flat_map(|own| &own.vertices) {
            sum += edge_length(mesh, stars, vertex);
            count += 1.0;
        }
        let edge_mm = settings.max_edge_mm.map_or(sum / count, |most| (0.75 * most).min(sum / count));
        let base = base(surface, &rings, normal, edge_mm)?;
        let trim = trim(&base, &rings)?;
        Ok(Self {
            base,
            trim,
            edge_mm,
        })
    }

    fn elements(&self, loops: &[&Hole]) -> Result<Patch, Trouble> {
        let (places, triangles) =
            elements(&self.base, &self.trim, self.edge_mm).map_err(Trouble::Unseen)?;
        Ok(Patch {
            border: loops.iter().flat_map(|own| own.vertices.clone()).collect(),
            places,
            triangles,
        })
    }
}

fn corners(mesh: &TriangleMesh, patch: &Patch) -> Vec<[DVec3; 3]> {
    let border = patch.border.len();
    let at = |v: u32| match patch.border.get(v as usize) {
        Some(&own) => mesh.place(own),
        None => patch.places[v as usize - border],
    };
    patch.triangles.iter().map(|t| t.map(at)).collect()
}

fn joined(
    prepared: Prepared,
    patches: Vec<Option<Patch>>,
    outcomes: Vec<Outcome>,
    trimmed: Vec<Option<Result<TrimmedPatch, String>>>,
) -> Filled {
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
    let holes = survey.holes.into_iter().zip(outcomes).zip(trimmed);
    Filled {
        mesh,
        old_triangles,
        mended,
        holes: holes
            .map(|((hole, outcome), patch)| HoleReport {
                hole,
                outcome,
                patch,
            })
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
