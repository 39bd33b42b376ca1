//! Faces as [`crate::iges::write()`] writes them: 144 on 142 on 114 and 112, on 128 and 126, or on
//! 190 to 198 and 126; or those of shells.

use std::io::Read;

use nurbs::{BSplineCurve, BSplineSurface, KnotVector, PatchSurface, PiecewiseCubic};

use super::analytic::{AnalyticSurface, SURFACES, analytic, is_analytic, swept};
use super::error::ReadError;
use super::file::{Entity, File, Record};
use super::shell::{Shell, shells};

/// What a file of trimmed surfaces or shells holds. Millimetres.
#[derive(Debug, Clone, PartialEq)]
pub struct TrimmedModel {
    /// Name of the part.
    pub product: String,
    /// Who made it.
    pub author: String,
    /// The author's organisation.
    pub organization: String,
    /// When the file was written, `YYYYMMDD.HHMMSS`.
    pub timestamp: String,
    /// Least gap between what should meet.
    pub resolution_mm: f64,
    /// The faces, in the order of the file.
    pub faces: Vec<TrimmedFace>,
    /// Which of them hang together, where the file says so.
    pub shells: Vec<Shell>,
}

/// A trimmed surface.
#[derive(Debug, Clone, PartialEq)]
pub struct TrimmedFace {
    /// Its name, where it has one.
    pub name: Option<String>,
    /// Its level, 0 for none.
    pub level: u32,
    /// Its colour, red, green and blue of 0 to 255, where one is defined.
    pub colour: Option<[u8; 3]>,
    /// The untrimmed surface.
    pub surface: TrimmedSurface,
    /// The outer border.
    pub outer: Vec<TrimmedCurve>,
    /// Holes.
    pub inner: Vec<Vec<TrimmedCurve>>,
}

/// The carrier of a face.
#[derive(Debug, Clone, PartialEq)]
pub enum TrimmedSurface {
    /// Entity 114 over x and y.
    Patches(PatchSurface),
    /// Entity 128.
    BSpline(BSplineSurface),
    /// Entities 190 to 198.
    Analytic(AnalyticSurface),
}

/// A curve of either family.
#[derive(Debug, Clone, PartialEq)]
pub enum SplineCurve<const D: usize> {
    /// Entity 112.
    Cubic(PiecewiseCubic<D>),
    /// Entity 126.
    BSpline(BSplineCurve<D>),
}

impl<const D: usize> SplineCurve<D> {
    /// First and last parameter.
    #[must_use]
    pub fn domain(&self) -> (f64, f64) {
        match self {
            Self::Cubic(curve) => curve.domain(),
            Self::BSpline(curve) => curve.knots().domain(),
        }
    }

    /// The point at parameter `t`.
    #[must_use]
    pub fn evaluate(&self, t: f64) -> [f64; D] {
        match self {
            Self::Cubic(curve) => curve.evaluate(t),
            Self::BSpline(curve) => curve.evaluate(t),
        }
    }

    /// The same curve run the other way, over the same domain.
    #[must_use]
    pub fn reversed(&self) -> Self {
        match self {
            Self::Cubic(curve) => Self::Cubic(curve.reversed()),
            Self::BSpline(curve) => Self::BSpline(curve.reversed()),
        }
    }
}

/// A part of a border, given twice.
#[derive(Debug, Clone, PartialEq)]
pub struct TrimmedCurve {
    /// In the parameter plane of the surface; `None` on a surface by its numbers.
    pub parameter_curve: Option<SplineCurve<2>>,
    /// In space.
    pub space_curve: SplineCurve<3>,
}

