//! Shells of trimmed faces as [`crate::step::write()`] writes them.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;

use nurbs::{BSplineCurve, BSplineSurface};

use super::exchange::{self, Exchange, Fields};
use super::known::KNOWN;
use super::properties::{self, Context, Validation};
use super::shapes::{SURFACES, Shapes};
use super::syntax::Value;
use super::{ReadError, text};

/// What a file of shells holds. Millimetres, whatever the file's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct StepModel {
    /// Name and identifier of the schema, as the header has them.
    pub schema: String,
    /// Name of the part.
    pub product: String,
    /// Who made it.
    pub author: String,
    /// The author's organisation.
    pub organization: String,
    /// When the file was written, ISO 8601.
    pub timestamp: String,
    /// Length of the file's unit.
    pub unit_mm: f64,
    /// Largest gap between what should meet.
    pub uncertainty_mm: f64,
    /// Ends of edges.
    pub vertices_mm: Vec<[f64; 3]>,
    /// Edges, each once however many faces it belongs to.
    pub edges: Vec<StepEdge>,
    /// The faces, shell by shell.
    pub faces: Vec<StepFace>,
    /// Indices of the faces of each shell.
    pub shells: Vec<Vec<usize>>,
    /// Area of all faces as the writer found it.
    pub area_mm2: Option<f64>,
    /// Their centroid as the writer found it.
    pub centroid_mm: Option<[f64; 3]>,
    /// Entities that the file has and this reader does not know, with their numbers.
    pub unknown: BTreeMap<String, usize>,
}

/// A curve between two vertices.
#[derive(Debug, Clone, PartialEq)]
pub struct StepEdge {
    /// Indices of the vertices where it begins and ends.
    pub vertices: [usize; 2],
    /// The curve, from the first to the second.
    pub curve: BSplineCurve<3>,
}

/// A trimmed surface.
#[derive(Debug, Clone, PartialEq)]
pub struct StepFace {
    /// Its name, which may be empty.
    pub name: String,
    /// Its colour, red, green and blue of 0 to 255, where it has one.
    pub colour: Option<[u8; 3]>,
    /// The untrimmed surface.
    pub surface: StepSurface,
    /// The face's normal is that of the surface; else it is the opposite.
    pub same_sense: bool,
    /// The outer border.
    pub outer: Vec<StepEdgeUse>,
    /// Holes.
    pub inner: Vec<Vec<StepEdgeUse>>,
}

/// The use of an edge by a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepEdgeUse {
    /// Index of the edge.
    pub edge: usize,
    /// The loop runs from the edge's end to its start.
    pub reversed: bool,
}

/// Where a surface around an axis lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepFrame {
    /// A point of the axis, or the centre.
    pub origin_mm: [f64; 3],
    /// Unit direction of the axis.
    pub axis: [f64; 3],
    /// Unit direction from which angles around the axis are counted.
    pub x: [f64; 3],
}

/// The carrier of a face.
#[derive(Debug, Clone, PartialEq)]
pub enum StepSurface {
    /// `PLANE`.
    Plane {
        /// A point of it.
        origin_mm: [f64; 3],
        /// Its unit normal.
        normal: [f64; 3],
        /// A direction in it.
        x: [f64; 3],
    },
    /// `CYLINDRICAL_SURFACE`, its normal outwards.
    Cylinder {
        /// Where it is.
        frame: StepFrame,
        /// Its radius.
        radius_mm: f64,
    },
    /// `CONICAL_SURFACE`, its normal outwards. It opens along the axis.
    Cone {
        /// Where it is.
        frame: StepFrame,
        /// Its radius at the origin of the frame.
        radius_mm: f64,
        /// Angle between axis and surface.
        half_angle_rad: f64,
    },
    /// `SPHERICAL_SURFACE`, its normal outwards.
    Sphere {
        /// Where it is.
        frame: StepFrame,
        /// Its radius.
        radius_mm: f64,
    },
    /// `TOROIDAL_SURFACE`, its normal out of the tube.
    Torus {
        /// Where it is.
        frame: StepFrame,
        /// Radius of the circle amid the tube.
        radius_mm: f64,
        /// Radius of the tube.
        tube_mm: f64,
    },
    /// `SURFACE_OF_LINEAR_EXTRUSION`, its normal the tangent of the profile times the direction.
    Extrusion {
        /// What is shifted.
        profile: BSplineCurve<3>,
        /// How far and where to.
        along_mm: [f64; 3],
    },
    /// `SURFACE_OF_REVOLUTION`, its normal the velocity about the axis times the tangent of the
    /// profile.
    Revolution {
        /// What is turned.
        profile: BSplineCurve<3>,
        /// A point of the axis.
        origin_mm: [f64; 3],
        /// The axis.
        axis: [f64; 3],
    },
    /// `B_SPLINE_SURFACE_WITH_KNOTS`.
    BSpline(BSplineSurface),
}

