//! Curves and surfaces as entities: 112 and 114, or 126 and 128.

use nurbs::{BSplineCurve, BSplineSurface, KnotVector, PatchSurface, PiecewiseCubic};

use super::error::WriteError;
use super::options::Entities;
use super::sheet::{ColourField, Entry, Pointer, Record, Sheet, Status};
use crate::common::SMOOTH_MM;

/// The same for what 112 claims of its joints; readers that check allow for no more than
/// rounding.
const SURE_MM: f64 = 1e-14;

/// Spline type "cubic" of 112 and boundary type of 114.
const CUBIC: usize = 3;

/// Coefficients of a patch by coordinate: three times sixteen.
const PATCH_COEFFICIENTS: usize = 48;

/// A curve and where it is to end: the start of the next one in the loop, so that the two
/// agree to the last bit where the entity lists its end.
pub(super) struct Joined<'a, const D: usize> {
    pub(super) curve: &'a PiecewiseCubic<D>,
    pub(super) end: [f64; D],
    /// The curve is a loop by itself.
    pub(super) closed: bool,
    /// How far points may lie off a common plane.
    pub(super) flat_mm: f64,
}

/// A surface that others depend on.
pub(super) fn surface(
    sheet: &mut Sheet,
    entities: Entities,
    level: u16,
    surface: &PatchSurface,
) -> Result<Pointer, WriteError> {
    match entities {
        Entities::Parametric114 => parametric_surface(sheet, level, surface),
        _ => bspline_surface(sheet, level, surface),
    }
}

/// A curve that others depend on: in the parameter plane for two dimensions, in space for
/// three.
pub(super) fn curve<const D: usize>(
    sheet: &mut Sheet,
    entities: Entities,
    level: u16,
    joined: &Joined<'_, D>,
) -> Result<Pointer, WriteError> {
    match entities {
        Entities::Parametric114 => parametric_curve(sheet, level, joined),
        _ => bspline_curve(sheet, level, joined),
    }
}

/// Status of a curve below a 142.
pub(super) fn curve_status(dimensions: usize) -> Status {
    if dimensions == 2 {
        Status::DependentInParameterPlane
    } else {
        Status::Dependent
    }
}

pub(super) fn plain_entry(entity: u16, level: u16, status: Status) -> Entry<'static> {
    Entry {
        entity,
        form: 0,
        line_font: 1,
        level,
        status,
        colour: ColourField::Number(0),
        label: "",
        subscript: 0,
    }
}

/// Entity 114.
fn parametric_surface(
    sheet: &mut Sheet,
    level: u16,
    surface: &PatchSurface,
) -> Result<Pointer, WriteError> {
    let mut record = sheet.begin(plain_entry(114, level, Status::Dependent));
    patch_parameters(&mut record, surface);
    record.finish()
}

/// The parameters of entity 114.
pub(super) fn patch_parameters(record: &mut Record<'_>, surface: &PatchSurface) {
    let (columns, rows) = (surface.u_breaks.len() - 1, surface.v_breaks.len() - 1);
    record.integer(CUBIC);
    // Patches of the full sixteen coefficients.
    record.integer(1);
    record.integer(columns);
    record.integer(rows);
    record.reals(&surface.u_breaks);
    record.reals(&surface.v_breaks);
    for (i, column) in surface.patches.chunks(rows).enumerate() {
        for (j, z) in column.iter().enumerate() {
            // x = u and y = v: a constant and a 1 at the power concerned.
            coordinate(record, surface.u_breaks[i], 1);
            coordinate(record, surface.v_breaks[j], 4);
            for row in z {
                record.reals(row);
            }
        }
        unused_patch(record);
    }
    // The standard reserves patches for the last breaks too, with values of no meaning.
    for _ in 0..=rows {
        unused_patch(record);
    }
}

