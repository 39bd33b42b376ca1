//! Solids and shells as any CAD program writes them, for their triangles: of everything that the
//! files say besides, nothing is read.

mod carriers;
mod units;

use std::collections::BTreeMap;
use std::io::Read;

use ::solids::{Body, Edge, EdgeUse, Face};

use super::ReadError;
use super::exchange::{self, Exchange, Fields, short};
use super::shapes::Shapes;
use carriers::Carriers;

const ADVICE: &str =
    "which is not read: export the part as a solid of exact surfaces (AP203, AP214 or AP242)";
/// What has shells of faces.
const ROOTS: [&str; 4] = [
    "BREP_WITH_VOIDS",
    "FACETED_BREP",
    "MANIFOLD_SOLID_BREP",
    "SHELL_BASED_SURFACE_MODEL",
];
/// What puts parts somewhere else than where they are drawn.
const PLACED: [&str; 2] = ["MAPPED_ITEM", "NEXT_ASSEMBLY_USAGE_OCCURRENCE"];
const SHELLS: [&str; 4] = [
    "CLOSED_SHELL",
    "OPEN_SHELL",
    "ORIENTED_CLOSED_SHELL",
    "ORIENTED_OPEN_SHELL",
];
/// How deep shells may refer to shells.
const DEEPEST: usize = 8;

/// Reads all faces of a part, whatever program wrote it, in millimetres.
///
/// # Errors
/// [`ReadError`], naming line and instance; [`ReadError::Nothing`] when there are no faces. An
/// assembly is refused: its parts lie where its placements say.
pub fn read_body(source: impl Read) -> Result<Body, ReadError> {
    let bytes = exchange::bytes(source)?;
    let exchange = Exchange::parse(&bytes, ADVICE)?;
    for keyword in PLACED {
        if let Some(&id) = exchange.all(keyword).first() {
            let fields = exchange.fields(id, &[keyword])?;
            return Err(fields.defect(
                "it places a part in an assembly, which is not read: export the part alone",
            ));
        }
    }
    let units = units::of(&exchange)?;
    let shapes = Shapes {
        exchange: &exchange,
        unit_mm: units.length_mm,
    };
    let mut reader = Reader {
        exchange: &exchange,
        carriers: Carriers {
            shapes: &shapes,
            angle_rad: units.angle_rad,
        },
        vertices: BTreeMap::new(),
        edges: BTreeMap::new(),
        body: Body::default(),
    };
    for keyword in ROOTS {
        for id in exchange.all(keyword) {
            reader.root(id, keyword)?;
        }
    }
    if reader.body.faces.is_empty() {
        return Err(ReadError::Nothing {
            wanted: "solid or shell with faces",
            found: exchange.census(),
        });
    }
    Ok(reader.body)
}

struct Reader<'a, 'b> {
    exchange: &'b Exchange<'a>,
    carriers: Carriers<'a, 'b>,
    vertices: BTreeMap<u64, usize>,
    edges: BTreeMap<u64, usize>,
    body: Body,
}

