//! A scan with what is known of it before anything is measured.

use range_image::Column;

use crate::field::Field;
use crate::frame::Frame;
use crate::levels::Levels;
use crate::ray::ray;
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

/// Most missing rays in a row that are looked at.
const MOST_MISSING: f64 = 400.0;
/// Rays beyond the first and the last of the scan.
const BEYOND: f64 = 4.0;

/// Scans by formula have no noise, and distances are told in it: it is taken for so much at least,
/// millimetres.
const LEAST_NOISE_MM: f64 = 1e-3;

impl Sight<'_> {
    /// Standard deviation of samples along their rays, millimetres; never zero.
    pub(crate) fn sigma_mm(&self) -> f64 {
        self.field.noise_mm.max(LEAST_NOISE_MM)
    }

    /// The rays of a column that came back with something, and z of what they met, in order.
    pub(crate) fn rays_of(&self, column: &Column) -> Vec<(f64, f64)> {
        let samples = column.samples().iter();
        let mut rays: Vec<(f64, f64)> = samples
            .map(|s| (ray(self.camera_mm, s.y_mm, s.z_mm), s.z_mm))
            .collect();
        rays.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        rays
    }

    /// Tells rays that came back with nothing, between those that did and at both ends of the column,
    /// each with z of what lies beside it.
    pub(crate) fn missing_rays(&self, rays: &[(f64, f64)], mut told: impl FnMut(f64, f64)) {
        let step = self.field.ray_step;
        let [first, last] = self.field.rays;
        let beyond = BEYOND * step;
        let mut before = (first - beyond, f64::NEG_INFINITY);
        let ends = [(last + beyond, f64::NEG_INFINITY)];
        for &(at, z_mm) in rays.iter().chain(&ends) {
            let gaps = ((at - before.0) / step).round();
            let apart = (at - before.0) / gaps.max(1.0);
            if (2.0..=MOST_MISSING).contains(&gaps) {
                let near = before.1.max(z_mm);
                let near = if near.is_finite() {
                    near
                } else {
                    self.field.middle_z_mm
                };
                for k in 1..gaps as usize {
                    told(before.0 + apart * k as f64, near);
                }
            }
            before = (at, z_mm);
        }
    }

    /// The samples that are borne out, in the plan, of the nodes whose region is asked for and that
    /// have none of another beside them.
    pub(crate) fn samples(&self, is_wanted: &dyn Fn(u16) -> bool) -> Vec<[f64; 3]> {
        let labels = &self.regions.labels;
        let is_inner: Vec<bool> = (0..labels.len())
            .map(|node| {
                let mut beside = self.regions.neighbours(node);
                is_wanted(labels[node]) && beside.all(|other| is_wanted(labels[other]))
            })
            .collect();
        self.samples_at(&|node| is_inner[node])
    }

    /// The samples that are borne out, in the plan, of the nodes whose level is asked for.
    pub(crate) fn samples_of_levels(&self, is_wanted: &dyn Fn(u16) -> bool) -> Vec<[f64; 3]> {
        self.samples_at(&|node| is_wanted(self.levels.labels[node]))
    }

    fn samples_at(&self, is_wanted: &dyn Fn(usize) -> bool) -> Vec<[f64; 3]> {
        let image = &self.field.image;
        let mut found = Vec::new();
        for (column, kept) in self.columns.iter().zip(&self.field.supported) {
            for (sample, _) in column.samples().iter().zip(kept).filter(|(_, k)| **k) {
                let node = self.regions.node(image, column.x_mm(), sample.y_mm);
                if node.is_some_and(is_wanted) {
                    let point = nalgebra::Vector3::new(column.x_mm(), sample.y_mm, sample.z_mm);
                    found.push(self.frame.local(point));
                }
            }
        }
        found
    }
}
