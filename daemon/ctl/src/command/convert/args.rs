//! What the user may say, and what follows from it.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use deliverables::{
    CadOptions, Entities, Further, LengthUnit, MeshFormat, MeshOptions, PointFormat, Schema,
    file_stem,
};
use jiff::Timestamp;
use pipeline::{Kinds, Method, Settings, SmoothJoins};
use scan_files::Units;

use crate::command::part::PartArgs;
use crate::command::regularize::RegularizeArgs;
use crate::command::units::UnitName;
use crate::failure::Failure;

/// Turn a scan file into a CAD file or triangles, without a service
///
/// Reads text (.xyz .asc .csv .txt: x y z in mm, a point each line), PLY, IGES points
/// (entities 106 and 116) and the service's own .scan files, each plain or
/// gzip-compressed. The same samples and settings give the same CAD file as the service.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The scan file
    #[arg(value_name = "INPUT")]
    pub(super) input: PathBuf,
    /// The file to write; its ending picks the format: IGES (.igs or .iges), STEP (.step or
    /// .stp), or triangles as .stl, .ply, .3mf or .glb. Default: the input's name with .igs, in
    /// the current directory
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// Distance of the grid's nodes, millimetres; default: after the scan's density
    #[arg(long, value_name = "MM")]
    pub(super) pitch_mm: Option<f64>,
    /// The road from samples to surfaces: ours, or Shim & Lee 1995 as printed; default:
    /// what a .scan file was set to, else ours
    #[arg(long, value_name = "METHOD", value_enum)]
    method: Option<MethodName>,
    /// Faces that are planes, spheres, cylinders, cones and tori where the samples speak
    /// for them (auto), or free forms all; default: auto
    #[arg(long, value_name = "KINDS", value_enum)]
    kinds: Option<KindsName>,
    /// Take regions apart where their surfaces join smoothly, as a fillet and a plane do (split),
    /// or leave them whole (keep); default: what a .scan file was set to, else split
    #[arg(long, value_name = "WHAT", value_enum)]
    smooth_joins: Option<SmoothJoinsName>,
    /// Root mean square distance from the range image at which a surface is near enough,
    /// millimetres
    #[arg(long, value_name = "MM")]
    tolerance_mm: Option<f64>,
    /// IGES entities of the surfaces: 114 (parametric splines), 128 (rational B-splines), 190
    /// (planes, cylinders, cones, spheres and tori by their numbers, other faces as 128), or 186
    /// (the same as boundary representation: shells of faces on common edges); default: 114
    #[arg(long, value_name = "TYPE", value_enum)]
    entities: Option<EntityType>,
    /// What a STEP file follows: AP242, or AP214 for programs that do not know the former;
    /// default: ap242
    #[arg(long, value_name = "SCHEMA", value_enum)]
    step_schema: Option<SchemaName>,
    /// Unit of lengths in a STEP file; default: mm
    #[arg(long, value_name = "UNIT", value_enum)]
    step_units: Option<StepUnitName>,
    /// Farthest that a triangle may lie off the model, millimetres; default: 0.01
    #[arg(long, value_name = "MM")]
    mesh_tolerance_mm: Option<f64>,
    /// Write the points as they were read, too: as .ply (millimetres) or .e57 (metres)
    #[arg(long, value_name = "OUT.ply|OUT.e57")]
    pub(super) points: Option<PathBuf>,
    /// Write a report as JSON, too
    #[arg(long, value_name = "FILE.json")]
    pub(super) report: Option<PathBuf>,
    /// Write a page to be filed, too; its ending picks the form, HTML (.html) or PDF (.pdf). May
    /// be given for each
    #[arg(long, value_name = "OUT.html|OUT.pdf")]
    pub(super) page: Vec<PathBuf>,
    /// Draw range.png, regions.png, residuals.png and inliers.png into this directory, too
    #[arg(long, value_name = "DIR")]
    pub(super) pictures: Option<PathBuf>,
    /// Seed of every random draw
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Samples looked at for a grid node
    #[arg(long, value_name = "M")]
    neighbours: Option<usize>,
    /// Planes tried for a grid node
    #[arg(long, value_name = "N")]
    draws: Option<usize>,
    /// Threads to use; 0 for all processors. The result does not depend on it
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) threads: usize,
    /// Unit of the coordinates in the file; default: millimetres, or what the file says
    #[arg(long, value_name = "UNIT", value_enum)]
    units: Option<UnitName>,
    /// Name of the part in the CAD file; default: that kept with the scan, or the
    /// input's name
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Time in the CAD file and the report, such as 2026-11-21T09:30:00Z. Default:
    /// SOURCE_DATE_EPOCH (seconds since 1970), else when the scan was taken, else when the
    /// scan file was last changed
    #[arg(long, value_name = "TIME")]
    timestamp: Option<Timestamp>,
    /// Author in the CAD file
    #[arg(long, value_name = "NAME")]
    pub(super) author: Option<String>,
    /// Organisation in the CAD file
    #[arg(
        long,
        value_name = "NAME",
        default_value = "",
        hide_default_value = true
    )]
    organisation: String,
    #[command(flatten)]
    regularize: RegularizeArgs,
    #[command(flatten)]
    part: PartArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MethodName {
    Relief,
    ShimLee,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum KindsName {
    Auto,
    Freeform,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SmoothJoinsName {
    Split,
    Keep,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum EntityType {
    #[value(name = "114")]
    Parametric,
    #[value(name = "128")]
    Rational,
    #[value(name = "190")]
    Analytic,
    #[value(name = "186")]
    Boundary,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SchemaName {
    Ap242,
    Ap214,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum StepUnitName {
    Mm,
    Inch,
}

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OutputFormat {
    Iges,
    Step,
    Mesh(MeshFormat),
}

impl OutputFormat {
    /// The format that a path's ending means.
    pub(super) fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
        match ending.as_str() {
            "igs" | "iges" => Some(Self::Iges),
            "step" | "stp" => Some(Self::Step),
            other => MeshFormat::of_ending(other).map(Self::Mesh),
        }
    }
}

/// Endings of scan files that are left off a default name.
const SCAN_ENDINGS: [&str; 8] = ["xyz", "asc", "csv", "txt", "ply", "igs", "iges", "scan"];

impl Args {
    /// Where the CAD file goes.
    pub(super) fn output(&self) -> Result<PathBuf, Failure> {
        let Some(path) = &self.output else {
            let path = PathBuf::from(format!("{}.igs", input_stem(&self.input)));
            if same_file(&path, &self.input) {
                return Err(Failure::Usage(format!(
                    "{} would be overwritten by its own conversion; name the output with -o",
                    self.input.display()
                )));
            }
            return Ok(path);
        };
        if OutputFormat::of(path).is_none() {
            let more = match path.extension().map(|e| e.to_ascii_lowercase()) {
                Some(ending) if ending == "e57" => "; points are written with --points",
                Some(ending) if ending == "gltf" => "; glTF is written as .glb, in one file",
                _ => "",
            };
            return Err(Failure::Usage(format!(
                "the ending of {} names no format that can be written; known: .igs, .iges, \
                 .step, .stp, .stl, .ply, .3mf, .glb{more}",
                path.display()
            )));
        }
        if same_file(path, &self.input) {
            return Err(Failure::Usage(format!(
                "{} is the scan file itself; name another output",
                path.display()
            )));
        }
        Ok(path.clone())
    }

    /// Where the points go, and as what.
    pub(super) fn points(&self, output: &Path) -> Result<Option<(&Path, PointFormat)>, Failure> {
        let Some(path) = self.points.as_deref() else {
            return Ok(None);
        };
        let ending = path.extension().map(|ending| ending.to_string_lossy());
        let format = ending.and_then(|ending| PointFormat::of_ending(&ending));
        let Some(format) = format else {
            return Err(Failure::Usage(format!(
                "the ending of {} names no format in which points can be written; known: .ply, \
                 .e57",
                path.display()
            )));
        };
        if path == output || same_file(path, output) {
            return Err(Failure::Usage(format!(
                "{} is the output already; name another file for the points",
                path.display()
            )));
        }
        if same_file(path, &self.input) {
            return Err(Failure::Usage(format!(
                "{} is the scan file itself; name another file for the points",
                path.display()
            )));
        }
        Ok(Some((path, format)))
    }

    /// Refuses options that have no effect on a format.
    pub(super) fn check_options(&self, format: OutputFormat) -> Result<(), Failure> {
        let is_mesh = matches!(format, OutputFormat::Mesh(_));
        let (iges, step) = (format == OutputFormat::Iges, format == OutputFormat::Step);
        let mesh = "files of triangles (.stl, .ply, .3mf, .glb)";
        let options = [
            ("--entities", self.entities.is_some() && !iges, "IGES files"),
            (
                "--step-schema",
                self.step_schema.is_some() && !step,
                "STEP files",
            ),
            (
                "--step-units",
                self.step_units.is_some() && !step,
                "STEP files",
            ),
            (
                "--mesh-tolerance-mm",
                self.mesh_tolerance_mm.is_some() && !is_mesh,
                mesh,
            ),
        ];
        let written = match format {
            OutputFormat::Iges => "an IGES file",
            OutputFormat::Step => "a STEP file",
            OutputFormat::Mesh(_) => "a file of triangles",
        };
        if let Some((option, _, of)) = options.into_iter().find(|(_, is_idle, _)| *is_idle) {
            return Err(Failure::Usage(format!(
                "{option} is for {of}, but {written} is written; leave it out, or choose another \
                 ending with -o"
            )));
        }
        self.mesh_options(format)
            .check()
            .map_err(|error| Failure::Usage(format!("mesh_{error}")))
    }

    fn mesh_options(&self, format: OutputFormat) -> MeshOptions {
        let mut options = MeshOptions::default();
        if let Some(tolerance_mm) = self.mesh_tolerance_mm {
            options.tolerance_mm = tolerance_mm;
        }
        if let OutputFormat::Mesh(format) = format {
            options.meshes.insert(format);
        }
        let ending = self.points.as_deref().and_then(Path::extension);
        let format = ending.and_then(|ending| PointFormat::of_ending(&ending.to_string_lossy()));
        options.points.extend(format);
        options
    }

    /// Refuses a name that would be cut.
    pub(super) fn check_name(&self) -> Result<(), Failure> {
        match &self.name {
            Some(name) if name.chars().count() > relief_api::MAX_NAME_CHARS => {
                Err(Failure::Usage(format!(
                    "the name has {} characters; at most {} are allowed",
                    name.chars().count(),
                    relief_api::MAX_NAME_CHARS
                )))
            }
            _ => Ok(()),
        }
    }

    /// Name of the part.
    pub(super) fn name(&self, kept: Option<&str>) -> String {
        let given = self
            .name
            .as_deref()
            .or(kept)
            .filter(|name| !name.trim().is_empty());
        given.map_or_else(|| input_stem(&self.input), str::to_owned)
    }

    pub(super) fn units(&self) -> Option<Units> {
        self.units.map(UnitName::units)
    }

    /// The settings of a scan with what the user says differently.
    pub(super) fn settings(&self, mut settings: Settings) -> Result<Settings, Failure> {
        if let Some(pitch_mm) = self.pitch_mm {
            settings.regrid.pitch_mm = pitch_mm;
        }
        if let Some(method) = self.method {
            settings = settings.with_method(match method {
                MethodName::Relief => Method::Relief,
                MethodName::ShimLee => Method::ShimLee,
            });
        }
        if let Some(kinds) = self.kinds {
            settings.kinds = match kinds {
                KindsName::Auto => Kinds::Auto,
                KindsName::Freeform => Kinds::FreeForm,
            };
        }
        if let Some(joins) = self.smooth_joins {
            settings.smooth_joins = match joins {
                SmoothJoinsName::Split => SmoothJoins::Split,
                SmoothJoinsName::Keep => SmoothJoins::Keep,
            };
        }
        if let Some(seed) = self.seed {
            settings = settings.with_seed(seed);
        }
        if let Some(tolerance_mm) = self.tolerance_mm {
            settings.reconstruct.tolerance_mm = tolerance_mm;
        }
        if let Some(neighbours) = self.neighbours {
            settings.regrid.neighbours = neighbours;
        }
        if let Some(draws) = self.draws {
            settings.regrid.draws = draws;
        }
        self.regularize.apply(&mut settings);
        self.part.apply(&mut settings);
        settings.regrid.threads = self.threads;
        settings
            .validate()
            .map_err(|error| Failure::Usage(error.to_string()))?;
        Ok(settings)
    }

    pub(super) fn cad(&self, format: OutputFormat, operator: Option<&str>) -> CadOptions {
        CadOptions {
            entities: match self.entities {
                Some(EntityType::Parametric) => Entities::Parametric114,
                Some(EntityType::Rational) => Entities::Rational128,
                Some(EntityType::Analytic) => Entities::Analytic,
                Some(EntityType::Boundary) => Entities::Boundary,
                None => Entities::default(),
            },
            step: match (format, self.step_schema) {
                (OutputFormat::Iges | OutputFormat::Mesh(_), _) => None,
                (OutputFormat::Step, Some(SchemaName::Ap214)) => Some(Schema::Ap214),
                (OutputFormat::Step, _) => Some(Schema::Ap242),
            },
            step_units: match self.step_units {
                Some(StepUnitName::Inch) => LengthUnit::Inch,
                _ => LengthUnit::Millimetre,
            },
            meshes: self.mesh_options(format),
            further: Further::default(),
            author: self
                .author
                .as_deref()
                .or(operator)
                .unwrap_or_default()
                .to_owned(),
            organisation: self.organisation.clone(),
        }
    }

    /// The time that stands in the files.
    pub(super) fn timestamp(&self, kept: Option<Timestamp>) -> Result<Timestamp, Failure> {
        crate::command::timestamp::of(self.timestamp, kept, &self.input)
    }
}

/// The input's name without `.gz` and the ending of its format, fit for a file.
pub(crate) fn input_stem(input: &Path) -> String {
    let name = input
        .file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let stem = match name.rsplit_once('.') {
        Some((stem, ending)) if SCAN_ENDINGS.contains(&ending.to_ascii_lowercase().as_str()) => {
            stem
        }
        _ => name,
    };
    file_stem(stem)
}

pub(crate) fn same_file(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_name_is_that_of_the_input() {
        for (input, stem) in [
            ("/data/bun000.ply.gz", "bun000"),
            ("part.v2.xyz", "part.v2"),
            ("part.v2", "part.v2"),
            ("20261121T110830Z-house.scan", "20261121T110830Z-house"),
        ] {
            assert_eq!(input_stem(Path::new(input)), stem);
        }
    }
}
