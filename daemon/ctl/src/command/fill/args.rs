//! What the user may say, and what follows from it.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use fill::{Kernel, Method, Precision, Settings};
use jiff::Timestamp;
use mesh_files::TriangleFormat;

use crate::command::places;
use crate::command::units::UnitName;
use crate::failure::Failure;

/// Meshes smaller than this are probably in other units than assumed, millimetres.
const SMALL_PART_MM: f64 = 2.0;

/// Close the holes of a triangle mesh, without a service
///
/// Reads an STL, PLY or OBJ file, puts an implicit surface through the points around each hole, and
/// closes the hole with triangles on it that are as large as those around. Triangles that are there are
/// not moved. The largest loop of an open sheet is its border and stays open, and so does what --keep
/// names; --list shows the loops with their numbers. A hole that no triangles close without running
/// through others stays open, and it is said why. Vertices at one place, triangles that are there twice
/// or turned around, and edges of more than two triangles are mended before, and that is told.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The mesh: an STL (text or binary), PLY or OBJ file
    #[arg(value_name = "MESH")]
    pub(super) mesh: PathBuf,
    /// Where the mesh goes; its ending, .stl, .ply or .obj, says in what format. Default: beside the
    /// input as NAME-filled, in its format
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// Write the fillings as trimmed surfaces, too: IGES, one for each hole that its mean plane sees whole,
    /// and several beside each other for others
    #[arg(long, value_name = "OUT.igs")]
    pub(super) patches: Option<PathBuf>,
    /// Unit of the coordinates in the file, which the written mesh keeps; default: millimetres. Whatever
    /// is told and said elsewhere, and the IGES file, is in millimetres
    #[arg(long, value_name = "UNIT", value_enum)]
    units: Option<UnitName>,
    /// Longest edge of new triangles, millimetres; default: as long as those around each hole
    #[arg(long = "max-edge", value_name = "MM")]
    max_edge_mm: Option<f64>,
    /// Leave these loops open, by their numbers
    #[arg(long, value_name = "LOOP", num_args = 1..)]
    keep: Vec<usize>,
    /// Close these loops though they are borders of open sheets, by their numbers
    #[arg(long, value_name = "LOOP", num_args = 1..)]
    close: Vec<usize>,
    /// List the loops, and write nothing
    #[arg(long, conflicts_with_all = ["output", "patches", "keep", "close"])]
    pub(super) list: bool,
    /// How holes are closed: on the implicit surface itself, or as in the paper of Yoo (2005), by a
    /// trimmed surface of Ferguson patches
    #[arg(long, value_name = "METHOD", value_enum, default_value_t = MethodName::Relief)]
    method: MethodName,
    /// Radial function of the implicit surface; default: quintic, and thin-plate with --method yoo
    #[arg(long, value_name = "KERNEL", value_enum)]
    kernel: Option<KernelName>,
    /// Vertices of borders that are so near to each other are one, millimetres; default: what rounding to
    /// 32 bits can part
    #[arg(long = "weld", value_name = "MM")]
    weld_mm: Option<f64>,
    /// Time to be written into the IGES file; default: SOURCE_DATE_EPOCH, or when the input was changed
    #[arg(long, value_name = "TIME")]
    timestamp: Option<Timestamp>,
    /// Threads to use; 0 for all processors. The result does not depend on it
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) threads: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MethodName {
    Relief,
    Yoo,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum KernelName {
    ThinPlate,
    Biharmonic,
    Triharmonic,
    Quintic,
}

/// The name of a radial function, as [`KernelName`] has it.
pub(super) fn kernel_name(kernel: Kernel) -> &'static str {
    match kernel {
        Kernel::ThinPlate => "thin-plate",
        Kernel::Biharmonic => "biharmonic",
        Kernel::Triharmonic => "triharmonic",
        Kernel::Quintic => "quintic",
    }
}

impl Args {
    /// Millimetres to a unit of the file's coordinates.
    pub(super) fn in_mm(&self) -> f64 {
        self.units.map_or(1.0, |own| own.units().in_mm())
    }

