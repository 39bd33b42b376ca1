//! One hole closed.

use glam::DVec3;

use crate::holes::{Hole, HoleKind};
use crate::implicit::{FitSettings, Implicit, Kernel, Solver};
use crate::mesh::{Stars, TriangleMesh};
use crate::patch::{Ground, Patch, Polygon, Trouble, grow};
use crate::region::{around, edge_length, mean_normal};
use crate::report::Outcome;
use crate::settings::{Method, Precision, Settings};
use crate::yoo::{Base, Elements, Throw, Trim, TrimmedPatch, Unseen, base, elements, parts, trim};

/// Points in the dense part of a fit: as many as these times the loop's vertices, between two bounds.
const CENTRES_PER_VERTEX: usize = 6;
const FEWEST_CENTRES: usize = 160;
const MOST_CENTRES: usize = 600;
/// Most points whose whole system is eliminated by the paper's way.
const MOST_ELIMINATED: usize = 2500;

/// Ways to close a hole, in the order in which they are tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Attempt {
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

/// The ways for these settings.
pub(crate) fn attempts(settings: &Settings) -> Vec<Attempt> {
    let kernel = settings.kernel();
    match settings.method {
        // What its mean normal does not see whole is closed on the same surface itself.
        Method::Yoo => vec![
            Attempt::Trimmed(kernel),
            Attempt::Surface(kernel),
            Attempt::Fair,
        ],
        Method::Relief if kernel == Kernel::Quintic => vec![
            Attempt::Surface(kernel),
            Attempt::Surface(Kernel::Triharmonic),
            Attempt::Fair,
        ],
        Method::Relief => vec![Attempt::Surface(kernel), Attempt::Fair],
    }
}

/// A hole that is closed, as far as its own elements go.
pub(crate) struct Closed {
    pub(crate) patch: Patch,
    pub(crate) outcome: Outcome,
    pub(crate) trimmed: Option<Result<Vec<TrimmedPatch>, String>>,
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

/// Tries to close a hole, with the islands in it, in one way.
pub(crate) fn attempted(
    (mesh, stars): (&TriangleMesh, &Stars),
    (hole, islands): (&Hole, &[Hole]),
    attempt: Attempt,
    settings: &Settings,
) -> Result<Closed, Trouble> {
    // The surface beside a border leads away from it.
    let attempt = match hole.kind {
        HoleKind::Border => Attempt::Fair,
        _ => attempt,
    };
    let islands: Vec<&Hole> = islands.iter().collect();
    let loops: Vec<&Hole> = std::iter::once(hole)
        .chain(islands.iter().copied())
        .collect();
    let samples = match attempt {
        Attempt::Fair => Vec::new(),
        _ => around(mesh, stars, &loops, hole.size_mm),
    };
    let border: usize = loops.iter().map(|own| own.vertices.len()).sum();
    let surface = attempt.kernel().and_then(|kernel| {
        let fit = fit_settings(kernel, settings.method, samples.len(), border);
        Implicit::fit(&samples, hole.size_mm, &fit).ok()
    });
    let edge_mm = edge((mesh, stars), &loops, settings);
    let seen = surface.as_ref().map(|own| {
        let wanted = settings.patches || matches!(attempt, Attempt::Trimmed(_));
        wanted.then(|| Seen::of(mesh, &loops, own, mean_normal(&samples), edge_mm))
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
            let patch = patch.ok_or_else(|| Unseen::NoElements.to_string());
            patch.map(|own| vec![own])
        }
        Some(Err(_)) => parted(mesh, &patch, surface.as_ref(), hole.number, edge_mm)
            .map_err(|unseen| unseen.to_string()),
        None => Err("no implicit surface closes it".to_owned()),
    });
    Ok(Closed {
        patch,
        outcome,
        trimmed,
    })
}

/// How long edges of elements on a base surface are.
fn edge((mesh, stars): (&TriangleMesh, &Stars), loops: &[&Hole], settings: &Settings) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for &vertex in loops.iter().flat_map(|own| &own.vertices) {
        sum += edge_length(mesh, stars, vertex);
        count += 1.0;
    }
    let mean_mm = sum / count;
    settings
        .max_edge_mm
        .map_or(mean_mm, |most| (0.75 * most).min(mean_mm))
}

/// A filling on an implicit surface as several trimmed surfaces.
fn parted(
    mesh: &TriangleMesh,
    patch: &Patch,
    surface: Option<&Implicit>,
    hole: usize,
    edge_mm: f64,
) -> Result<Vec<TrimmedPatch>, Unseen> {
    let border = patch.border.iter().map(|&v| mesh.place(v));
    let places: Vec<DVec3> = border.chain(patch.places.iter().copied()).collect();
    let own = Elements {
        surface: surface.ok_or(Unseen::Missed)?,
        places: &places,
        triangles: &patch.triangles,
    };
    parts(&own, hole, edge_mm)
}

/// A hole on its base surface.
struct Seen {
    base: Base,
    trim: Trim,
    edge_mm: f64,
}

impl Seen {
    fn of(
        mesh: &TriangleMesh,
        loops: &[&Hole],
        surface: &Implicit,
        normal: DVec3,
        edge_mm: f64,
    ) -> Result<Self, Unseen> {
        let places = |own: &&Hole| own.vertices.iter().map(|&v| mesh.place(v)).collect();
        let rings: Vec<Vec<DVec3>> = loops.iter().map(places).collect();
        let base = base(surface, &rings, normal, edge_mm, Throw::WHOLE)?;
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
