//! The writer: a model in, five sections out.
//!
//! By [`Entities::Boundary`] faces are written as shells ([`shell`]); else each becomes, in this
//! order: its surface (114, 128, or 190 to 198); for each loop the curves of its edges in the
//! parameter plane and in space (112 or 126), a composite of each (102) where there are several,
//! and the curve on the surface that pairs them (142, [`border`]); its name (406 form 15); and the
//! trimmed surface (144) over all of these. Neighbours share the curves of their edges in every
//! form. Colours (314) come first. So every pointer points back, and one pass numbers everything.

mod analytic;
mod border;
mod colour;
mod error;
mod fields;
mod options;
mod plain;
mod shapes;
mod sheet;
mod shell;
mod trimmed;

use std::io;

use reconstruct::{Face, Model, Surface};

pub use crate::common::{DEFAULT_PALETTE, FaceDefect};
pub use error::WriteError;
pub use options::{Entities, WriteOptions};
pub use plain::{NamedSurface, write_parametric_surfaces, write_surfaces};
pub use trimmed::{NamedPatch, write_trimmed};

use crate::brep::{Brep, Sharing};
use crate::common::check;
use colour::Colours;
use shapes::plain_entry;
use sheet::{ColourField, Entry, Pointer, Sheet, Status};

/// Width of lines on paper; the standard wants one above 0.
const LINE_WIDTH_MM: f64 = 0.1;

/// How the entities of a face are written.
#[derive(Debug, Clone, Copy)]
struct Style {
    entities: Entities,
    level: u16,
    /// The resolution in the global section.
    resolution_mm: f64,
}

/// What was written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Trimmed surfaces, or faces of shells.
    pub faces: usize,
    /// Entities of all kinds.
    pub entities: usize,
    /// Size of the file.
    pub bytes: usize,
    /// The resolution in the global section, millimetres: that of the options, or the
    /// largest gap in the model where that is larger.
    pub resolution_mm: f64,
}

/// Writes a model as an IGES 5.3 file of trimmed surfaces, or of shells.
///
/// The same model and options give the same bytes. Where two faces meet both are written on one
/// curve: half way between those that they make of their edge, or ([`Entities::Analytic`] and
/// [`Entities::Boundary`]) on what both are. Slight kinks are rounded within half the resolution:
/// readers would split the edge there. Nothing is written unless the whole model can be.
///
/// # Errors
/// [`WriteError::Option`] for an option that cannot stand in a file; [`WriteError::Face`]
/// for a face that breaks a promise of [`Model`], such as an open loop or a number that
/// is not finite; [`WriteError::Io`] when `out` fails.
pub fn write(
    model: &Model,
    options: &WriteOptions,
    out: &mut impl io::Write,
) -> Result<Summary, WriteError> {
    options.validate()?;
    let gap_mm = check(model, options.resolution_mm)?;
    let sharing = Sharing {
        sharing_mm: options.sharing_mm,
        resolution_mm: options.resolution_mm,
    };
    let brep = match options.entities {
        Entities::Parametric114 | Entities::Rational128 => Brep::of_splines(model, sharing),
        Entities::Analytic | Entities::Boundary => Brep::by_numbers(model, sharing),
    };
    let resolution_mm = (gap_mm + brep.topology.gap_mm).max(options.resolution_mm);
    let mut sheet = Sheet::default();
    let colours = Colours::define(&mut sheet, model, options)?;
    let looks = (&colours, options);
    match options.entities {
        Entities::Boundary => shell::shells(&mut sheet, model, &brep, looks, resolution_mm)?,
        _ => trimmed_surfaces(&mut sheet, model, &brep, looks, resolution_mm)?,
    }
    let what = match options.entities {
        Entities::Boundary => "shells of faces",
        _ => "trimmed surfaces",
    };
    let start = format!("{}: {what} from a range scan", options.system);
    let global = global_fields(options, resolution_mm, largest_coordinate(model));
    let bytes = sheet.write(&start, &global, out)?;
    Ok(Summary {
        faces: model.faces.len(),
        entities: sheet.entities(),
        bytes,
        resolution_mm,
    })
}