    /// Why the coordinates are probably not in millimetres, if so and nobody said.
    pub(super) fn units_suspected(&self, places: &[[f64; 3]]) -> Option<String> {
        let mut extent = [(f64::INFINITY, f64::NEG_INFINITY); 3];
        for place in places {
            for (own, c) in extent.iter_mut().zip(place) {
                *own = (own.0.min(*c), own.1.max(*c));
            }
        }
        let size_mm = extent.iter().map(|own| own.1 - own.0).fold(0.0, f64::max);
        (self.units.is_none() && size_mm < SMALL_PART_MM).then(|| {
            format!(
                "the mesh is only {size_mm:.3} mm across, taken as millimetres; if the file is in metres \
                 or inches, say so with --units m or --units inch"
            )
        })
    }

    /// The settings, for output in a precision.
    pub(super) fn settings(&self, precision: Precision) -> Result<Settings, Failure> {
        let settings = Settings {
            method: match self.method {
                MethodName::Relief => Method::Relief,
                MethodName::Yoo => Method::Yoo,
            },
            kernel: self.kernel.map(|own| match own {
                KernelName::ThinPlate => Kernel::ThinPlate,
                KernelName::Biharmonic => Kernel::Biharmonic,
                KernelName::Triharmonic => Kernel::Triharmonic,
                KernelName::Quintic => Kernel::Quintic,
            }),
            max_edge_mm: self.max_edge_mm.map(|own| own / self.in_mm()),
            keep: self.keep.iter().copied().collect(),
            force: self.close.iter().copied().collect(),
            weld_mm: self.weld_mm.map(|own| own / self.in_mm()),
            precision,
            patches: self.patches.is_some(),
        };
        settings
            .validate()
            .map_err(|error| Failure::Usage(format!("--{error}")))?;
        if let Some(both) = settings.keep.intersection(&settings.force).next() {
            return Err(Failure::Usage(format!(
                "loop {both} cannot be kept open and closed"
            )));
        }
        Ok(settings)
    }

    /// Where the mesh goes and in what format, given that of the input.
    pub(super) fn output(
        &self,
        input: TriangleFormat,
    ) -> Result<(PathBuf, TriangleFormat), Failure> {
        let Some(output) = self.output.clone() else {
            let stem = self.mesh.file_stem().unwrap_or(self.mesh.as_os_str());
            let name = format!("{}-filled.{}", stem.to_string_lossy(), input.ending());
            return Ok((self.mesh.with_file_name(name), input));
        };
        Ok((output.clone(), self.named(&output)?))
    }

    fn named(&self, output: &std::path::Path) -> Result<TriangleFormat, Failure> {
        let ending = output.extension().map(|own| own.to_string_lossy());
        ending
            .and_then(|own| TriangleFormat::of_ending(&own))
            .ok_or_else(|| {
                Failure::Usage(format!(
                    "{}: name a file with the ending .stl, .ply or .obj",
                    output.display()
                ))
            })
    }

    /// What is wrong with the places of the results, before anything is read.
    pub(super) fn check_places(&self) -> Result<(), Failure> {
        if let Some(output) = &self.output {
            self.named(output)?;
        }
        if let Some(patches) = &self.patches {
            let ending = patches.extension().map(|own| own.to_ascii_lowercase());
            if !ending.is_some_and(|own| own == "igs" || own == "iges") {
                return Err(Failure::Usage(format!(
                    "{}: trimmed surfaces are written as IGES; name a file with the ending .igs",
                    patches.display()
                )));
            }
        }
        let written: Vec<&Path> = self
            .output
            .iter()
            .chain(&self.patches)
            .map(PathBuf::as_path)
            .collect();
        places::check_files(&written, &[("mesh", &self.mesh)])
    }

    /// The time that is written into the IGES file.
    pub(super) fn timestamp(&self) -> Result<Timestamp, Failure> {
        crate::command::timestamp::of(self.timestamp, None, &self.mesh)
    }
}