/// Reads the trimmed faces of a file that [`crate::iges::write()`] wrote, or those of its shells.
///
/// # Errors
/// [`ReadError`], naming line and entity, also for entities that other programs write
/// and this one does not; [`ReadError::Nothing`] when there are neither trimmed surfaces nor shells.
pub fn read_model(source: impl Read) -> Result<TrimmedModel, ReadError> {
    let file = File::read(source)?;
    if file.global.unit_mm != 1.0 {
        return Err(ReadError::Global {
            field: 14,
            name: "units flag",
            reason: "models are read in millimetres at scale 1 only".to_owned(),
        });
    }
    let mut faces = file
        .entities
        .iter()
        .filter(|entity| entity.entity == 144)
        .map(|entity| face(&file, entity))
        .collect::<Result<Vec<_>, _>>()?;
    let loose = faces.len();
    let (mut shells, hung) = shells(&file)?;
    for face in shells.iter_mut().flat_map(|shell| &mut shell.faces) {
        *face += loose;
    }
    faces.extend(hung);
    if faces.is_empty() {
        return Err(ReadError::Nothing {
            wanted: "trimmed surfaces (entity 144) and no shells (514)",
            found: format!("but {}", file.census()),
        });
    }
    let global = file.global;
    Ok(TrimmedModel {
        product: global.product,
        author: global.author,
        organization: global.organization,
        timestamp: global.timestamp,
        resolution_mm: global.resolution,
        faces,
        shells,
    })
}

fn face(file: &File, entity: &Entity) -> Result<TrimmedFace, ReadError> {
    let mut record = placed(file, entity)?;
    let carrier = record.pointer("its surface", &SURFACES)?;
    if record.integer("the kind of its outer border")? != 1 {
        return Err(record.defect("the border of the surface itself is not read as a border"));
    }
    let holes = record.count("the number of its inner borders")?;
    let mut borders = Vec::new();
    for _ in 0..=holes {
        borders.push(record.pointer("a border", &[142])?);
    }
    let name = name(file, &mut record)?;
    let mut loops = borders
        .iter()
        .map(|border| trimming_loop(file, border, carrier))
        .collect::<Result<Vec<_>, _>>()?
        .into_iter();
    Ok(TrimmedFace {
        name,
        level: u32::try_from(entity.level).unwrap_or(0),
        colour: colour(file, entity)?,
        surface: surface(file, carrier)?,
        outer: loops.next().unwrap_or_default(),
        inner: loops.collect(),
    })
}

/// The record of an entity that has no transformation matrix.
pub(super) fn placed<'a>(file: &'a File, entity: &'a Entity) -> Result<Record<'a>, ReadError> {
    if entity.transformation != 0 {
        return Err(file.defect(entity, "transformed surfaces and curves are not read"));
    }
    file.record(entity)
}

/// The first name among the properties after the parameters.
pub(super) fn name(file: &File, record: &mut Record<'_>) -> Result<Option<String>, ReadError> {
    if record.ended() {
        return Ok(None);
    }
    for _ in 0..record.count("the number of its associativities")? {
        record.integer("an associativity")?;
        if record.ended() {
            return Ok(None);
        }
    }
    for _ in 0..record.count("the number of its properties")? {
        let pointer = record.integer("a property")?;
        let Some(property) = file.entity(pointer) else {
            return Err(record.defect(format!("the property D{pointer} is not there")));
        };
        if property.entity == 406 && property.form == 15 {
            let mut property = file.record(property)?;
            property.integer("the number of names")?;
            return property.text("the name").map(Some);
        }
    }
    Ok(None)
}

pub(super) fn colour(file: &File, entity: &Entity) -> Result<Option<[u8; 3]>, ReadError> {
    if entity.colour >= 0 {
        return Ok(None);
    }
    let definition = entity
        .colour
        .checked_neg()
        .and_then(|pointer| file.entity(pointer))
        .filter(|definition| definition.entity == 314)
        .ok_or_else(|| file.defect(entity, "its colour is not a colour definition (314)"))?;
    let percent: [f64; 3] = file.record(definition)?.reals("a percentage")?;
    if !percent.iter().all(|p| (0.0..=100.0).contains(p)) {
        return Err(file.defect(definition, "a percentage is not within 0 and 100"));
    }
    Ok(Some(percent.map(|p| libm::round(p * 2.55) as u8)))
}

