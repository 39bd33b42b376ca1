//! From a mesh with holes to one without.

use std::collections::{BTreeSet, HashSet};
use std::sync::Mutex;

use glam::DVec3;
use range_image::Monitor;
use rayon::prelude::*;

use crate::close::{Closed, attempted, attempts};
use crate::error::FillError;
use crate::holes::{Hole, HoleKind, holes};
use crate::loops::loops;
use crate::meet::meetings;
use crate::mesh::{Edges, Stars, TriangleMesh, mend, split_fans};
use crate::patch::{Patch, Trouble};
use crate::report::{Filled, HoleReport, Outcome, Survey};
use crate::settings::Settings;
use crate::yoo::TrimmedPatch;

/// How often the triangles around holes that cannot be closed are left out, a ring at a time.
const CLEARINGS: usize = 4;
/// Parts of a mesh that are cut off by that go, too, if they have no more triangles than this.
const SCRAP: usize = 24;

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

/// A hole to be closed, and what came of it.
struct Job {
    hole: Hole,
    islands: Vec<Hole>,
    /// Numbers of the loops that it was when all were told.
    numbers: BTreeSet<usize>,
    patch: Option<Patch>,
    outcome: Outcome,
    trimmed: Option<Result<Vec<TrimmedPatch>, String>>,
}

impl Job {
    fn new(hole: Hole, islands: Vec<Hole>, numbers: BTreeSet<usize>) -> Self {
        Self {
            hole,
            islands,
            numbers,
            patch: None,
            outcome: Outcome::Open {
                reason: String::new(),
            },
            trimmed: None,
        }
    }

    fn fail(&mut self, trouble: Trouble) {
        self.patch = None;
        self.trimmed = None;
        self.outcome = Outcome::Open {
            reason: trouble.to_string(),
        };
    }

    fn loops(&self) -> impl Iterator<Item = &Vec<u32>> {
        let islands = self.islands.iter().map(|own| &own.vertices);
        std::iter::once(&self.hole.vertices).chain(islands)
    }
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
    let Prepared {
        mut mesh,
        mut stars,
        survey,
    } = prepare(mesh, settings)?;
    monitor.check()?;
    let (mut jobs, left) = planned(&survey.holes, settings);
    let mut mended = survey.mended;
    for round in 0..=CLEARINGS {
        close_all((&mesh, &stars), &mut jobs, settings, monitor)?;
        let is_failed = |job: &Job| job.patch.is_none() && job.hole.kind != HoleKind::Border;
        if round == CLEARINGS || !jobs.iter().any(is_failed) {
            break;
        }
        let before = mesh.triangles.len();
        let (cleared, kept) = clear((&mesh, &stars), jobs, &left);
        mesh = cleared;
        mended.cleared += before - mesh.triangles.len();
        stars = Stars::of(&mesh);
        jobs = refreshed((&mesh, &stars), kept, &left);
    }
    monitor.progress(1.0);
    let old_triangles = mesh.triangles.len();
    for patch in jobs.iter().filter_map(|job| job.patch.as_ref()) {
        join(&mut mesh, patch);
    }
    mended.split_vertices = split_fans(&mut mesh);
    mended.unused_vertices += mesh.compact();
    Ok(Filled {
        mesh,
        old_triangles,
        mended,
        holes: reports(survey.holes, &jobs, settings),
    })
}

/// Which loops are to be closed, and which are left, as vertices.
fn planned(holes: &[Hole], settings: &Settings) -> (Vec<Job>, HashSet<Vec<u32>>) {
    let mut jobs = Vec::new();
    let mut left = HashSet::new();
    for hole in holes {
        if stays(hole, settings).is_none() {
            let is_in = |other: &&Hole| {
                other.kind == HoleKind::Island(hole.number)
                    && matches!(stays(other, settings), Some(Outcome::Island { .. }))
            };
            let islands = holes.iter().filter(is_in).cloned().collect();
            jobs.push(Job::new(hole.clone(), islands, [hole.number].into()));
        }
    }
    for hole in holes {
        if !jobs
            .iter()
            .flat_map(Job::loops)
            .any(|own| *own == hole.vertices)
        {
            left.insert(hole.vertices.clone());
        }
    }
    (jobs, left)
}