/// Each face as a thing of its own, on the edges that it shares.
fn trimmed_surfaces(
    sheet: &mut Sheet,
    model: &Model,
    Brep { carriers, topology }: &Brep,
    (colours, options): (&Colours, &WriteOptions),
    resolution_mm: f64,
) -> Result<(), WriteError> {
    for (index, face) in model.faces.iter().enumerate() {
        let colour = colours.of(face.region, options);
        let style = Style {
            entities: options.entities,
            level: face.region,
            resolution_mm,
        };
        let (of, loops) = ((face, &carriers[index]), &topology.uses[index]);
        let (surface, borders) = border::bounded_surface(sheet, style, of, topology, loops)?;
        write_face(sheet, style, face, index + 1, colour, surface, &borders)?;
    }
    Ok(())
}

/// Entity 144 and the name of the face; `borders` begin with the outer one.
fn write_face(
    sheet: &mut Sheet,
    style: Style,
    face: &Face,
    number: usize,
    colour: ColourField,
    surface: Pointer,
    borders: &[Pointer],
) -> Result<(), WriteError> {
    let level = style.level;
    let name = write_name(sheet, level, &face.name)?;
    let entry = Entry {
        colour,
        label: "FACE",
        subscript: number,
        ..plain_entry(144, level, Status::Independent)
    };
    write_trims(sheet, entry, surface, borders, name)
}

/// Entity 144; `borders` begin with the outer one.
fn write_trims(
    sheet: &mut Sheet,
    entry: Entry<'_>,
    surface: Pointer,
    borders: &[Pointer],
    name: Pointer,
) -> Result<(), WriteError> {
    let mut trimmed = sheet.begin(entry);
    trimmed.pointer(surface);
    // The outer border is given, not that of the surface.
    trimmed.integer(1);
    trimmed.integer(borders.len().saturating_sub(1));
    for &border in borders {
        trimmed.pointer(border);
    }
    // No associativities, one property.
    trimmed.integer(0);
    trimmed.integer(1);
    trimmed.pointer(name);
    trimmed.finish()?;
    Ok(())
}

/// Entity 406, form 15.
fn write_name(sheet: &mut Sheet, level: u16, name: &str) -> Result<Pointer, WriteError> {
    let mut record = sheet.begin(Entry {
        form: 15,
        line_font: 0,
        ..plain_entry(406, level, Status::Dependent)
    });
    record.integer(1);
    record.text(name);
    record.finish()
}

/// The 26 fields of the Global section.
fn global_fields(options: &WriteOptions, resolution_mm: f64, largest_mm: f64) -> Vec<String> {
    let text = |value: &str| {
        let mut out = String::new();
        fields::text(&mut out, value);
        out
    };
    let real = |value: f64| {
        let mut out = String::new();
        fields::real(&mut out, value);
        out
    };
    let changed = options
        .model_timestamp
        .as_ref()
        .unwrap_or(&options.timestamp);
    vec![
        text(","),
        text(";"),
        text(&options.product),
        text(&options.file_name),
        text(&options.system),
        text(&options.system),
        // Bits of an integer; powers of ten and digits of single and double precision.
        "32".to_owned(),
        "38".to_owned(),
        "6".to_owned(),
        "308".to_owned(),
        "15".to_owned(),
        text(&options.product),
        // Scale 1, millimetres by flag and by name.
        real(1.0),
        "2".to_owned(),
        text("MM"),
        // One line weight, the thinnest and the widest at once.
        "1".to_owned(),
        real(LINE_WIDTH_MM),
        text(&options.timestamp),
        real(resolution_mm),
        real(largest_mm),
        text(&options.author),
        text(&options.organization),
        // Version 5.3, no drafting standard.
        "11".to_owned(),
        "0".to_owned(),
        text(changed),
        // No application protocol.
        String::new(),
    ]
}

/// Largest absolute coordinate at the corners of all patches, millimetres.
fn largest_coordinate(model: &Model) -> f64 {
    let mut largest = 0.0_f64;
    for face in &model.faces {
        let Surface::Patches(patches) = &face.surface;
        for &u in &patches.u_breaks {
            for &v in &patches.v_breaks {
                for coordinate in patches.evaluate(u, v) {
                    largest = largest.max(coordinate.abs());
                }
            }
        }
    }
    largest
}