fn trimming_loop(
    file: &File,
    entity: &Entity,
    carrier: &Entity,
) -> Result<Vec<TrimmedCurve>, ReadError> {
    let mut record = placed(file, entity)?;
    record.integer("how it came about")?;
    if record.pointer("its surface", &SURFACES)? != carrier {
        return Err(record.defect("it lies on another surface than the face it bounds"));
    }
    let flat: Option<Vec<SplineCurve<2>>> = if is_analytic(carrier) {
        if record.integer("its parameter curve")? != 0 {
            return Err(record.defect("parameter curves on surfaces by their numbers are not read"));
        }
        None
    } else {
        let flat = record.pointer("its parameter curve", &[102, 112, 126])?;
        Some(curves(file, flat)?)
    };
    let spatial = record.pointer("its space curve", &[102, 112, 126])?;
    let spatial: Vec<SplineCurve<3>> = curves(file, spatial)?;
    let Some(flat) = flat else {
        let alone = |space_curve| TrimmedCurve {
            parameter_curve: None,
            space_curve,
        };
        return Ok(spatial.into_iter().map(alone).collect());
    };
    if flat.len() != spatial.len() {
        return Err(record.defect(format!(
            "it has {} curves in the parameter plane, but {} in space",
            flat.len(),
            spatial.len()
        )));
    }
    let pairs = flat.into_iter().zip(spatial);
    Ok(pairs
        .map(|(parameter_curve, space_curve)| TrimmedCurve {
            parameter_curve: Some(parameter_curve),
            space_curve,
        })
        .collect())
}

/// The parts of a composite, or the curve itself.
fn curves<const D: usize>(file: &File, entity: &Entity) -> Result<Vec<SplineCurve<D>>, ReadError> {
    if entity.entity != 102 {
        return Ok(vec![curve(file, entity)?]);
    }
    let mut record = placed(file, entity)?;
    let count = record.count("the number of its curves")?;
    let mut parts = Vec::new();
    for _ in 0..count {
        let part = record.pointer("a curve", &[112, 126])?;
        parts.push(curve(file, part)?);
    }
    Ok(parts)
}

pub(super) fn curve<const D: usize>(
    file: &File,
    entity: &Entity,
) -> Result<SplineCurve<D>, ReadError> {
    let mut record = placed(file, entity)?;
    if entity.entity == 112 {
        cubic_curve(&mut record).map(SplineCurve::Cubic)
    } else {
        bspline_curve(&mut record).map(SplineCurve::BSpline)
    }
}

/// Entity 112.
fn cubic_curve<const D: usize>(record: &mut Record<'_>) -> Result<PiecewiseCubic<D>, ReadError> {
    record.integer("the spline type")?;
    record.integer("the degree of continuity")?;
    record.integer("the number of dimensions")?;
    let pieces = record.count("the number of pieces")?;
    let breaks = record.list(pieces.saturating_add(1), "a break")?;
    let mut coefficients = Vec::new();
    for _ in 0..pieces {
        let mut piece = [[0.0; 4]; D];
        for dimension in 0..3 {
            let values = record.reals("a coefficient")?;
            if let Some(coordinate) = piece.get_mut(dimension) {
                *coordinate = values;
            }
        }
        coefficients.push(piece);
    }
    PiecewiseCubic::new(breaks, coefficients).map_err(|defect| record.defect(defect.to_string()))
}

/// Entity 114.
fn patches(record: &mut Record<'_>) -> Result<PatchSurface, ReadError> {
    record.integer("the boundary type")?;
    record.integer("the patch type")?;
    let columns = record.count("the number of patches in u")?;
    let rows = record.count("the number of patches in v")?;
    let u_breaks = record.list(columns.saturating_add(1), "a break in u")?;
    let v_breaks = record.list(rows.saturating_add(1), "a break in v")?;
    let mut patches = Vec::new();
    for &u in u_breaks.iter().take(columns) {
        for &v in v_breaks.iter().take(rows) {
            let x: [f64; 16] = record.reals("a coefficient of x")?;
            let y: [f64; 16] = record.reals("a coefficient of y")?;
            if x != parameter(u, 1) || y != parameter(v, 4) {
                return Err(record.defect("its parameters are not its x and y"));
            }
            let mut patch = [[0.0; 4]; 4];
            for row in &mut patch {
                *row = record.reals("a coefficient of z")?;
            }
            patches.push(patch);
        }
        // The patch of the last break, without meaning.
        record.reals::<48>("an unused coefficient")?;
    }
    PatchSurface::new(u_breaks, v_breaks, patches)
        .map_err(|defect| record.defect(defect.to_string()))
}

