//! From a processed scan to surfaces and an NC program. Each may fail without the others, and without
//! the model.

use cad_exchange::iges::NamedSurface;
use features::field::FieldError;
use features::recognise::RecogniseError;
use pipeline::{Observer, Stage};
use range_image::Cancelled;
use reconstruct::Model;
use segment::SegmentError;
use skin::SkinError;
use surfacing::{HeightGrid, Made, SurfaceError};
use tessellate::{MeshFace, TessellateError};
use toolpath::{Surface, ToolpathError};

use super::milled::{MillError, mill};
use super::options::{MillOf, SkinOptions, ToolpathOptions};
use super::recognised::{recognised, write_recognised};
use super::report::{SkinReport, SurfaceReport, ToolpathReport};
use super::skinned::{SkinFigures, cut_remark, rows_of, skin_pictures};
use super::surface_file::{SurfaceFormat, SurfacesError, made_model, write_made};
use super::surface_pictures::surface_pictures;
use super::surfaced::{
    CharacterLineFigures, FairingFigures, SurfaceFigures, SurfaceWords, surface_remarks,
};
use crate::export::{Entities, file_stem, write_surfaces};
use crate::extras::Extras;
use crate::features::FEATURES_NAME;
use crate::meshes::{TrianglesError, triangles};
use crate::write::{DeliverError, Inputs};

/// What is told of surfaces and NC programs.
#[derive(Debug, Default)]
pub(crate) struct FurtherReports {
    pub(crate) surface: Option<SurfaceReport>,
    pub(crate) skin: Option<SkinReport>,
    pub(crate) toolpath: Option<ToolpathReport>,
}

/// Why one is left out; a wish to end is none.
pub(super) enum Stop {
    Cancelled(Cancelled),
    Refused(String),
}

impl From<Cancelled> for Stop {
    fn from(cancelled: Cancelled) -> Self {
        Self::Cancelled(cancelled)
    }
}

impl From<SurfaceError> for Stop {
    fn from(error: SurfaceError) -> Self {
        match error {
            SurfaceError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Refused(other.to_string()),
        }
    }
}

impl From<RecogniseError> for Stop {
    fn from(error: RecogniseError) -> Self {
        match error {
            RecogniseError::Cancelled(cancelled)
            | RecogniseError::Field(FieldError::Cancelled(cancelled))
            | RecogniseError::Segment(SegmentError::Cancelled(cancelled)) => {
                Self::Cancelled(cancelled)
            }
            other => Self::Refused(other.to_string()),
        }
    }
}

impl From<SkinError> for Stop {
    fn from(error: SkinError) -> Self {
        match error {
            SkinError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Refused(other.to_string()),
        }
    }
}

impl From<MillError> for Stop {
    fn from(error: MillError) -> Self {
        match error {
            MillError::Toolpath(ToolpathError::Cancelled(cancelled)) => Self::Cancelled(cancelled),
            other => Self::Refused(other.to_string()),
        }
    }
}

impl From<TrianglesError> for Stop {
    fn from(error: TrianglesError) -> Self {
        match error {
            TrianglesError::Tessellate(TessellateError::Cancelled(cancelled)) => {
                Self::Cancelled(cancelled)
            }
            other => Self::Refused(other.to_string()),
        }
    }
}

/// Work by as many threads as the settings have.
pub(super) fn threaded<T: Send>(
    inputs: &Inputs<'_>,
    work: impl FnOnce() -> Result<T, Stop> + Send,
) -> Result<T, Stop> {
    regrid::with_threads(inputs.settings.regrid.threads, work)
        .map_err(|error| Stop::Refused(error.to_string()))
        .and_then(|done| done)
}

