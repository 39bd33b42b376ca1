//! The filling itself.

use std::io;
use std::path::{Path, PathBuf};

use cad_exchange::iges::NamedPatch;
use deliverables::write_atomically;
use fill::{
    FillError, Filled, Hole, HoleKind, HoleReport, Mended, Outcome, Precision, TriangleMesh,
};
use mesh_files::{TriangleFormat, Triangles, write_triangles};
use serde::Serialize;

use super::args::kernel_name;
use super::{Args, read, summary};
use crate::command::places;
use crate::command::shown::{self, Shown};
use crate::failure::Failure;
use crate::output;

/// What `--json` prints.
#[derive(Debug, Serialize)]
pub(super) struct Told {
    pub(super) input: PathBuf,
    /// Absent where loops are only listed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) output: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) patches: Option<PathBuf>,
    /// As they are written; where loops are only listed, as they are.
    pub(super) vertices: usize,
    pub(super) triangles: usize,
    pub(super) new_triangles: usize,
    pub(super) mended: MendedFigures,
    pub(super) loops: Vec<LoopFigures>,
    pub(super) warnings: Vec<String>,
}

/// What was mended.
#[derive(Debug, Serialize)]
pub(super) struct MendedFigures {
    pub(super) equal_vertices: usize,
    pub(super) near_vertices: usize,
    pub(super) degenerate_triangles: usize,
    pub(super) slivers: usize,
    pub(super) duplicate_triangles: usize,
    pub(super) turned_triangles: usize,
    pub(super) non_manifold_edges: usize,
    pub(super) triangles_left_out: usize,
    pub(super) one_sided_edges: usize,
    pub(super) triangles_cleared: usize,
    pub(super) split_vertices: usize,
    pub(super) unused_vertices: usize,
}

/// A loop and what became of it.
#[derive(Debug, Serialize)]
pub(super) struct LoopFigures {
    pub(super) number: usize,
    pub(super) kind: &'static str,
    /// The hole that an island is in.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) within: Option<usize>,
    pub(super) edges: usize,
    pub(super) length_mm: f64,
    pub(super) size_mm: f64,
    pub(super) centre_mm: [f64; 3],
    /// Absent where loops are only listed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) outcome: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) reason: Option<String>,
    /// Whether it is among the trimmed surfaces; absent where these are not asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) trimmed: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) filling: Option<Filling>,
}

/// What closes a hole.
#[derive(Debug, Serialize)]
pub(super) struct Filling {
    /// Absent where triangles are only fair.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) kernel: Option<&'static str>,
    pub(super) points: usize,
    pub(super) noise_mm: f64,
    pub(super) vertices: usize,
    pub(super) triangles: usize,
}

/// Fills; Ctrl-C ends it without leaving half a file.
pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let work = move |shown: &Shown| {
        regrid::with_threads(args.threads, || work(&args, shown))
            .map_err(|error| Failure::at("cannot fill", &error))
            .and_then(|told| told)
    };
    let told = shown::work("the filling", work).await?;
    for warning in &told.warnings {
        eprintln!("relief: note: {warning}");
    }
    output::either(json, &told, summary::told)
}

