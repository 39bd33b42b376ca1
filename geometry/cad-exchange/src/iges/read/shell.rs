//! Faces of shells: 514 on 510, 508, 504 and 502.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use super::analytic::{SURFACES, is_analytic};
use super::error::ReadError;
use super::file::{Entity, File, Record};
use super::model::{SplineCurve, TrimmedCurve, TrimmedFace, colour, curve, name, placed, surface};

/// How much farther than the file's resolution an edge may end from its vertex: a number has as
/// many digits as its writer thought right.
const ROUNDING_MM: f64 = 1e-6;

/// Faces that hang together.
#[derive(Debug, Clone, PartialEq)]
pub struct Shell {
    /// Indices into [`super::TrimmedModel::faces`].
    pub faces: Vec<usize>,
    /// It says that it has no free edges.
    pub is_closed: bool,
}

/// The edge lists read so far, by their directory entries; faces share them.
type Lists = BTreeMap<usize, Vec<SplineCurve<3>>>;

/// All shells of a file, and their faces in the order of these.
pub(super) fn shells(file: &File) -> Result<(Vec<Shell>, Vec<TrimmedFace>), ReadError> {
    let mut lists = Lists::new();
    let mut shells = Vec::new();
    let mut faces = Vec::new();
    for entity in file.entities.iter().filter(|entity| entity.entity == 514) {
        let mut record = placed(file, entity)?;
        let count = record.count("the number of its faces")?;
        let first = faces.len();
        for _ in 0..count {
            let of = record.pointer("a face", &[510])?;
            record.integer("the sense of a face")?;
            faces.push(face(file, of, &mut lists)?);
        }
        shells.push(Shell {
            faces: (first..faces.len()).collect(),
            is_closed: entity.form == 1,
        });
    }
    Ok((shells, faces))
}

/// Entity 510.
fn face(file: &File, entity: &Entity, lists: &mut Lists) -> Result<TrimmedFace, ReadError> {
    let mut record = placed(file, entity)?;
    let carrier = record.pointer("its surface", &SURFACES)?;
    let count = record.count("the number of its loops")?;
    if record.integer("whether its first loop is the outer one")? != 1 {
        return Err(record.defect("faces without an outer loop are not read"));
    }
    let mut loops = Vec::new();
    for _ in 0..count {
        let border = record.pointer("a loop", &[508])?;
        loops.push(border_loop(file, border, is_analytic(carrier), lists)?);
    }
    let mut loops = loops.into_iter();
    let Some(outer) = loops.next() else {
        return Err(record.defect("it has no loop"));
    };
    Ok(TrimmedFace {
        name: name(file, &mut record)?,
        level: u32::try_from(entity.level).unwrap_or(0),
        colour: colour(file, entity)?,
        surface: surface(file, carrier)?,
        outer,
        inner: loops.collect(),
    })
}

/// Entity 508: its curves in its sense of travel.
fn border_loop(
    file: &File,
    entity: &Entity,
    on_numbers: bool,
    lists: &mut Lists,
) -> Result<Vec<TrimmedCurve>, ReadError> {
    let mut record = placed(file, entity)?;
    let count = record.count("the number of its edges")?;
    let mut curves = Vec::new();
    for _ in 0..count {
        if record.integer("the kind of an edge")? != 0 {
            return Err(record.defect("loops with a vertex in place of an edge are not read"));
        }
        let list = record.pointer("a list of edges", &[504])?;
        let number = index(&mut record, "the number of an edge")?;
        let forward = record.integer("the sense of an edge")? == 1;
        let edges = match lists.entry(list.directory) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(place) => place.insert(edge_list(file, list)?),
        };
        let Some(edge) = number.checked_sub(1).and_then(|k| edges.get(k)) else {
            let reason = format!("edge {number} is not among the {} of its list", edges.len());
            return Err(record.defect(reason));
        };
        let space_curve = if forward {
            edge.clone()
        } else {
            edge.reversed()
        };
        let flat = record.count("the number of parameter curves of an edge")?;
        if flat != usize::from(!on_numbers) {
            return Err(record.defect(format!(
                "an edge has {flat} parameter curves: read are one on a spline and none on a \
                 surface by its numbers"
            )));
        }
        let parameter_curve = if on_numbers {
            None
        } else {
            record.integer("whether a parameter curve follows a parameter line")?;
            let of = record.pointer("a parameter curve", &[112, 126])?;
            Some(curve(file, of)?)
        };
        curves.push(TrimmedCurve {
            parameter_curve,
            space_curve,
        });
    }
    Ok(curves)
}

/// Entity 504: its curves, each of which ends at its vertices.
fn edge_list(file: &File, entity: &Entity) -> Result<Vec<SplineCurve<3>>, ReadError> {
    let mut record = placed(file, entity)?;
    let count = record.count("the number of its edges")?;
    let mut vertices: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    let most_mm = file.global.resolution + ROUNDING_MM;
    let mut edges = Vec::new();
    for number in 1..=count {
        let of: SplineCurve<3> = curve(file, record.pointer("a curve", &[112, 126])?)?;
        let (first, last) = of.domain();
        for at in [first, last] {
            let list = record.pointer("a list of vertices", &[502])?;
            let vertex = index(&mut record, "the number of a vertex")?;
            let known = match vertices.entry(list.directory) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(place) => place.insert(vertex_list(file, list)?),
            };
            let place = vertex
                .checked_sub(1)
                .and_then(|k| known.chunks_exact(3).nth(k));
            let Some(place) = place else {
                let reason = format!("vertex {vertex} of edge {number} is not in its list");
                return Err(record.defect(reason));
            };
            let end = of.evaluate(at);
            let off_mm = place
                .iter()
                .zip(end)
                .map(|(p, q)| (p - q).powi(2))
                .sum::<f64>()
                .sqrt();
            if off_mm > most_mm {
                return Err(record.defect(format!(
                    "edge {number} ends {off_mm} mm from its vertex {vertex}, more than the file's \
                     resolution"
                )));
            }
        }
        edges.push(of);
    }
    Ok(edges)
}

/// A number in a list of another entity, which the record need not have room for.
fn index(record: &mut Record<'_>, name: &str) -> Result<usize, ReadError> {
    let number = record.integer(name)?;
    usize::try_from(number).map_err(|_| record.defect(format!("{name} is {number}")))
}

/// Entity 502: its coordinates, three by three.
fn vertex_list(file: &File, entity: &Entity) -> Result<Vec<f64>, ReadError> {
    let mut record = placed(file, entity)?;
    let count = record.count("the number of its vertices")?;
    record.list(count.saturating_mul(3), "a coordinate")
}