/// Reads the shells of a file that [`crate::step::write()`] wrote.
///
/// # Errors
/// [`ReadError`], naming line and instance, also for entities that other programs write
/// and this one does not; [`ReadError::Nothing`] when there are no shells.
pub fn read_model(source: impl Read) -> Result<StepModel, ReadError> {
    let bytes = exchange::bytes(source)?;
    let exchange = Exchange::parse(&bytes, "only files that Relief wrote are read as models")?;
    let roots = exchange.all("MANIFOLD_SURFACE_SHAPE_REPRESENTATION");
    let &[root] = roots.as_slice() else {
        return Err(ReadError::Nothing {
            wanted: "single shape of shells (MANIFOLD_SURFACE_SHAPE_REPRESENTATION)",
            found: exchange.census(),
        });
    };
    let mut fields = exchange.fields(root, &["MANIFOLD_SURFACE_SHAPE_REPRESENTATION"])?;
    fields.skip("its name")?;
    let items = fields.ids("its items")?;
    let Context {
        unit_mm,
        uncertainty_mm,
    } = properties::context(&exchange, fields.id("its context")?)?;
    let shapes = Shapes {
        exchange: &exchange,
        unit_mm,
    };
    let mut topology = Topology::new(&shapes, properties::colours(&exchange)?);
    for item in items {
        topology.item(item)?;
    }
    let Validation {
        area_mm2,
        centroid_mm,
    } = properties::validation(&shapes)?;
    let unknown = exchange
        .entities()
        .into_iter()
        .filter(|(keyword, _)| !KNOWN.contains(keyword))
        .map(|(keyword, count)| (exchange::short(keyword).to_owned(), count))
        .collect();
    Ok(StepModel {
        schema: header_text(&exchange, "FILE_SCHEMA", 0)?,
        product: product(&exchange)?,
        author: header_text(&exchange, "FILE_NAME", 2)?,
        organization: header_text(&exchange, "FILE_NAME", 3)?,
        timestamp: header_text(&exchange, "FILE_NAME", 1)?,
        unit_mm,
        uncertainty_mm,
        vertices_mm: topology.vertices_mm,
        edges: topology.edges,
        faces: topology.faces,
        shells: topology.shells,
        area_mm2,
        centroid_mm,
        unknown,
    })
}

/// A string of the header, or the first of a list of them.
fn header_text(
    exchange: &Exchange<'_>,
    record: &'static str,
    index: usize,
) -> Result<String, ReadError> {
    let value = match exchange.header(record)?.get(index) {
        Some(Value::List(list)) => list.first(),
        other => other,
    };
    let read = match value {
        Some(Value::Text(raw)) => text::decoded(raw),
        _ => None,
    };
    read.ok_or_else(|| ReadError::Header {
        record,
        reason: format!("value {} is no string that can be read", index + 1),
    })
}

fn product(exchange: &Exchange<'_>) -> Result<String, ReadError> {
    let Some(&id) = exchange.all("PRODUCT").first() else {
        return Ok(String::new());
    };
    let mut fields = exchange.fields(id, &["PRODUCT"])?;
    fields.skip("its identifier")?;
    fields.text("its name")
}

/// Faces and what they share, each instance converted once.
struct Topology<'a, 'b> {
    shapes: &'b Shapes<'a, 'b>,
    colours: BTreeMap<u64, [u8; 3]>,
    vertex_numbers: BTreeMap<u64, usize>,
    edge_numbers: BTreeMap<u64, usize>,
    /// Instances that belong to one other only.
    claimed: BTreeSet<u64>,
    vertices_mm: Vec<[f64; 3]>,
    edges: Vec<StepEdge>,
    faces: Vec<StepFace>,
    shells: Vec<Vec<usize>>,
}

impl<'a, 'b> Topology<'a, 'b> {
    fn new(shapes: &'b Shapes<'a, 'b>, colours: BTreeMap<u64, [u8; 3]>) -> Self {
        Self {
            shapes,
            colours,
            vertex_numbers: BTreeMap::new(),
            edge_numbers: BTreeMap::new(),
            claimed: BTreeSet::new(),
            vertices_mm: Vec::new(),
            edges: Vec::new(),
            faces: Vec::new(),
            shells: Vec::new(),
        }
    }