/// Makes and writes what is asked for.
pub(crate) fn write_further(
    extras: &mut Extras<'_>,
    inputs: &Inputs<'_>,
    watch: &dyn Observer,
) -> Result<FurtherReports, DeliverError> {
    let wanted = &inputs.cad.further;
    let stem = file_stem(inputs.name);
    let mut reports = FurtherReports::default();
    let mut made = None;
    if let Some(settings) = wanted.surface {
        watch.stage(Stage::Surface);
        let name = format!("{stem}.surface.igs");
        if !extras.lacks_room_for(&name) {
            match surface(inputs, &settings, watch) {
                Ok(done) => {
                    reports.surface = done.write(extras, inputs, &name, &settings)?;
                    made = Some(done.made);
                }
                Err(stop) => left_out(extras, &name, stop)?,
            }
        }
        watch.progress(1.0);
    }
    if let Some(options) = wanted.skin {
        watch.stage(Stage::Skin);
        let name = format!("{stem}.skin.igs");
        if !extras.lacks_room_for(&name) {
            match skinned(extras, inputs, options, &name, watch)? {
                Ok(report) => reports.skin = report,
                Err(stop) => left_out(extras, &name, stop)?,
            }
        }
        watch.progress(1.0);
    }
    if let Some(options) = &wanted.toolpath {
        watch.stage(Stage::Toolpath);
        let name = format!("{stem}.nc");
        if !extras.lacks_room_for(&name) {
            match milled(extras, inputs, options, (&name, made.as_ref()), watch)? {
                Ok(report) => reports.toolpath = report,
                Err(stop) => left_out(extras, &name, stop)?,
            }
        }
        watch.progress(1.0);
    }
    if let Some(network) = &wanted.features {
        watch.stage(Stage::Features);
        if !extras.lacks_room_for(FEATURES_NAME) {
            match recognised(inputs, network, &wanted.edits, watch) {
                Ok(found) => write_recognised(extras, inputs, &found)?,
                Err(stop) => left_out(extras, FEATURES_NAME, stop)?,
            }
        }
        watch.progress(1.0);
    }
    Ok(reports)
}

fn left_out(extras: &mut Extras<'_>, name: &str, stop: Stop) -> Result<(), DeliverError> {
    match stop {
        Stop::Cancelled(cancelled) => Err(cancelled.into()),
        Stop::Refused(why) => {
            extras.refuse(name, &why);
            Ok(())
        }
    }
}

/// A surface over the range image.
struct Surfaced {
    grid: HeightGrid,
    made: Made,
}

fn surface(
    inputs: &Inputs<'_>,
    settings: &surfacing::Settings,
    watch: &dyn Observer,
) -> Result<Surfaced, Stop> {
    let grid = HeightGrid::from_image(inputs.image)?;
    let made = threaded(inputs, || Ok(surfacing::make(&grid, settings, watch)?))?;
    Ok(Surfaced { grid, made })
}

impl Surfaced {
    fn write(
        &self,
        extras: &mut Extras<'_>,
        inputs: &Inputs<'_>,
        name: &str,
        settings: &surfacing::Settings,
    ) -> Result<Option<SurfaceReport>, DeliverError> {
        let made = &self.made;
        let is_written = extras.put(name, &|sink| {
            let format = SurfaceFormat::Iges(Entities::Rational128);
            let author = &inputs.cad.author;
            let written = write_made(made, inputs.name, inputs.timestamp, author, format, sink);
            written.map_err(SurfacesError::into_write)
        })?;
        if !is_written {
            return Ok(None);
        }
        let remarks = surface_remarks(made, settings, SurfaceWords::KEYS);
        let remarks = remarks.iter().map(|remark| format!("{name}: {remark}"));
        extras.remarks.extend(remarks);
        match surface_pictures(inputs.name, &self.grid, made, settings) {
            Ok(drawn) => {
                for (picture, png) in drawn {
                    let picture = format!("surface-{picture}");
                    extras.put(&picture, &|sink| Ok(sink.write_all(&png)?))?;
                }
            }
            Err(error) => extras.refuse("pictures of the surface", &error),
        }
        Ok(Some(SurfaceReport {
            file: name.to_owned(),
            pitch_mm: self.grid.pitch_mm(),
            tolerance_mm: settings.tolerance_mm,
            noise_mm: made.report.noise_mm,
            surface: SurfaceFigures::of(made),
            character_lines: CharacterLineFigures::of(made),
            fairing: FairingFigures::of(made),
        }))
    }
}

