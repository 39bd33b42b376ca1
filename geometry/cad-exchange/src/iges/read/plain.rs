//! What lies in a file by itself: chains of points and curves (106, 112, 126), and whole surfaces
//! (128).

use std::io::Read;

use nurbs::BSplineSurface;

use super::error::ReadError;
use super::file::File;
use super::model::{SplineCurve, TrimmedSurface, curve, surface};
use super::points::{copious_data, is_measured};
use super::transform;

/// Places of each piece of a curve that stand for it.
const PER_PIECE: usize = 8;

/// A chain of points, as an entity has it or from along a curve, millimetres.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Entity type: 106, 112 or 126.
    pub entity: u32,
    /// Sequence number of its directory entry.
    pub line: usize,
    /// The points.
    pub points: Vec<[f64; 3]>,
}

/// A surface that nothing trims, millimetres.
#[derive(Debug, Clone, PartialEq)]
pub struct PlainSurface {
    /// Sequence number of its directory entry.
    pub line: usize,
    /// The surface.
    pub surface: BSplineSurface,
}

/// Reads the chains of points (106) and the curves (112, 126) that lie in a file by themselves, in
/// its order; curves become points, eight for each of their pieces, and the last one.
///
/// # Errors
/// [`ReadError`], naming line and entity; [`ReadError::Nothing`] where there are none.
pub fn read_chains(source: impl Read) -> Result<Vec<Chain>, ReadError> {
    let file = File::read(source)?;
    let (mut chains, mut matrices) = (Vec::new(), transform::Known::default());
    for entity in file.entities.iter().filter(|entity| is_measured(entity)) {
        let mut points = Vec::new();
        match entity.entity {
            106 => {
                copious_data(&file, entity, &mut points)?;
                if let Some(matrix) = matrices.of(&file, entity)? {
                    points
                        .iter_mut()
                        .for_each(|p| *p = transform::apply(&matrix, *p));
                }
            }
            112 | 126 => points = along(&curve(&file, entity)?),
            _ => continue,
        }
        points
            .iter_mut()
            .for_each(|p| *p = p.map(|c| c * file.global.unit_mm));
        chains.push(Chain {
            entity: entity.entity,
            line: entity.directory,
            points,
        });
    }
    if chains.is_empty() {
        return Err(nothing(
            &file,
            "chains of points or curves (entities 106, 112 or 126)",
        ));
    }
    Ok(chains)
}

/// Reads the B-spline surfaces (128) that lie in a file by themselves, untrimmed, in its order.
///
/// # Errors
/// [`ReadError`], naming line and entity; [`ReadError::Nothing`] where there are none.
pub fn read_surfaces(source: impl Read) -> Result<Vec<PlainSurface>, ReadError> {
    let file = File::read(source)?;
    let mut surfaces = Vec::new();
    let all = file.entities.iter().filter(|entity| is_measured(entity));
    for entity in all.filter(|entity| entity.entity == 128) {
        if let TrimmedSurface::BSpline(own) = surface(&file, entity)? {
            let points = own
                .points()
                .iter()
                .map(|p| p.map(|c| c * file.global.unit_mm));
            let knots = (own.u_knots().clone(), own.v_knots().clone());
            let scaled = BSplineSurface::new(knots.0, knots.1, points.collect());
            surfaces.push(PlainSurface {
                line: entity.directory,
                surface: scaled.map_err(|e| file.defect(entity, e.to_string()))?,
            });
        }
    }
    if surfaces.is_empty() {
        return Err(nothing(&file, "surfaces by themselves (entity 128)"));
    }
    Ok(surfaces)
}

fn nothing(file: &File, wanted: &'static str) -> ReadError {
    let found = if file.entities.is_empty() {
        "and no other entities".to_owned()
    } else {
        format!("but {}", file.census())
    };
    ReadError::Nothing { wanted, found }
}

/// Places along a curve.
fn along(curve: &SplineCurve<3>) -> Vec<[f64; 3]> {
    let (breaks, at): (Vec<f64>, &dyn Fn(f64) -> [f64; 3]) = match curve {
        SplineCurve::Cubic(curve) => (curve.breaks.clone(), &|t| curve.evaluate(t)),
        SplineCurve::BSpline(curve) => (curve.knots().breaks(), &|t| curve.evaluate(t)),
    };
    let within = breaks.windows(2).flat_map(|pair| {
        let share = |k: usize| k as f64 / PER_PIECE as f64;
        (0..PER_PIECE).map(move |k| pair[0] + (pair[1] - pair[0]) * share(k))
    });
    within.chain(breaks.last().copied()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::iges::{NamedSurface, WriteOptions, write_surfaces};
    use nurbs::KnotVector;

    #[test]
    fn a_surface_written_is_read_again() {
        let (u, v) = (
            KnotVector::uniform(3, 4, 0.0, 1.0).unwrap(),
            KnotVector::uniform(2, 3, -1.0, 2.0).unwrap(),
        );
        let count = u.control_count() * v.control_count();
        let points = (0..count).map(|k| [k as f64 / 3.0, (k % 5) as f64, (k * k % 7) as f64]);
        let surface = BSplineSurface::new(u, v, points.collect()).unwrap();
        let named = NamedSurface {
            name: "a",
            surface: &surface,
            is_closed: [false; 2],
        };
        let mut bytes = Vec::new();
        let options = WriteOptions::new("a", "20261121.093000");
        write_surfaces(&[named, named], &options, &mut bytes).unwrap();
        let read = read_surfaces(bytes.as_slice()).unwrap();
        assert_eq!(read.len(), 2);
        assert!(read.iter().all(|own| own.surface == surface));
        let error = read_chains(bytes.as_slice()).unwrap_err().to_string();
        assert!(error.contains("106, 112 or 126"), "{error}");
    }
}
