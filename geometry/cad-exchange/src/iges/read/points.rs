//! Measured points: entities 106 (copious data) and 116 (point).

use std::io::Read;

use super::error::ReadError;
use super::file::{Entity, File};
use super::transform;

/// Most points that are read: with the file beside them they stay below 1 GB.
const MOST_POINTS: usize = 1 << 24;

/// Reads the measured points of anybody's IGES file, in the order of the file.
///
/// Taken are the coordinates of entities 116 and of 106 in all its forms, with their
/// transformation matrices applied, in millimetres whatever the file's unit. Left out are
/// the points that other entities are made of (physically dependent ones), annotations,
/// definitions and points in parameter planes; vectors given with the points of 106 are
/// not used.
///
/// # Errors
/// [`ReadError`], naming line and entity; [`ReadError::Nothing`] when the file holds no
/// measured points.
pub fn read_points(source: impl Read) -> Result<Vec<[f64; 3]>, ReadError> {
    let file = File::read(source)?;
    let (mut points, mut matrices) = (Vec::new(), transform::Known::default());
    for entity in &file.entities {
        if !is_measured(entity) {
            continue;
        }
        let from = points.len();
        match entity.entity {
            106 => copious_data(&file, entity, &mut points)?,
            116 => points.push(file.record(entity)?.reals("a coordinate")?),
            _ => continue,
        }
        let matrix = matrices.of(&file, entity)?;
        for point in points.iter_mut().skip(from) {
            if let Some(matrix) = &matrix {
                *point = transform::apply(matrix, *point);
            }
            *point = point.map(|coordinate| coordinate * file.global.unit_mm);
            if !point.iter().all(|coordinate| coordinate.is_finite()) {
                return Err(file.defect(entity, "a coordinate is too large"));
            }
        }
    }
    if points.is_empty() {
        return Err(ReadError::Nothing {
            wanted: "measured points (entities 106 or 116)",
            found: without_points(&file),
        });
    }
    Ok(points)
}

/// What the file is, if not a scan.
fn without_points(file: &File) -> String {
    if file.entities.is_empty() {
        return "and no other entities".to_owned();
    }
    let census = file.census();
    let there = |entity: u32| file.entities.iter().any(|e| e.entity == entity);
    if there(106) || there(116) {
        // They belong to other entities, or are annotations.
        return format!("only such as other entities are made of, among {census}");
    }
    format!("but {census}; it is a CAD model, not a scan")
}

pub(super) fn is_measured(entity: &Entity) -> bool {
    !matches!(entity.subordinate, 1 | 3) && !matches!(entity.purpose, 1 | 2 | 5)
}

pub(super) fn copious_data(
    file: &File,
    entity: &Entity,
    points: &mut Vec<[f64; 3]>,
) -> Result<(), ReadError> {
    let mut record = file.record(entity)?;
    let kind = record.integer("the kind of tuples")?;
    let count = record.count("the number of tuples")?;
    let plane_z = match kind {
        1 => record.real("the common z")?,
        2 | 3 => 0.0,
        _ => {
            let reason = format!("tuples of kind {kind}: only 1 (x y), 2 (x y z) and 3 are known");
            return Err(record.defect(reason));
        }
    };
    for _ in 0..count {
        let point = match kind {
            1 => {
                let [x, y] = record.reals("a coordinate")?;
                [x, y, plane_z]
            }
            2 => record.reals("a coordinate")?,
            _ => {
                let [x, y, z, ..] = record.reals::<6>("a coordinate")?;
                [x, y, z]
            }
        };
        points.push(point);
        if points.len() > MOST_POINTS {
            return Err(ReadError::TooManyPoints { limit: MOST_POINTS });
        }
    }
    Ok(())
}
