//! Faces as boundary representation: shells (514) of faces (510), whose loops (508) use edges (504)
//! and vertices (502) that the whole file lists once. A shell without a free edge is the boundary
//! of a solid (186).
//!
//! Which faces are neighbours is said by numbers, not found out from curves that happen to
//! coincide: a reader has nothing to sew.

use reconstruct::{Face, Model};

use super::Style;
use super::border::{as_the_surface_sees, carrier_surface, plan};
use super::error::WriteError;
use super::options::{Entities, WriteOptions};
use super::shapes::{Joined, curve, plain_entry};
use super::sheet::{ColourField, Entry, Pointer, Sheet, Status};
use super::{colour::Colours, write_name};
use crate::brep::{Brep, Carrier, Strand, Topology, Use};

/// Level of what belongs to no face alone.
const COMMON_LEVEL: u16 = 0;
/// Form of shells with free edges, and of those without.
const OPEN_SHELL: u8 = 2;
const CLOSED_SHELL: u8 = 1;

/// The shells of a model, each a thing of its own.
pub(super) fn shells(
    sheet: &mut Sheet,
    model: &Model,
    brep: &Brep,
    (colours, options): (&Colours, &WriteOptions),
    resolution_mm: f64,
) -> Result<(), WriteError> {
    let Brep { carriers, topology } = brep;
    let edges = edge_list(sheet, topology, resolution_mm)?;
    let mut faces = Vec::with_capacity(model.faces.len());
    for (index, face) in model.faces.iter().enumerate() {
        let style = Style {
            entities: Entities::Boundary,
            level: face.region,
            resolution_mm,
        };
        let of = (face, &carriers[index], topology.uses[index].as_slice());
        let colour = colours.of(face.region, options);
        faces.push(write_face(
            sheet,
            style,
            of,
            (topology, edges),
            colour,
            index + 1,
        )?);
    }
    for (number, shell) in topology.shells.iter().enumerate() {
        let closed = is_closed(topology, shell);
        let mut record = sheet.begin(Entry {
            form: if closed { CLOSED_SHELL } else { OPEN_SHELL },
            label: "SHELL",
            subscript: number + 1,
            ..plain_entry(
                514,
                COMMON_LEVEL,
                if closed {
                    Status::Dependent
                } else {
                    Status::Independent
                },
            )
        });
        record.integer(shell.len());
        for &face in shell {
            record.pointer(faces[face]);
            // All normals of the model are on the side of the camera, which is without.
            record.integer(usize::from(carriers[face].same_sense()));
        }
        let pointer = record.finish()?;
        if closed {
            let mut solid = sheet.begin(Entry {
                label: "SOLID",
                subscript: number + 1,
                ..plain_entry(186, COMMON_LEVEL, Status::Independent)
            });
            solid.pointer(pointer);
            // As the shell has it; no voids.
            solid.integer(1);
            solid.integer(0);
            solid.finish()?;
        }
    }
    Ok(())
}

/// No edge of these faces is used only once.
fn is_closed(topology: &Topology, shell: &[usize]) -> bool {
    let mut uses = vec![0_usize; topology.edges.len()];
    for of in shell
        .iter()
        .flat_map(|&face| topology.uses[face].iter().flatten())
    {
        uses[of.edge] += 1;
    }
    uses.iter().all(|&count| count == 0 || count == 2)
}

/// Entities 502 and 504 over the curves; a pointer to the latter.
fn edge_list(
    sheet: &mut Sheet,
    topology: &Topology,
    resolution_mm: f64,
) -> Result<Pointer, WriteError> {
    let numbers = vertex_numbers(topology);
    let mut record = sheet.begin(list(502));
    record.integer(numbers.iter().flatten().count());
    for (vertex, _) in topology
        .vertices
        .iter()
        .zip(&numbers)
        .filter(|(_, n)| n.is_some())
    {
        record.reals(vertex);
    }
    let vertices = record.finish()?;
    let curves = topology
        .edges
        .iter()
        .map(|strand| edge_curve(sheet, topology, strand, resolution_mm))
        .collect::<Result<Vec<_>, _>>()?;
    let mut record = sheet.begin(list(504));
    record.integer(curves.len());
    for (strand, curve) in topology.edges.iter().zip(curves) {
        record.pointer(curve);
        for end in strand.ends {
            record.pointer(vertices);
            record.integer(numbers[end].unwrap_or_default());
        }
    }
    record.finish()
}

/// Number in the file's list, from 1, of each vertex that ends an edge.
fn vertex_numbers(topology: &Topology) -> Vec<Option<usize>> {
    let mut numbers = vec![None; topology.vertices.len()];
    for end in topology.edges.iter().flat_map(|strand| strand.ends) {
        numbers[end] = Some(0);
    }
    for (k, number) in numbers.iter_mut().flatten().enumerate() {
        *number = k + 1;
    }
    numbers
}

