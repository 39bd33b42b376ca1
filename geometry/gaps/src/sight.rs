//! What is looked at, and from where.

use std::collections::BTreeMap;

use glam::DVec3;
use range_image::RangeImage;

use crate::carry::Given;
use crate::find::{Grid, Place};

/// What is looked at.
#[derive(Debug, Clone, Copy)]
pub struct Sight<'a> {
    /// The range image, without background.
    pub image: &'a RangeImage,
    /// The range image as measured, of the same nodes.
    pub measured: &'a RangeImage,
    /// Where in a column's plane its rays come from, y and z in millimetres, if that is known; they
    /// run along z otherwise.
    pub camera_mm: Option<[f64; 2]>,
    /// Heights that differ by more are a step, millimetres.
    pub step_mm: f64,
    /// Standard deviation of z of single samples, millimetres.
    pub noise_mm: f64,
}

impl Sight<'_> {
    pub(crate) fn grid(&self) -> Grid {
        Grid {
            columns: self.image.columns(),
            rows: self.image.rows(),
        }
    }

    /// The place of a node that has a value.
    pub(crate) fn point(&self, node: usize) -> Option<DVec3> {
        let (column, row) = self.grid().place(node);
        let z_mm = self.image.z_mm(column, row)?;
        Some(DVec3::new(
            self.image.x_mm(column),
            self.image.y_mm(row),
            z_mm,
        ))
    }

    /// Mean place of nodes of a gap: at the heights given to them, or at those beside the gap.
    pub(crate) fn centre_mm(
        &self,
        nodes: &[usize],
        given: Option<&BTreeMap<usize, Given>>,
        place: &Place,
    ) -> [f64; 3] {
        let mut sum = DVec3::ZERO;
        let beside = place.beside.values().flatten();
        let heights: Vec<f64> = beside
            .filter_map(|node| Some(self.point(*node)?.z))
            .collect();
        let mean_mm = heights.iter().sum::<f64>() / (heights.len().max(1)) as f64;
        for node in nodes {
            let (column, row) = self.grid().place(*node);
            let own = given.and_then(|given| given.get(node));
            let z_mm = own.map_or(mean_mm, |own| own.z_mm);
            sum += DVec3::new(self.image.x_mm(column), self.image.y_mm(row), z_mm);
        }
        (sum / nodes.len().max(1) as f64).to_array()
    }

    /// A ray's place in its column: the tangent of its angle, or y where rays are parallel.
    pub(crate) fn ray(&self, y_mm: f64, z_mm: f64) -> f64 {
        match self.camera_mm {
            Some([y, z]) => (y_mm - y) / (z - z_mm),
            None => y_mm,
        }
    }

    /// y of a ray at a height, millimetres.
    pub(crate) fn passes(&self, ray: f64, z_mm: f64) -> f64 {
        match self.camera_mm {
            Some([y, z]) => y + ray * (z - z_mm),
            None => ray,
        }
    }
}