    /// The values of an instance after its name; refused the second time, so that a file
    /// cannot make the model larger than itself.
    fn claim(&mut self, id: u64, expected: &[&'static str]) -> Result<Fields<'a, 'b>, ReadError> {
        let fields = self.shapes.exchange.fields(id, expected)?;
        if self.claimed.insert(id) {
            return Ok(fields);
        }
        Err(fields.defect("it belongs to two things, but may to one only"))
    }

    /// An item of the representation.
    fn item(&mut self, id: u64) -> Result<(), ReadError> {
        let known = ["SHELL_BASED_SURFACE_MODEL", "AXIS2_PLACEMENT_3D"];
        let mut fields = self.claim(id, &known)?;
        if fields.keyword() == "AXIS2_PLACEMENT_3D" {
            return Ok(());
        }
        fields.skip("its name")?;
        for shell in fields.ids("its shells")? {
            let mut fields = self.claim(shell, &["OPEN_SHELL"])?;
            fields.skip("its name")?;
            let from = self.faces.len();
            for face in fields.ids("its faces")? {
                let face = self.face(face)?;
                self.faces.push(face);
            }
            self.shells.push((from..self.faces.len()).collect());
        }
        Ok(())
    }

    fn face(&mut self, id: u64) -> Result<StepFace, ReadError> {
        let mut fields = self.claim(id, &["ADVANCED_FACE"])?;
        let name = fields.text("its name")?;
        let bounds = fields.ids("its bounds")?;
        let surface = fields.id("its surface")?;
        let same_sense = fields.logical("its sense")?;
        let (mut outer, mut inner) = (None, Vec::new());
        for bound in bounds {
            let (is_outer, border) = self.bound(bound)?;
            if !is_outer {
                inner.push(border);
            } else if outer.replace(border).is_some() {
                return Err(fields.defect("it has two outer bounds"));
            }
        }
        let Some(outer) = outer else {
            return Err(fields.defect("it has no outer bound"));
        };
        self.claim(surface, &SURFACES)?;
        Ok(StepFace {
            name,
            colour: self.colours.get(&id).copied(),
            surface: self.shapes.surface(surface)?,
            same_sense,
            outer,
            inner,
        })
    }

    fn bound(&mut self, id: u64) -> Result<(bool, Vec<StepEdgeUse>), ReadError> {
        let mut fields = self.claim(id, &["FACE_OUTER_BOUND", "FACE_BOUND"])?;
        let outer = fields.keyword() == "FACE_OUTER_BOUND";
        fields.skip("its name")?;
        let border = fields.id("its loop")?;
        if !fields.logical("its orientation")? {
            return Err(fields.defect("a loop that is turned round is not read"));
        }
        let mut fields = self.claim(border, &["EDGE_LOOP"])?;
        fields.skip("its name")?;
        let mut uses = Vec::new();
        for oriented in fields.ids("its edges")? {
            let mut oriented = self.claim(oriented, &["ORIENTED_EDGE"])?;
            for what in ["its name", "its start", "its end"] {
                oriented.skip(what)?;
            }
            let edge = self.edge(oriented.id("its edge")?)?;
            let reversed = !oriented.logical("its orientation")?;
            uses.push(StepEdgeUse { edge, reversed });
        }
        if self.closes(&uses) {
            Ok((outer, uses))
        } else {
            Err(fields.defect("an edge does not begin where the one before it ends"))
        }
    }

    fn closes(&self, uses: &[StepEdgeUse]) -> bool {
        let end = |of: &StepEdgeUse, start: bool| {
            let edge = self.edges.get(of.edge)?;
            Some(edge.vertices[usize::from(of.reversed == start)])
        };
        let next = uses.iter().cycle().skip(1);
        uses.iter()
            .zip(next)
            .all(|(of, next)| end(of, false) == end(next, true))
    }

    fn edge(&mut self, id: u64) -> Result<usize, ReadError> {
        if let Some(&number) = self.edge_numbers.get(&id) {
            return Ok(number);
        }
        let mut fields = self.claim(id, &["EDGE_CURVE"])?;
        fields.skip("its name")?;
        let start = self.vertex(fields.id("its start")?)?;
        let end = self.vertex(fields.id("its end")?)?;
        let curve = fields.id("its curve")?;
        if !fields.logical("its sense")? {
            return Err(fields.defect("an edge against the sense of its curve is not read"));
        }
        self.claim(curve, &["B_SPLINE_CURVE_WITH_KNOTS"])?;
        self.edges.push(StepEdge {
            vertices: [start, end],
            curve: self.shapes.curve(curve)?,
        });
        self.edge_numbers.insert(id, self.edges.len() - 1);
        Ok(self.edges.len() - 1)
    }

    fn vertex(&mut self, id: u64) -> Result<usize, ReadError> {
        if let Some(&number) = self.vertex_numbers.get(&id) {
            return Ok(number);
        }
        let mut fields = self.claim(id, &["VERTEX_POINT"])?;
        fields.skip("its name")?;
        let point = self.shapes.point(fields.id("its point")?)?;
        self.vertices_mm.push(point);
        self.vertex_numbers.insert(id, self.vertices_mm.len() - 1);
        Ok(self.vertices_mm.len() - 1)
    }
}