impl<'a, 'b> Reader<'a, 'b> {
    fn named(&self, id: u64, expected: &[&'static str]) -> Result<Fields<'a, 'b>, ReadError> {
        let mut fields = self.exchange.fields(id, expected)?;
        fields.skip("its name")?;
        Ok(fields)
    }

    fn root(&mut self, id: u64, keyword: &'static str) -> Result<(), ReadError> {
        let mut fields = self.named(id, &[keyword])?;
        match keyword {
            "FACETED_BREP" => Err(fields.defect(
                "its faces are facets already: export them as STL, or the part as exact surfaces",
            )),
            "SHELL_BASED_SURFACE_MODEL" => {
                let shells = fields.ids("its shells")?;
                shells
                    .into_iter()
                    .try_for_each(|shell| self.shell(shell, false, DEEPEST))
            }
            _ => {
                self.shell(fields.id("its outer shell")?, false, DEEPEST)?;
                if keyword == "BREP_WITH_VOIDS" {
                    for void in fields.ids("its voids")? {
                        self.shell(void, false, DEEPEST)?;
                    }
                }
                Ok(())
            }
        }
    }

    fn shell(&mut self, id: u64, is_turned: bool, left: usize) -> Result<(), ReadError> {
        let mut fields = self.named(id, &SHELLS)?;
        if !fields.keyword().starts_with("ORIENTED") {
            for face in fields.ids("its faces")? {
                let face = self.face(face, is_turned)?;
                self.body.faces.push(face);
            }
            return Ok(());
        }
        if left == 0 {
            return Err(fields.defect("shells refer to shells too often"));
        }
        fields.skip("its faces")?;
        let shell = fields.id("its shell")?;
        let is_turned = is_turned == fields.logical("its orientation")?;
        self.shell(shell, is_turned, left - 1)
    }

    fn face(&mut self, id: u64, is_turned: bool) -> Result<Face, ReadError> {
        let mut fields = self
            .exchange
            .fields(id, &["ADVANCED_FACE", "FACE_SURFACE"])?;
        let keyword = fields.keyword();
        fields.skip("its name")?;
        let bounds = fields.ids("its bounds")?;
        let surface = self.carriers.surface(fields.id("its surface")?, DEEPEST)?;
        let same_sense = fields.logical("its sense")? != is_turned;
        let mut loops = Vec::new();
        for bound in bounds {
            if let Some(mut border) = self.bound(bound)? {
                if is_turned {
                    turn(&mut border);
                }
                loops.push(border);
            }
        }
        Ok(Face {
            name: format!("{} (#{id})", short(keyword)),
            surface,
            same_sense,
            loops,
        })
    }

    /// A loop; `None` where it is a single point, as of a sphere.
    fn bound(&mut self, id: u64) -> Result<Option<Vec<EdgeUse>>, ReadError> {
        let mut fields = self.named(id, &["FACE_BOUND", "FACE_OUTER_BOUND"])?;
        let border = fields.id("its loop")?;
        let is_ahead = fields.logical("its orientation")?;
        let mut fields = self.named(border, &["EDGE_LOOP", "VERTEX_LOOP"])?;
        if fields.keyword() == "VERTEX_LOOP" {
            return Ok(None);
        }
        let mut uses = Vec::new();
        for oriented in fields.ids("its edges")? {
            let mut oriented = self.named(oriented, &["ORIENTED_EDGE"])?;
            oriented.skip("its start")?;
            oriented.skip("its end")?;
            let edge = self.edge(oriented.id("its edge")?)?;
            let is_reversed = !oriented.logical("its orientation")?;
            uses.push(EdgeUse { edge, is_reversed });
        }
        if !is_ahead {
            turn(&mut uses);
        }
        Ok(Some(uses))
    }

    fn edge(&mut self, id: u64) -> Result<usize, ReadError> {
        if let Some(&index) = self.edges.get(&id) {
            return Ok(index);
        }
        let mut fields = self.named(id, &["EDGE_CURVE"])?;
        let start = self.vertex(fields.id("its start")?)?;
        let end = self.vertex(fields.id("its end")?)?;
        let curve = self.carriers.curve(fields.id("its curve")?, DEEPEST)?;
        self.body.edges.push(Edge {
            vertices: [start, end],
            curve,
            same_sense: fields.logical("its sense")?,
        });
        let index = self.body.edges.len() - 1;
        self.edges.insert(id, index);
        Ok(index)
    }

    fn vertex(&mut self, id: u64) -> Result<usize, ReadError> {
        if let Some(&index) = self.vertices.get(&id) {
            return Ok(index);
        }
        let mut fields = self.named(id, &["VERTEX_POINT"])?;
        let point = self.carriers.point(fields.id("its point")?)?;
        self.body.vertices_mm.push(point);
        let index = self.body.vertices_mm.len() - 1;
        self.vertices.insert(id, index);
        Ok(index)
    }
}

/// A loop run the other way.
fn turn(uses: &mut [EdgeUse]) {
    uses.reverse();
    uses.iter_mut()
        .for_each(|use_| use_.is_reversed = !use_.is_reversed);
}
