//! A scan with what is known of it before anything is measured.

use range_image::Column;

use crate::field::Field;
use crate::frame::Frame;
use crate::levels::Levels;
use crate::regions::Regions;

/// What is looked at.
#[derive(Debug, Clone, Copy)]
pub struct Sight<'a> {
    /// The columns of the field.
    pub columns: &'a [Column],
    /// Where rays come from in their own planes, y and z in millimetres, if that is known.
    pub camera_mm: Option<[f64; 2]>,
    /// The field.
    pub field: &'a Field,
    /// Its regions.
    pub regions: &'a Regions,
    /// Their levels.
    pub levels: &'a Levels,
    /// The plan.
    pub frame: &'a Frame,
}

impl Sight<'_> {
    /// The samples that are borne out, in the plan, of the nodes whose region is asked for and that
    /// have none of another beside them.
    pub(crate) fn samples(&self, is_wanted: &dyn Fn(u16) -> bool) -> Vec<[f64; 3]> {
        let image = &self.field.image;
        let labels = &self.regions.labels;
        let is_inner: Vec<bool> = (0..labels.len())
            .map(|node| {
                let mut beside = self.regions.neighbours(node);
                is_wanted(labels[node]) && beside.all(|other| is_wanted(labels[other]))
            })
            .collect();
        let mut found = Vec::new();
        for (column, kept) in self.columns.iter().zip(&self.field.supported) {
            for (sample, _) in column.samples().iter().zip(kept).filter(|(_, k)| **k) {
                let node = self.regions.node(image, column.x_mm(), sample.y_mm);
                if node.is_some_and(|node| is_inner[node]) {
                    let point = nalgebra::Vector3::new(column.x_mm(), sample.y_mm, sample.z_mm);
                    found.push(self.frame.local(point));
                }
            }
        }
        found
    }
}