fn put_surfaces(
    extras: &mut Extras<'_>,
    inputs: &Inputs<'_>,
    name: &str,
    named: &[NamedSurface<'_>],
) -> Result<bool, DeliverError> {
    extras.put(name, &|sink| {
        let author = &inputs.cad.author;
        let entities = Entities::Rational128;
        write_surfaces(named, inputs.name, inputs.timestamp, author, entities, sink)?;
        Ok(())
    })
}

fn skinned(
    extras: &mut Extras<'_>,
    inputs: &Inputs<'_>,
    options: SkinOptions,
    name: &str,
    watch: &dyn Observer,
) -> Result<Result<Option<SkinReport>, Stop>, DeliverError> {
    let pitch_mm = inputs.image.pitch_mm();
    let every = rows_of(options.every_mm.unwrap_or(pitch_mm), pitch_mm);
    let cut = skin::cut(inputs.image, every);
    let found = threaded(inputs, || {
        Ok(skin::skin(&cut.sections, &options.settings, watch)?)
    });
    let found = match found {
        Ok(found) => found,
        Err(stop) => return Ok(Err(stop)),
    };
    let named = NamedSurface {
        name: inputs.name,
        surface: &found.surface,
        is_closed: [found.is_closed, false],
    };
    if !put_surfaces(extras, inputs, name, &[named])? {
        return Ok(Ok(None));
    }
    match skin_pictures(inputs.name, &found, options.settings.tolerance_mm) {
        Ok(drawn) => {
            for (picture, png) in drawn {
                let picture = format!("skin-{picture}");
                extras.put(&picture, &|sink| Ok(sink.write_all(&png)?))?;
            }
        }
        Err(error) => extras.refuse("pictures of the sections", &error),
    }
    let remarks = found.warnings.iter().map(ToString::to_string);
    for remark in cut_remark(&cut).into_iter().chain(remarks) {
        extras.remarks.push(format!("{name}: {remark}"));
    }
    Ok(Ok(Some(SkinReport {
        file: name.to_owned(),
        every_mm: every as f64 * pitch_mm,
        figures: SkinFigures::of(&found, &options.settings),
    })))
}

/// What is to be milled, as triangles.
fn to_be_milled(
    inputs: &Inputs<'_>,
    of: MillOf,
    made: Option<&Made>,
    watch: &dyn Observer,
) -> Result<Surface, Stop> {
    let whole: Model;
    let model = match of {
        MillOf::Model => &inputs.outcome.reconstruction.model,
        MillOf::Surface => {
            let Some(made) = made else {
                return Err(Stop::Refused(
                    "it is to mill the B-spline surface, which there is none of".to_owned(),
                ));
            };
            whole =
                made_model(made, inputs.name).map_err(|error| Stop::Refused(error.to_string()))?;
            &whole
        }
    };
    let tolerance_mm = inputs.cad.meshes.tolerance_mm;
    let mesh = triangles(model, tolerance_mm, watch).map_err(|error| match Stop::from(error) {
        Stop::Refused(why) => Stop::Refused(format!(
            "what is milled are triangles within deliverables.mesh_tolerance_mm = {tolerance_mm}: \
             {why}"
        )),
        cancelled => cancelled,
    })?;
    let indices: Vec<[usize; 3]> = mesh
        .faces
        .iter()
        .flat_map(MeshFace::triangles)
        .map(|triangle| triangle.map(|vertex| vertex as usize))
        .collect();
    Ok(Surface::new(&mesh.vertices_mm, &indices).map_err(MillError::from)?)
}

fn milled(
    extras: &mut Extras<'_>,
    inputs: &Inputs<'_>,
    options: &ToolpathOptions,
    (name, made): (&str, Option<&Made>),
    watch: &dyn Observer,
) -> Result<Result<Option<ToolpathReport>, Stop>, DeliverError> {
    let machine = &options.machine;
    let milled = threaded(inputs, || {
        let surface = to_be_milled(inputs, options.of, made, watch)?;
        let simulating = || watch.progress(0.0);
        let milled = mill(
            &surface,
            machine,
            &options.settings,
            options.pitch_mm,
            watch,
            &simulating,
        )?;
        Ok((milled, surface.triangles()))
    });
    let (milled, triangles) = match milled {
        Ok(milled) => milled,
        Err(stop) => return Ok(Err(stop)),
    };
    let title = inputs.name;
    let written = extras.put(name, &|sink| {
        Ok(milled.write(machine, title, inputs.timestamp, sink)?)
    })?;
    if !written {
        return Ok(Ok(None));
    }
    let notes = milled.plan.notes.iter();
    extras
        .remarks
        .extend(notes.map(|note| format!("{name}: {note}")));
    let mut png = Vec::new();
    match milled.draw(title, &mut png) {
        Ok(()) => {
            extras.put("toolpath.png", &|sink| Ok(sink.write_all(&png)?))?;
        }
        Err(error) => extras.refuse("toolpath.png", &error),
    }
    let operations = milled.operations(machine);
    Ok(Ok(Some(ToolpathReport {
        file: name.to_owned(),
        of: options.of.as_str().to_owned(),
        triangles,
        total_s: operations.iter().map(|own| own.time_s).sum(),
        operations,
        simulation: milled.simulation,
    })))
}