fn work(args: &Args, shown: &Shown) -> Result<Told, Failure> {
    args.check_places()?;
    // Before anything is read; in what precision follows from the file.
    args.settings(Precision::Double)?;
    let read = read::read(&args.mesh)?;
    let (output, format) = args.output(read.format)?;
    let is_single = match format {
        TriangleFormat::Stl => true,
        TriangleFormat::Ply => read.is_single,
        TriangleFormat::Obj => false,
    };
    let settings = args.settings(if is_single {
        Precision::Single
    } else {
        Precision::Double
    })?;
    let refused = |error: FillError| match error {
        FillError::Cancelled(_) => Failure::Interrupted,
        FillError::NoLoop { number, loops: 0 } => Failure::Usage(format!(
            "{}: there is no loop {number}: the mesh is closed",
            args.mesh.display()
        )),
        FillError::NoLoop { .. } => Failure::Usage(format!(
            "{}: {error}; --list shows them",
            args.mesh.display()
        )),
        other => Failure::at(args.mesh.display(), &other),
    };
    let Triangles {
        vertices,
        triangles,
        ..
    } = read;
    let mesh = TriangleMesh {
        vertices_mm: vertices,
        triangles,
    };
    let suspected = args.units_suspected(&mesh.vertices_mm);
    if args.list {
        let (vertices, triangles) = (mesh.vertices_mm.len(), mesh.triangles.len());
        let survey = fill::survey(mesh, &settings).map_err(refused)?;
        return Ok(Told {
            input: args.mesh.clone(),
            output: None,
            patches: None,
            vertices: vertices - survey.mended.welded_equal - survey.mended.unused_vertices,
            triangles,
            new_triangles: 0,
            warnings: suspected
                .into_iter()
                .chain(mending(&survey.mended))
                .collect(),
            mended: (&survey.mended).into(),
            loops: survey
                .holes
                .iter()
                .map(|own| LoopFigures::of(own, args.in_mm()))
                .collect(),
        });
    }
    let written: Vec<&Path> = std::iter::once(output.as_path())
        .chain(args.patches.as_deref())
        .collect();
    places::check_files(&written, &[("mesh", &args.mesh)])?;
    shown.begin("fill");
    let filled = fill::fill(mesh, &settings, shown).map_err(refused)?;
    let generator = concat!("relief ", env!("CARGO_PKG_VERSION"));
    let cannot = |path: &Path, error: &dyn std::error::Error| {
        Failure::at(format!("cannot write {}", path.display()), error)
    };
    write_atomically::<io::Error>(&output, |sink| {
        let mesh = &filled.mesh;
        let kind = (format, is_single);
        write_triangles(&mesh.vertices_mm, &mesh.triangles, kind, generator, sink)
            .map_err(io::Error::other)
    })
    .map_err(|error| cannot(&output, &error))?;
    let mut told = told(args, output, &filled, suspected);
    if let Some(path) = &args.patches {
        patches(args, path, &filled, &mut told)?;
    }
    Ok(told)
}

/// How far the curves of a trim in space may lie off their surface, millimetres: they are cubic between
/// the points of a loop.
const GAP_MM: f64 = 1e-3;

/// Writes the fillings as trimmed surfaces, and says which have none.
fn patches(args: &Args, path: &Path, filled: &Filled, told: &mut Told) -> Result<(), Failure> {
    let mut found = Vec::new();
    for own in &filled.holes {
        match &own.patch {
            Some(Ok(parts)) => {
                for (k, part) in parts.iter().enumerate() {
                    let name = match parts.len() {
                        1 => format!("hole-{}", part.hole),
                        _ => format!("hole-{}-{}", part.hole, k + 1),
                    };
                    found.push((name, part.scaled(args.in_mm())));
                }
            }
            Some(Err(reason)) => told.warnings.push(format!(
                "hole {} has no trimmed surface: {reason}",
                own.hole.number
            )),
            None => {}
        }
    }
    if found.is_empty() {
        told.warnings.push(format!(
            "{} is not written: there is no trimmed surface",
            path.display()
        ));
        return Ok(());
    }
    let named: Vec<NamedPatch<'_>> = found
        .iter()
        .map(|(name, patch)| NamedPatch {
            name,
            surface: &patch.surface,
            parameter_curves: &patch.parameter_curves,
            space_curves: &patch.space_curves,
        })
        .collect();
    let stem = args.mesh.file_stem().unwrap_or(args.mesh.as_os_str());
    let (name, timestamp) = (stem.to_string_lossy(), args.timestamp()?);
    write_atomically::<deliverables::DeliverError>(path, |sink| {
        deliverables::write_trimmed(&named, GAP_MM, &name, timestamp, sink)?;
        Ok(())
    })
    .map_err(|error| Failure::at(format!("cannot write {}", path.display()), &error))?;
    told.patches = Some(path.to_owned());
    Ok(())
}

fn told(args: &Args, output: PathBuf, filled: &Filled, suspected: Option<String>) -> Told {
    let mut warnings: Vec<String> = suspected.into_iter().collect();
    warnings.extend(mending(&filled.mended));
    warnings.extend(remarks(&filled.holes));
    Told {
        input: args.mesh.clone(),
        output: Some(output),
        patches: None,
        vertices: filled.mesh.vertices_mm.len(),
        triangles: filled.mesh.triangles.len(),
        new_triangles: filled.mesh.triangles.len() - filled.old_triangles,
        mended: (&filled.mended).into(),
        loops: filled
            .holes
            .iter()
            .map(|own| LoopFigures::with(own, args.in_mm()))
            .collect(),
        warnings,
    }
}

impl From<&Mended> for MendedFigures {
    fn from(own: &Mended) -> Self {
        Self {
            equal_vertices: own.welded_equal,
            near_vertices: own.welded_near,
            degenerate_triangles: own.degenerate,
            slivers: own.slivers,
            duplicate_triangles: own.duplicate,
            turned_triangles: own.turned,
            non_manifold_edges: own.non_manifold_edges,
            triangles_left_out: own.left_out,
            one_sided_edges: own.one_sided_edges,
            triangles_cleared: own.cleared,
            split_vertices: own.split_vertices,
            unused_vertices: own.unused_vertices,
        }
    }
}

