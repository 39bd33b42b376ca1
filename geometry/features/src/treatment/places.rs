//! What is seen of a treated edge: samples on both sides of the wall, and rays that passed it.

use nalgebra::Vector3;

use crate::plane::Plane;
use crate::ray::{passes, ray};
use crate::sight::Sight;

/// A sample, or a ray that came back with nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// Where it is in the plan, millimetres.
    pub(super) at: [f64; 2],
    /// How its ray moves in the plan for each millimetre towards the face.
    pub(super) tilt: [f64; 2],
    /// Height off the face, millimetres; infinite of a ray that came back with nothing, which is
    /// where it passes the face's height.
    pub(super) height_mm: f64,
}

impl Place {
    /// Where it is as to a wall that ends at a height off the face: what lies deeper passed it there.
    pub(super) fn beside(&self, rise_mm: f64) -> [f64; 2] {
        let up = if self.height_mm.is_finite() {
            (self.height_mm - rise_mm).max(0.0)
        } else {
            -rise_mm
        };
        [
            self.at[0] + up * self.tilt[0],
            self.at[1] + up * self.tilt[1],
        ]
    }
}

/// The face that heights are off: downwards of what falls from it, upwards of what rises.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    pub(super) plane: Plane,
    pub(super) falls: bool,
}

impl Face {
    fn height_mm(&self, sight: &Sight<'_>, at: &Vector3<f64>) -> f64 {
        let off = (at.z - self.plane.z_mm(at.x, at.y)) * sight.frame.axes[2].z;
        if self.falls { -off } else { off }
    }

    /// The samples of levels where they are wanted.
    pub(super) fn samples(
        &self,
        sight: &Sight<'_>,
        is_level: &dyn Fn(u16) -> bool,
        is_wanted: &dyn Fn([f64; 2]) -> bool,
    ) -> Vec<Place> {
        sight
            .samples_of_levels(is_level)
            .into_iter()
            .filter(|[u, v, _]| is_wanted([*u, *v]))
            .map(|local| {
                let world = sight.frame.world(local);
                let own = ray(sight.camera_mm, world.y, world.z);
                Place {
                    at: [local[0], local[1]],
                    tilt: self.tilt(sight, world.x, own, world.z),
                    height_mm: self.height_mm(sight, &world),
                }
            })
            .collect()
    }

    /// What rises hides nothing beyond its wall.
    fn tilt(&self, sight: &Sight<'_>, x_mm: f64, own: f64, z_mm: f64) -> [f64; 2] {
        if !self.falls {
            return [0.0; 2];
        }
        let at = |z_mm: f64| {
            let y_mm = passes(sight.camera_mm, own, z_mm);
            sight.frame.local(Vector3::new(x_mm, y_mm, z_mm))
        };
        let ([u0, v0, w0], [u1, v1, w1]) = (at(z_mm), at(z_mm + 1.0));
        [(u1 - u0) / (w1 - w0), (v1 - v0) / (w1 - w0)]
    }

    /// Rays that came back with nothing from where they are wanted; of what rises, none.
    pub(super) fn missing(
        &self,
        sight: &Sight<'_>,
        is_level: &dyn Fn(u16) -> bool,
        is_wanted: &dyn Fn([f64; 2]) -> bool,
    ) -> Vec<Place> {
        let mut found = Vec::new();
        if !self.falls {
            return found;
        }
        let image = &sight.field.image;
        for column in sight.columns {
            let x_mm = column.x_mm();
            sight.missing_rays(&sight.rays_of(column), |own, near_mm| {
                let guess = passes(sight.camera_mm, own, near_mm);
                let z_mm = self.plane.z_mm(x_mm, guess);
                let y_mm = passes(sight.camera_mm, own, z_mm);
                let [u, v, _] = sight.frame.local(Vector3::new(x_mm, y_mm, z_mm));
                if !is_wanted([u, v]) {
                    return;
                }
                let node = sight.regions.node(image, x_mm, y_mm);
                if node.is_some_and(|node| is_level(sight.levels.labels[node])) {
                    found.push(Place {
                        at: [u, v],
                        tilt: self.tilt(sight, x_mm, own, z_mm),
                        height_mm: f64::INFINITY,
                    });
                }
            });
        }
        found
    }
}