/// Sixteen coefficients of a coordinate that equals one parameter.
fn coordinate(record: &mut Record<'_>, start: f64, linear_at: usize) {
    for k in 0..16 {
        record.real(if k == 0 {
            start
        } else if k == linear_at {
            1.0
        } else {
            0.0
        });
    }
}

fn unused_patch(record: &mut Record<'_>) {
    for _ in 0..PATCH_COEFFICIENTS {
        record.real(0.0);
    }
}

/// Entity 128.
fn bspline_surface(
    sheet: &mut Sheet,
    level: u16,
    surface: &PatchSurface,
) -> Result<Pointer, WriteError> {
    let spline = surface.to_bspline(SMOOTH_MM);
    let mut record = sheet.begin(plain_entry(128, level, Status::Dependent));
    bspline_parameters(&mut record, &spline, [false; 2]);
    record.finish()
}

/// The parameters of entity 128; `is_closed` along u and along v.
pub(super) fn bspline_parameters(
    record: &mut Record<'_>,
    spline: &BSplineSurface,
    is_closed: [bool; 2],
) {
    let (u, v) = (spline.u_knots(), spline.v_knots());
    let (columns, rows) = (u.control_count(), v.control_count());
    record.integer(columns - 1);
    record.integer(rows - 1);
    record.integer(u.degree());
    record.integer(v.degree());
    // Closed in u and in v; polynomial; not periodic in u nor in v.
    let [u_closed, v_closed] = is_closed.map(usize::from);
    for flag in [u_closed, v_closed, 1, 0, 0] {
        record.integer(flag);
    }
    record.reals(u.knots());
    record.reals(v.knots());
    for _ in 0..columns * rows {
        record.real(1.0);
    }
    // The standard has u fastest, ours v.
    for j in 0..rows {
        for column in spline.points().chunks(rows) {
            record.reals(&column[j]);
        }
    }
    for domain in [u.domain(), v.domain()] {
        record.reals(&[domain.0, domain.1]);
    }
}

/// Entity 112.
fn parametric_curve<const D: usize>(
    sheet: &mut Sheet,
    level: u16,
    joined: &Joined<'_, D>,
) -> Result<Pointer, WriteError> {
    let Joined { curve, end, .. } = joined;
    let mut record = sheet.begin(plain_entry(112, level, curve_status(D)));
    record.integer(CUBIC);
    record.integer(continuity(curve.to_bspline(SURE_MM).knots()));
    record.integer(D);
    record.integer(curve.pieces.len());
    record.reals(&curve.breaks);
    for piece in &curve.pieces {
        for coordinate in piece {
            record.reals(coordinate);
        }
        // A plane curve lies in z = 0.
        for _ in D..3 {
            record.reals(&[0.0; 4]);
        }
    }
    // The end point and its derivatives, divided by the factorials of their orders.
    let last = curve.pieces.len() - 1;
    let width = curve.breaks[last + 1] - curve.breaks[last];
    let [first, second, third] = [1, 2, 3].map(|order| curve.piece_value(last, width, order));
    for d in 0..3 {
        if d < D {
            record.reals(&[end[d], first[d], second[d] / 2.0, third[d] / 6.0]);
        } else {
            record.reals(&[0.0; 4]);
        }
    }
    record.finish()
}

/// 0, 1 or 2: what the joints of a cubic spline with these knots keep.
fn continuity(knots: &KnotVector) -> usize {
    let inner = knots
        .knots()
        .get(knots.degree() + 1..knots.control_count())
        .unwrap_or_default();
    let repeated = inner
        .chunk_by(|a, b| a == b)
        .map(<[f64]>::len)
        .max()
        .unwrap_or(1);
    knots.degree().saturating_sub(repeated)
}