fn list(entity: u16) -> Entry<'static> {
    Entry {
        form: 1,
        ..plain_entry(entity, COMMON_LEVEL, Status::Dependent)
    }
}

fn edge_curve(
    sheet: &mut Sheet,
    topology: &Topology,
    strand: &Strand,
    resolution_mm: f64,
) -> Result<Pointer, WriteError> {
    let joined = Joined {
        curve: &strand.curve,
        end: topology.vertices[strand.ends[1]],
        closed: strand.ends[0] == strand.ends[1],
        flat_mm: resolution_mm,
    };
    curve(sheet, Entities::Boundary, COMMON_LEVEL, &joined)
}

/// Entity 510 on its surface, with its loops and its name.
fn write_face(
    sheet: &mut Sheet,
    style: Style,
    (face, carrier, loops): (&Face, &Carrier, &[Vec<Use>]),
    (topology, edges): (&Topology, Pointer),
    colour: ColourField,
    number: usize,
) -> Result<Pointer, WriteError> {
    let (surface, is_spline) = carrier_surface(sheet, style, face, carrier)?;
    let borders = loops
        .iter()
        .map(|uses| {
            let uses = as_the_surface_sees(carrier, uses);
            write_loop(sheet, style, is_spline, (topology, edges), &uses)
        })
        .collect::<Result<Vec<_>, _>>()?;
    let name = write_name(sheet, style.level, &face.name)?;
    let mut record = sheet.begin(Entry {
        form: 1,
        colour,
        label: "FACE",
        subscript: number,
        ..plain_entry(510, style.level, Status::Dependent)
    });
    record.pointer(surface);
    record.integer(borders.len());
    // The first loop is the outer one.
    record.integer(1);
    for border in borders {
        record.pointer(border);
    }
    // No associativities, one property.
    record.integer(0);
    record.integer(1);
    record.pointer(name);
    record.finish()
}

/// Entity 508. On a B-spline over x and y each use has its curve in the parameter plane.
fn write_loop(
    sheet: &mut Sheet,
    style: Style,
    is_spline: bool,
    (topology, edges): (&Topology, Pointer),
    uses: &[Use],
) -> Result<Pointer, WriteError> {
    let flat = if is_spline {
        flat_curves(sheet, style, topology, uses)?
    } else {
        Vec::new()
    };
    let mut record = sheet.begin(Entry {
        form: 1,
        ..plain_entry(508, style.level, Status::Dependent)
    });
    record.integer(uses.len());
    for (k, of) in uses.iter().enumerate() {
        // An edge, not a vertex.
        record.integer(0);
        record.pointer(edges);
        record.integer(of.edge + 1);
        record.integer(usize::from(of.forward));
        match flat.get(k) {
            Some(&curve) => {
                record.integer(1);
                // It is not claimed to follow a line of the parameters.
                record.integer(0);
                record.pointer(curve);
            }
            None => record.integer(0),
        }
    }
    record.finish()
}

/// The uses of a loop as curves in x and y, in its sense of travel.
fn flat_curves(
    sheet: &mut Sheet,
    style: Style,
    topology: &Topology,
    uses: &[Use],
) -> Result<Vec<Pointer>, WriteError> {
    let flat: Vec<_> = uses
        .iter()
        .map(|of| plan(&topology.edges[of.edge].directed(of.forward)))
        .collect();
    let next = flat.iter().cycle().skip(1);
    flat.iter()
        .zip(next)
        .map(|(of, next)| {
            let joined = Joined {
                curve: of,
                end: next.start(),
                closed: flat.len() == 1,
                flat_mm: style.resolution_mm,
            };
            curve(sheet, style.entities, style.level, &joined)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nurbs::PiecewiseCubic;

    fn strand(ends: [usize; 2]) -> Strand {
        let curve = PiecewiseCubic::new(vec![0.0, 1.0], vec![[[0.0; 4]; 3]]).unwrap();
        Strand { ends, curve }
    }

    fn uses(edges: &[usize]) -> Vec<Vec<Use>> {
        let of = |&edge| Use {
            edge,
            forward: true,
        };
        vec![edges.iter().map(of).collect()]
    }

    #[test]
    fn shells_are_closed_where_every_edge_has_two_uses() {
        let topology = Topology {
            edges: (0..3).map(|k| strand([k, k + 1])).collect(),
            uses: vec![uses(&[0, 1]), uses(&[0, 1]), uses(&[1, 2])],
            ..Topology::default()
        };
        assert!(is_closed(&topology, &[0, 1]));
        assert!(!is_closed(&topology, &[0]));
        assert!(!is_closed(&topology, &[0, 1, 2]));
    }

    #[test]
    fn vertices_without_an_edge_have_no_number() {
        let topology = Topology {
            vertices: vec![[0.0; 3]; 5],
            edges: vec![strand([4, 1]), strand([2, 2])],
            ..Topology::default()
        };
        assert_eq!(
            vertex_numbers(&topology),
            [None, Some(1), Some(2), None, Some(3)]
        );
    }
}