impl LoopFigures {
    /// `in_mm`: millimetres to a unit of the mesh.
    fn of(hole: &Hole, in_mm: f64) -> Self {
        let (kind, within) = match hole.kind {
            HoleKind::Hole => ("hole", None),
            HoleKind::Border => ("border", None),
            HoleKind::Island(within) => ("island", Some(within)),
        };
        Self {
            number: hole.number,
            kind,
            within,
            edges: hole.vertices.len(),
            length_mm: in_mm * hole.length_mm,
            size_mm: in_mm * hole.size_mm,
            centre_mm: (in_mm * hole.centre_mm).to_array(),
            outcome: None,
            reason: None,
            trimmed: None,
            filling: None,
        }
    }

    fn with(own: &HoleReport, in_mm: f64) -> Self {
        let mut told = Self::of(&own.hole, in_mm);
        told.outcome = Some(match &own.outcome {
            Outcome::Filled {
                kernel,
                points,
                noise_mm,
                vertices,
                triangles,
                ..
            } => {
                told.trimmed = own.patch.as_ref().map(Result::is_ok);
                told.filling = Some(Filling {
                    kernel: kernel.map(kernel_name),
                    points: *points,
                    noise_mm: in_mm * noise_mm,
                    vertices: *vertices,
                    triangles: *triangles,
                });
                "filled"
            }
            Outcome::Kept => "kept",
            Outcome::Border => "border",
            Outcome::Island { .. } => "island",
            Outcome::Open { reason } => {
                told.reason = Some(reason.clone());
                "open"
            }
        });
        told
    }
}

/// What was mended, in words.
fn mending(own: &Mended) -> Vec<String> {
    let counted = output::counted;
    let vertices = |n: usize| {
        if n == 1 {
            "1 vertex".to_owned()
        } else {
            format!("{n} vertices")
        }
    };
    let triangles = |n: usize| counted(n, "triangle");
    let all = [
        (
            own.welded_near,
            format!(
                "{} of borders joined to others beside them",
                vertices(own.welded_near)
            ),
        ),
        (
            own.degenerate,
            format!(
                "{} with one vertex twice left out",
                triangles(own.degenerate)
            ),
        ),
        (
            own.slivers,
            format!("{} without an area kept", triangles(own.slivers)),
        ),
        (
            own.duplicate,
            format!("{} that others cover left out", triangles(own.duplicate)),
        ),
        (
            own.turned,
            format!(
                "{} turned around to agree with their neighbours",
                triangles(own.turned)
            ),
        ),
        (
            own.left_out,
            format!(
                "{} left out at {} of more than two triangles and {} that can be turned no way",
                triangles(own.left_out),
                counted(own.non_manifold_edges, "edge"),
                own.one_sided_edges
            ),
        ),
        (
            own.cleared,
            format!(
                "{} around holes left out, since these could not be closed otherwise",
                triangles(own.cleared)
            ),
        ),
        (
            own.split_vertices,
            format!(
                "{} split where parts of the mesh met in nothing else",
                vertices(own.split_vertices)
            ),
        ),
        (
            own.unused_vertices,
            format!(
                "{} that no triangle has left out",
                vertices(own.unused_vertices)
            ),
        ),
    ];
    all.into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(_, told)| told)
        .collect()
}

/// What is to be said of loops that stay open.
fn remarks(holes: &[HoleReport]) -> Vec<String> {
    let mut told = Vec::new();
    if holes.is_empty() {
        told.push("the mesh has no holes".to_owned());
    }
    for own in holes {
        let number = own.hole.number;
        match &own.outcome {
            Outcome::Open { reason } => told.push(format!("hole {number} stays open: {reason}")),
            Outcome::Border => told.push(format!(
                "loop {number} is the border of an open sheet and stays open; --close {number} \
                 closes it"
            )),
            Outcome::Filled { kernel: None, .. } => told.push(format!(
                "hole {number} is closed by a fair net alone; no implicit surface closes it"
            )),
            _ => {}
        }
    }
    let is_filled = |own: &HoleReport| matches!(own.outcome, Outcome::Filled { .. });
    if !holes.is_empty() && !holes.iter().any(is_filled) {
        told.push("no hole was filled".to_owned());
    }
    told
}