/// Coefficients of a coordinate that equals one parameter.
fn parameter(start: f64, linear_at: usize) -> [f64; 16] {
    let mut coefficients = [0.0; 16];
    coefficients[0] = start;
    coefficients[linear_at] = 1.0;
    coefficients
}

pub(super) fn surface(file: &File, entity: &Entity) -> Result<TrimmedSurface, ReadError> {
    let mut record = placed(file, entity)?;
    match entity.entity {
        114 => patches(&mut record).map(TrimmedSurface::Patches),
        128 => bspline_surface(&mut record).map(TrimmedSurface::BSpline),
        120 | 122 => swept(file, entity, &mut record).map(TrimmedSurface::Analytic),
        _ => analytic(file, entity, &mut record).map(TrimmedSurface::Analytic),
    }
}

/// Entity 126.
fn bspline_curve<const D: usize>(record: &mut Record<'_>) -> Result<BSplineCurve<D>, ReadError> {
    let points = record
        .count("the number of control points")?
        .saturating_add(1);
    let degree = record.count("the degree")?;
    for flag in ["planar", "closed", "polynomial", "periodic"] {
        record.integer(flag)?;
    }
    let knots = knots(record, degree, points)?;
    weights(record, points)?;
    let mut control = Vec::new();
    for _ in 0..points {
        let point: [f64; 3] = record.reals("a control point")?;
        let mut kept = [0.0; D];
        for (kept, coordinate) in kept.iter_mut().zip(point) {
            *kept = coordinate;
        }
        control.push(kept);
    }
    let domain: [f64; 2] = record.reals("the parameter range")?;
    whole_domain(record, &knots, domain)?;
    BSplineCurve::new(knots, control).map_err(|defect| record.defect(defect.to_string()))
}

/// Entity 128.
fn bspline_surface(record: &mut Record<'_>) -> Result<BSplineSurface, ReadError> {
    let columns = record
        .count("the number of control points in u")?
        .saturating_add(1);
    let rows = record
        .count("the number of control points in v")?
        .saturating_add(1);
    let u_degree = record.count("the degree in u")?;
    let v_degree = record.count("the degree in v")?;
    for flag in [
        "closed in u",
        "closed in v",
        "polynomial",
        "periodic in u",
        "periodic in v",
    ] {
        record.integer(flag)?;
    }
    let u_knots = knots(record, u_degree, columns)?;
    let v_knots = knots(record, v_degree, rows)?;
    let count = columns.saturating_mul(rows);
    weights(record, count)?;
    // The standard has u fastest, ours v.
    let coordinates = record.list(count.saturating_mul(3), "a control point")?;
    let mut control = Vec::with_capacity(count);
    for i in 0..columns {
        for j in 0..rows {
            let at = 3 * (j * columns + i);
            if let Some(&[x, y, z]) = coordinates.get(at..at + 3) {
                control.push([x, y, z]);
            }
        }
    }
    let u: [f64; 2] = record.reals("the range of u")?;
    let v: [f64; 2] = record.reals("the range of v")?;
    whole_domain(record, &u_knots, u)?;
    whole_domain(record, &v_knots, v)?;
    BSplineSurface::new(u_knots, v_knots, control)
        .map_err(|defect| record.defect(defect.to_string()))
}

fn knots(record: &mut Record<'_>, degree: usize, points: usize) -> Result<KnotVector, ReadError> {
    let count = points.saturating_add(degree).saturating_add(1);
    let values = record.list(count, "a knot")?;
    KnotVector::new(degree, values).map_err(|defect| record.defect(defect.to_string()))
}

fn weights(record: &mut Record<'_>, count: usize) -> Result<(), ReadError> {
    for _ in 0..count {
        if record.real("a weight")? != 1.0 {
            return Err(record.defect("rational splines are not read"));
        }
    }
    Ok(())
}

fn whole_domain(record: &Record<'_>, knots: &KnotVector, range: [f64; 2]) -> Result<(), ReadError> {
    if knots.domain() == (range[0], range[1]) {
        Ok(())
    } else {
        Err(record.defect("its parameter range is not that of its knots"))
    }
}
