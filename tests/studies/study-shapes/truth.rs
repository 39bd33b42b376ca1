//! What the faces of a scene really are.

use relief_tests::scenes::Drawn;
use relief_tests::scenes::truth::Region;
use shapes::Family;
use sim_scanner::Vec3;
use sim_scanner::scanner::Scanner;
use sim_scanner::scene::{Body, Surface};
use sim_scanner::truth::graph_node;

/// What a region of a scene really is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Real {
    /// A surface with numbers.
    Surface(Surface),
    /// A mesh: a torus or a free form.
    Mesh,
    /// Faces that meet smoothly and are one region.
    Several,
}

impl Real {
    pub(crate) fn of(drawn: &Drawn, scanner: &Scanner, region: &Region) -> Self {
        let body = drawn.scene.bodies.get(region.face.body);
        let surface = match body {
            Some((Body::Solid(solid), _)) => solid.faces().get(region.face.face).copied(),
            _ => None,
        };
        let Some(surface) = surface else {
            return Self::Mesh;
        };
        /// Rounding of points that lie on it.
        const ON_IT_MM: f64 = 1e-6;
        let on_it = |point: &Vec3| surface.signed_distance_mm(*point).abs() < ON_IT_MM;
        if points(drawn, scanner, region.label).all(|point| on_it(&point)) {
            Self::Surface(surface)
        } else {
            Self::Several
        }
    }

    /// The family that should be found; `None` where several would be right.
    pub(crate) fn family(&self) -> Option<Family> {
        match self {
            Self::Surface(Surface::Plane { .. }) => Some(Family::Plane),
            Self::Surface(Surface::Cylinder { .. }) => Some(Family::Cylinder),
            Self::Surface(Surface::Sphere { .. }) => Some(Family::Sphere),
            Self::Surface(Surface::Cone { .. }) => Some(Family::Cone),
            Self::Mesh | Self::Several => None,
        }
    }

    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Several => "several",
            Self::Surface(_) => self.family().map_or("?", Family::as_str),
        }
    }
}

/// The true points over the nodes of a region.
fn points<'a>(
    drawn: &'a Drawn,
    scanner: &'a Scanner,
    label: u16,
) -> impl Iterator<Item = Vec3> + 'a {
    let truth = &drawn.truth;
    let nodes = truth.labels.iter().enumerate();
    nodes
        .filter(move |(_, own)| **own == label)
        .filter_map(move |(index, _)| {
            let (column, row) = (index / truth.rows, index % truth.rows);
            let x = truth.lattice.line_mm(truth.i_first + column as i64);
            let y = truth.lattice.line_mm(truth.j_first + row as i64);
            Some(Vec3::new(x, y, graph_node(scanner, x, y)?.z_mm))
        })
}
