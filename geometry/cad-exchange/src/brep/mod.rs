//! A model as formats of boundaries know it: what each face lies on, and the vertices and edges
//! that faces share.

mod analytic;
mod bend;
mod carrier;
mod corners;
mod groups;
mod meridian;
mod onto;
mod seam;
mod support;
mod swept;
mod topology;

use reconstruct::Model;

pub(crate) use analytic::Analytic;
pub(crate) use carrier::{Carrier, Flat};
use seam::most_off_mm;
pub(crate) use swept::{By, Generated};
pub(crate) use topology::{Strand, Topology, Use};

/// What a file asks of the edges that its faces share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sharing {
    /// A crease is one edge as far as the curves that its two faces make of it are as near as
    /// this, or, where the faces do not meet beside it, three times as far; a face is written by its
    /// numbers if its edges lie no farther off than such an edge may.
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
    /// Of a checked model, its faces by their numbers where they have some, and their edges can be
    /// put there.
    pub(crate) fn by_numbers(model: &Model, sharing: Sharing) -> Self {
        let mut carriers: Vec<Carrier> = model.faces.iter().map(Carrier::of).collect();
        loop {
            let mut brep = Self::on(model, carriers.clone(), sharing);
            let off_mm = &brep.topology.off_mm;
            let most_mm = most_off_mm(sharing.sharing_mm);
            let is_off = |face: &usize| off_mm[*face].is_nan() || off_mm[*face] > most_mm;
            let mut strays: Vec<usize> = (0..off_mm.len()).filter(is_off).collect();
            if strays.is_empty() {
                strays = meridian::cut_rings(&mut brep.topology, &mut brep.carriers);
            }
            if strays.is_empty() {
                return brep;
            }
            // Each round makes splines of some more.
            for face in strays {
                carriers[face] = Carrier::Spline;
            }
        }
    }

    /// Of a checked model, each face on its own patches.
    pub(crate) fn of_splines(model: &Model, sharing: Sharing) -> Self {
        Self::on(model, vec![Carrier::Spline; model.faces.len()], sharing)
    }

    fn on(model: &Model, carriers: Vec<Carrier>, sharing: Sharing) -> Self {
        let both = model.faces.iter().zip(&carriers);
        let supports: Vec<_> = both.map(|(face, carrier)| carrier.support(face)).collect();
        Self {
            topology: topology::topology(model, &supports, sharing),
            carriers,
        }
    }
}
