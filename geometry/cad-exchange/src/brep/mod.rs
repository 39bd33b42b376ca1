//! A model as formats of boundaries know it: what each face lies on, and the vertices and edges
//! that faces share.

mod analytic;
mod bend;
mod carrier;
mod corners;
mod groups;
mod onto;
mod seam;
mod topology;

use reconstruct::Model;

pub(crate) use analytic::Analytic;
pub(crate) use carrier::{Carrier, Flat};
pub(crate) use topology::{Strand, Topology, Use};

/// What a file asks of the edges that its faces share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sharing {
    /// A crease is one edge as far as the curves that its two faces make of it are as near as
    /// this; a face is written by its numbers if its edges lie as near to that.
    pub(crate) sharing_mm: f64,
    /// Kinks are rounded within half of this.
    pub(crate) resolution_mm: f64,
}

/// Faces, edges and vertices.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Brep {
    /// Of each face.
    pub(crate) carriers: Vec<Carrier>,
    pub(crate) topology: Topology,
}

impl Brep {
    /// Of a checked model, its faces by their numbers where they have some.
    pub(crate) fn by_numbers(model: &Model, sharing: Sharing) -> Self {
        let faces = model.faces.iter();
        let carriers = faces.map(|face| Carrier::of(face, sharing.sharing_mm));
        Self::on(model, carriers.collect(), sharing)
    }

    /// Of a checked model, each face on its own patches.
    pub(crate) fn of_splines(model: &Model, sharing: Sharing) -> Self {
        Self::on(model, vec![Carrier::Spline; model.faces.len()], sharing)
    }

    fn on(model: &Model, carriers: Vec<Carrier>, sharing: Sharing) -> Self {
        let shapes: Vec<_> = carriers.iter().map(Carrier::shape).collect();
        Self {
            topology: topology::topology(model, &shapes, sharing),
            carriers,
        }
    }
}