/// Entity 126.
fn bspline_curve<const D: usize>(
    sheet: &mut Sheet,
    level: u16,
    joined: &Joined<'_, D>,
) -> Result<Pointer, WriteError> {
    let spline: BSplineCurve<D> = joined.curve.to_bspline(SMOOTH_MM);
    let mut record = sheet.begin(plain_entry(126, level, curve_status(D)));
    let (end, flat_mm) = (Some(joined.end), joined.flat_mm);
    curve_parameters(&mut record, &spline, end, joined.closed, flat_mm);
    record.finish()
}

/// The parameters of entity 126; its last control point is `end` where that is given, and points within
/// `flat_mm` of one plane are in it.
pub(super) fn curve_parameters<const D: usize>(
    record: &mut Record<'_>,
    spline: &BSplineCurve<D>,
    end: Option<[f64; D]>,
    closed: bool,
    flat_mm: f64,
) {
    let knots = spline.knots();
    let count = knots.control_count();
    let normal = plane_normal(spline.points(), flat_mm);
    record.integer(count - 1);
    record.integer(knots.degree());
    record.integer(usize::from(normal.is_some()));
    record.integer(usize::from(closed));
    // Polynomial, not periodic.
    record.integer(1);
    record.integer(0);
    record.reals(knots.knots());
    for _ in 0..count {
        record.real(1.0);
    }
    for (index, point) in spline.points().iter().enumerate() {
        let last = end.as_ref().filter(|_| index + 1 == count);
        record.reals(last.unwrap_or(point));
        for _ in D..3 {
            record.real(0.0);
        }
    }
    let (first, last) = knots.domain();
    record.reals(&[first, last]);
    // Normal of the plane, zero where there is none.
    record.reals(&normal.unwrap_or_default());
}

/// Unit normal of the one plane that holds the points; `None` where there is none, or
/// where they lie on a line in space and so in many.
fn plane_normal<const D: usize>(points: &[[f64; D]], tolerance_mm: f64) -> Option<[f64; 3]> {
    if D == 2 {
        return Some([0.0, 0.0, 1.0]);
    }
    let origin = points.first()?;
    let arms: Vec<[f64; 3]> = points
        .iter()
        .map(|p| core::array::from_fn(|d| if d < D { p[d] - origin[d] } else { 0.0 }))
        .collect();
    let longest = |vectors: &[[f64; 3]]| {
        vectors
            .iter()
            .copied()
            .max_by(|a, b| dot(a, a).total_cmp(&dot(b, b)))
    };
    let arm = longest(&arms)?;
    let crosses: Vec<[f64; 3]> = arms.iter().map(|other| cross(&arm, other)).collect();
    let normal = longest(&crosses)?;
    let length = dot(&normal, &normal).sqrt();
    if length <= tolerance_mm * dot(&arm, &arm).sqrt() {
        return None;
    }
    let normal = normal.map(|n| n / length);
    arms.iter()
        .all(|arm| dot(&normal, arm).abs() <= tolerance_mm)
        .then_some(normal)
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes() {
        let tilted = [
            [0.0, 0.0, 1.0],
            [4.0, 0.0, 4.0],
            [4.0, 2.0, 4.0],
            [0.0, 2.0, 1.0],
        ];
        let [x, y, z] = plane_normal(&tilted, 1e-9).unwrap();
        assert!((x.abs() - 0.6).abs() < 1e-12 && y.abs() < 1e-12 && (z.abs() - 0.8).abs() < 1e-12);
        let mut bent = tilted;
        bent[2][2] += 0.1;
        assert_eq!(plane_normal(&bent, 1e-3), None);
        assert!(plane_normal(&bent, 0.2).is_some());
        let line = [[0.0; 3], [1.0, 2.0, 3.0], [2.0, 4.0, 6.0]];
        assert_eq!(plane_normal(&line, 1e-9), None);
        assert_eq!(
            plane_normal(&[[1.0, 2.0], [3.0, 4.0]], 1e-9),
            Some([0.0, 0.0, 1.0])
        );
        assert_eq!(plane_normal::<3>(&[], 1e-9), None);
    }
}
