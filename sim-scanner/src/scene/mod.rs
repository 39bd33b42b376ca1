//! What the laser meets: the object, and what stands around it.

pub mod artefacts;
pub mod benches;
mod exact;
pub mod figures;
mod mesh;
mod solid;
mod stain;

pub use benches::{cylinder_on_table, house_before_plane, house_on_table};
pub use exact::FaceSurface;
pub use figures::{cylinder, figure, groove, house};
pub use mesh::{Mesh, MeshFace, StlError, TRIANGLES_MAX};
pub use solid::{ConvexSolid, Surface};
pub use stain::Stain;

use crate::Vec3;

/// How a surface sends light back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Share of the light sent back at normal incidence, 0 to 1.
    pub albedo: f64,
    /// 0 for chalk or plaster, 1 for polished metal: how fast the return fades with incidence.
    pub gloss: f64,
}

impl Material {
    /// Plaster: nearly no mirror reflection.
    pub const PLASTER: Self = Self {
        albedo: 0.8,
        gloss: 0.05,
    };
    /// Drawing paper: a slight sheen.
    pub const PAPER: Self = Self {
        albedo: 0.85,
        gloss: 0.25,
    };
}

/// One body of a scene.
#[derive(Debug, Clone)]
pub enum Body {
    /// A convex solid with closed-form intersections.
    Solid(ConvexSolid),
    /// A triangle mesh.
    Mesh(Box<Mesh>),
}

/// Names a face of a scene: the body's index and the face's within the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FaceId {
    /// Index into [`Scene::bodies`].
    pub body: usize,
    /// Index into the solid's faces, or the mesh's face group.
    pub face: usize,
}

/// Where a ray first meets the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray, millimetres.
    pub distance_mm: f64,
    /// The point met, part frame, millimetres.
    pub point_mm: Vec3,
    /// Unit normal, out of the body.
    pub normal: Vec3,
    /// What was met.
    pub face: FaceId,
}

/// Bodies and what they are made of. The object comes first; the rest is background.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The bodies; those before [`Scene::object_bodies`] make up the object.
    pub bodies: Vec<(Body, Material)>,
    /// How many of the bodies are the object; truth is told of these alone.
    pub object_bodies: usize,
    /// Lower and upper corner of what a proposed scan takes in, if more than the object.
    pub view_mm: Option<(Vec3, Vec3)>,
    /// Middle of the measuring volume, where the scanner is set up; without one it is set up
    /// before the middle of the object.
    pub middle_mm: Option<Vec3>,
    /// Patches of the object that swallow light.
    pub stains: Vec<Stain>,
}

impl Scene {
    /// A scene of an object alone.
    #[must_use]
    pub fn new(object: Vec<Body>, material: Material) -> Self {
        Self {
            object_bodies: object.len(),
            bodies: object.into_iter().map(|body| (body, material)).collect(),
            view_mm: None,
            middle_mm: None,
            stains: Vec::new(),
        }
    }

    /// Adds a table plane below the object: the half-space y <= `y_mm`.
    #[must_use]
    pub fn with_table_plane(self, y_mm: f64, material: Material) -> Self {
        self.with_half_space(Vec3::Y, y_mm, material)
    }

    /// Adds a plane behind the object: the half-space z <= `z_mm`.
    #[must_use]
    pub fn with_back_plane(self, z_mm: f64, material: Material) -> Self {
        self.with_half_space(Vec3::Z, z_mm, material)
    }

    /// States the box that a proposed scan takes in; the object is always in it.
    #[must_use]
    pub fn with_view_mm(mut self, low: Vec3, high: Vec3) -> Self {
        self.view_mm = Some((low, high));
        self
    }

    /// States where the middle of the scanner's measuring volume is.
    #[must_use]
    pub fn with_middle_mm(mut self, middle: Vec3) -> Self {
        self.middle_mm = Some(middle);
        self
    }

    /// Stains the object; its surroundings stay clean.
    #[must_use]
    pub fn with_stains(mut self, stains: Vec<Stain>) -> Self {
        self.stains = stains;
        self
    }

    /// Probability that a stain swallows the light of a spot there: of several the strongest.
    #[must_use]
    pub fn stained(&self, hit: &Hit) -> f64 {
        if hit.face.body >= self.object_bodies {
            return 0.0;
        }
        self.stains
            .iter()
            .map(|stain| stain.loss_at(hit.point_mm))
            .fold(0.0, f64::max)
    }

    fn with_half_space(mut self, normal: Vec3, offset_mm: f64, material: Material) -> Self {
        let solid = ConvexSolid::new(vec![Surface::Plane { normal, offset_mm }]);
        self.bodies.push((Body::Solid(solid), material));
        self
    }

    /// The first body that a ray meets.
    ///
    /// `direction` is of unit length. A ray that starts inside a body meets that body's far
    /// side never: only entries count, since light does not come out of a solid.
    #[must_use]
    pub fn cast(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        for (index, (body, _)) in self.bodies.iter().enumerate() {
            let met = match body {
                Body::Solid(solid) => solid.enter(origin, direction),
                Body::Mesh(mesh) => mesh.enter(origin, direction),
            };
            let Some((distance_mm, normal, face)) = met else {
                continue;
            };
            if nearest.is_none_or(|hit| distance_mm < hit.distance_mm) {
                nearest = Some(Hit {
                    distance_mm,
                    point_mm: origin + direction * distance_mm,
                    normal,
                    face: FaceId { body: index, face },
                });
            }
        }
        nearest
    }

    /// Whether nothing stands between a surface point and a viewer.
    ///
    /// `normal` is the surface's own: a viewer behind the tangent plane sees nothing.
    #[must_use]
    pub fn sees(&self, point_mm: Vec3, normal: Vec3, viewer_mm: Vec3) -> bool {
        /// The ray starts this far off the surface, so as not to meet its own start.
        const LIFT_MM: f64 = 1e-6;
        let towards = viewer_mm - point_mm;
        let distance_mm = towards.length();
        if distance_mm <= LIFT_MM {
            return true;
        }
        let direction = towards / distance_mm;
        if normal.dot(direction) <= 0.0 {
            return false;
        }
        self.cast(point_mm + normal * LIFT_MM, direction)
            .is_none_or(|hit| hit.distance_mm >= distance_mm)
    }

    /// What a body is made of.
    #[must_use]
    pub fn material(&self, face: FaceId) -> Material {
        self.bodies
            .get(face.body)
            .map_or(Material::PLASTER, |(_, material)| *material)
    }

    /// Lower and upper corner of what a proposed scan takes in, millimetres.
    #[must_use]
    pub fn view_extent_mm(&self) -> (Vec3, Vec3) {
        let (low, high) = self.object_extent_mm();
        self.view_mm
            .map_or((low, high), |(l, h)| (low.min(l), high.max(h)))
    }

    /// Lower and upper corner of the box around the object, millimetres.
    #[must_use]
    pub fn object_extent_mm(&self) -> (Vec3, Vec3) {
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        self.bodies
            .iter()
            .take(self.object_bodies)
            .map(|(body, _)| match body {
                Body::Solid(solid) => solid.extent_mm(),
                Body::Mesh(mesh) => mesh.extent_mm(),
            })
            .fold(none, |(low, high), (l, h)| (low.min(l), high.max(h)))
    }
}
