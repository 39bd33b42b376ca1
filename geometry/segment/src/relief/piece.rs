//! Pieces: sets of nodes that one plane or quadric explains.

use super::surface::Surface;
use crate::scene::{NONE, Scene};

/// The pieces of an image.
#[derive(Debug)]
pub(crate) struct Pieces {
    /// The piece of each node, or [`NONE`].
    pub(crate) labels: Vec<u32>,
    /// The surface of each piece by label; none for label [`NONE`] and for pieces given up.
    pub(crate) surfaces: Vec<Option<Surface>>,
}

impl Pieces {
    /// How far a node lies off a piece's surface, along z, in standard deviations of the noise;
    /// infinite where there is none.
    pub(crate) fn miss(&self, scene: &Scene<'_>, label: u32, node: usize) -> f64 {
        match self.surfaces.get(label as usize) {
            Some(Some(surface)) => surface.miss(scene, node),
            _ => f64::INFINITY,
        }
    }

    /// What a piece's roughness costs it where pieces compete, in squared noises: a surface
    /// that forgives more says less.
    pub(crate) fn doubt(&self, label: u32) -> f64 {
        match self.surfaces.get(label as usize) {
            Some(Some(surface)) => 2.0 * libm::log(surface.roughness),
            _ => 0.0,
        }
    }

    /// The nodes of each piece.
    pub(crate) fn members(&self) -> Vec<Vec<u32>> {
        let mut members = vec![Vec::new(); self.surfaces.len()];
        for (node, &label) in self.labels.iter().enumerate() {
            if label != NONE {
                members[label as usize].push(node as u32);
            }
        }
        members
    }

    /// Fits every piece's surface to its nodes anew.
    pub(crate) fn refit(&mut self, scene: &Scene<'_>) {
        let members = self.members();
        for (surface, nodes) in self.surfaces.iter_mut().zip(members) {
            let roughness = surface.as_ref().map_or(1.0, |s| s.roughness);
            *surface = Surface::fit(scene, &nodes, roughness);
        }
    }
}
