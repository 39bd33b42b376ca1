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
    /// Of a checked model.
    pub(crate) fn of(model: &Model, sharing: Sharing) -> Self {
        let faces = model.faces.iter();
        let carriers: Vec<Carrier> = faces
            .map(|face| Carrier::of(face, sharing.sharing_mm))
            .collect();
        let shapes: Vec<_> = carriers.iter().map(Carrier::shape).collect();
        Self {
            topology: topology::topology(model, &shapes, sharing),
            carriers,
        }
    }
}