/// Why a loop is none to be closed; `None` where it is one.
fn stays(hole: &Hole, settings: &Settings) -> Option<Outcome> {
    if settings.keep.contains(&hole.number) {
        return Some(Outcome::Kept);
    }
    if settings.force.contains(&hole.number) {
        return None;
    }
    match hole.kind {
        HoleKind::Hole => None,
        HoleKind::Border => Some(Outcome::Border),
        HoleKind::Island(hole) => Some(Outcome::Island { hole }),
    }
}

/// Closes all that are not closed, in one way after the other.
fn close_all(
    ground: (&TriangleMesh, &Stars),
    jobs: &mut [Job],
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<(), FillError> {
    let mesh = ground.0;
    let there: Vec<[DVec3; 3]> = mesh.triangles.iter().map(|&t| mesh.corners(t)).collect();
    let done = Mutex::new(0.0);
    for attempt in attempts(settings) {
        let open: Vec<usize> = (0..jobs.len())
            .filter(|&k| jobs[k].patch.is_none())
            .collect();
        if open.is_empty() {
            break;
        }
        let share = 0.9 / open.len() as f64;
        let close = |&k: &usize| -> Option<Result<Closed, Trouble>> {
            if monitor.is_cancelled() {
                return None;
            }
            let job = &jobs[k];
            let own = attempted(ground, (&job.hole, &job.islands), attempt, settings);
            if let Ok(mut done) = done.lock()
                && *done + share <= 0.9
            {
                *done += share;
                monitor.progress(*done);
            }
            Some(own)
        };
        let found: Vec<_> = open.par_iter().with_max_len(1).map(close).collect();
        monitor.check()?;
        for (k, found) in open.into_iter().zip(found) {
            match found {
                Some(Ok(closed)) => {
                    jobs[k].patch = Some(closed.patch);
                    jobs[k].outcome = closed.outcome;
                    jobs[k].trimmed = closed.trimmed;
                }
                Some(Err(trouble)) => jobs[k].fail(trouble),
                None => {}
            }
        }
        let groups: Vec<Vec<[DVec3; 3]>> = jobs
            .iter()
            .map(|job| {
                job.patch
                    .as_ref()
                    .map_or_else(Vec::new, |own| corners(mesh, own))
            })
            .collect();
        for (job, count) in jobs.iter_mut().zip(meetings(&groups, &there)) {
            if count > 0 {
                job.fail(Trouble::Intersects(count));
            }
        }
    }
    Ok(())
}

/// Leaves out the triangles around holes that could not be closed, and the scraps that this cuts off;
/// the mesh then, and the jobs as they were. What is around loops that are to stay is not touched.
fn clear(
    (mesh, stars): (&TriangleMesh, &Stars),
    jobs: Vec<Job>,
    left: &HashSet<Vec<u32>>,
) -> (TriangleMesh, Vec<Job>) {
    let held: HashSet<u32> = left.iter().flatten().copied().collect();
    let mut is_out = vec![false; mesh.triangles.len()];
    let mut touched = BTreeSet::new();
    for job in jobs.iter().filter(|job| job.patch.is_none()) {
        if job.hole.kind == HoleKind::Border {
            continue;
        }
        for &vertex in job.loops().flatten() {
            for &t in stars.around(vertex) {
                let own = mesh.triangles[t as usize];
                if !own.iter().any(|v| held.contains(v)) {
                    is_out[t as usize] = true;
                    touched.extend(own);
                }
            }
        }
    }
    // Scraps: grown from what is beside, until it is all of a part or too large for one.
    for &start in &touched {
        let beside = stars.around(start).iter().find(|&&t| !is_out[t as usize]);
        let Some(&first) = beside else {
            continue;
        };
        let mut part = vec![first];
        let mut next = 0;
        while next < part.len() && part.len() <= SCRAP {
            for v in mesh.triangles[part[next] as usize] {
                for &t in stars.around(v) {
                    if !is_out[t as usize] && !part.contains(&t) {
                        part.push(t);
                    }
                }
            }
            next += 1;
        }
        if part.len() <= SCRAP {
            part.into_iter().for_each(|t| is_out[t as usize] = true);
        }
    }
    let mut cleared = mesh.clone();
    let mut outs = is_out.into_iter();
    cleared.triangles.retain(|_| !outs.next().unwrap_or(false));
    (cleared, jobs)
}

/// The jobs on a mesh that has lost triangles: those whose loops are still there, and new ones.
fn refreshed(
    (mesh, stars): (&TriangleMesh, &Stars),
    jobs: Vec<Job>,
    left: &HashSet<Vec<u32>>,
) -> Vec<Job> {
    let found = holes(mesh, loops(mesh, &Edges::of(&mesh.triangles)), stars);
    let there: HashSet<&Vec<u32>> = found.iter().map(|own| &own.vertices).collect();
    let (mut kept, gone): (Vec<Job>, Vec<Job>) = jobs
        .into_iter()
        .partition(|job| job.loops().all(|own| there.contains(own)));
    let known: HashSet<Vec<u32>> = kept
        .iter()
        .flat_map(Job::loops)
        .chain(left)
        .cloned()
        .collect();
    let new: Vec<&Hole> = found
        .iter()
        .filter(|own| !known.contains(&own.vertices) && !matches!(own.kind, HoleKind::Island(_)))
        .collect();
    let first = kept.len();
    for hole in &new {
        let is_in = |other: &&Hole| other.kind == HoleKind::Island(hole.number);
        let islands = found.iter().filter(is_in).cloned().collect();
        kept.push(Job::new((*hole).clone(), islands, BTreeSet::new()));
    }
    // Whatever is gone is part of the new one that is nearest.
    let nearest = |to: DVec3, among: &[Job]| {
        let apart = |k: &usize| among[*k].hole.centre_mm.distance_squared(to);
        (first..among.len()).min_by(|a, b| apart(a).total_cmp(&apart(b)))
    };
    for job in &gone {
        if let Some(k) = nearest(job.hole.centre_mm, &kept) {
            kept[k].numbers.extend(&job.numbers);
        }
    }
    kept
}

fn corners(mesh: &TriangleMesh, patch: &Patch) -> Vec<[DVec3; 3]> {
    let border = patch.border.len();
    let at = |v: u32| match patch.border.get(v as usize) {
        Some(&own) => mesh.place(own),
        None => patch.places[v as usize - border],
    };
    patch.triangles.iter().map(|t| t.map(at)).collect()
}

fn join(mesh: &mut TriangleMesh, patch: &Patch) {
    let (first, border) = (mesh.vertices_mm.len() as u32, patch.border.len() as u32);
    mesh.vertices_mm
        .extend(patch.places.iter().map(DVec3::to_array));
    let id = |v: u32| match patch.border.get(v as usize) {
        Some(&own) => own,
        None => v - border + first,
    };
    mesh.triangles
        .extend(patch.triangles.iter().map(|t| t.map(id)));
}

/// What became of every loop that was told.
fn reports(told: Vec<Hole>, jobs: &[Job], settings: &Settings) -> Vec<HoleReport> {
    told.into_iter()
        .map(|hole| {
            let of = |job: &&Job| job.numbers.contains(&hole.number);
            let is_open = |job: &&Job| job.patch.is_none();
            let own: Vec<&Job> = jobs.iter().filter(of).collect();
            // One that cannot be closed says more than one that can.
            let job = own.iter().find(|job| is_open(job)).or(own.first());
            let outcome = match (stays(&hole, settings), job) {
                (Some(outcome), _) => outcome,
                (None, Some(job)) => job.outcome.clone(),
                (None, None) => Outcome::Open {
                    reason: "what was around it had to be left out".to_owned(),
                },
            };
            HoleReport {
                patch: job.and_then(|job| job.trimmed.clone()),
                hole,
                outcome,
            }
        })
        .collect()
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
