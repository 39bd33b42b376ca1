//! A part and what it really is, as `tests/judges/parts` writes them.

use std::fmt;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use nalgebra::Vector3;
use relief_tests::stl::triangles;
use serde::Deserialize;
use shapes::Family;
use sim_scanner::scene::{Body, Material, Mesh, MeshFace, Scene};

use crate::surface::TrueSurface;

/// What a face is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Kind {
    Of(Family),
    /// An extrusion or a revolution; none of the parts has one that is no simpler.
    Swept,
    FreeForm,
}

impl Kind {
    pub(crate) const ALL: [Self; 7] = [
        Self::Of(Family::Plane),
        Self::Of(Family::Cylinder),
        Self::Of(Family::Cone),
        Self::Of(Family::Sphere),
        Self::Of(Family::Torus),
        Self::Swept,
        Self::FreeForm,
    ];
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Of(family) => family.as_str(),
            Self::Swept => "swept",
            Self::FreeForm => "free-form",
        })
    }
}

/// A part.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    pub(crate) seed: u64,
    /// What it was made from and what was added, in words.
    pub(crate) name: String,
    /// Of each face its surface, `None` for a free form.
    pub(crate) faces: Vec<Option<TrueSurface>>,
    pub(crate) edges: Vec<TrueEdge>,
    /// The part before the scanner.
    pub(crate) scene: Scene,
}

/// An edge that two faces share.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct TrueEdge {
    pub(crate) faces: [usize; 2],
    /// The faces have one tangent plane all along.
    pub(crate) is_smooth: bool,
    pub(crate) points_mm: Vec<[f64; 3]>,
}

impl TrueEdge {
    /// Whether it is of these two faces and passes so near beside a place, and above or below it.
    pub(crate) fn joins(
        &self,
        faces: [usize; 2],
        place: &Vector3<f64>,
        (beside_mm, above_mm): (f64, f64),
    ) -> bool {
        let is_of = self.faces == faces || self.faces == [faces[1], faces[0]];
        let mut points = self.points_mm.iter().map(|p| Vector3::from(*p));
        let is_near = |off: Vector3<f64>| off.xy().norm() <= beside_mm && off.z.abs() <= above_mm;
        is_of && points.any(|point| is_near(point - place))
    }
}

impl Part {
    pub(crate) fn kind(&self, face: usize) -> Kind {
        let surface = self.faces.get(face).copied().flatten();
        surface.map_or(Kind::FreeForm, |surface| Kind::Of(surface.family))
    }

    /// Whether a face joins one of these smoothly.
    pub(crate) fn joins(&self, face: usize, others: &[usize]) -> bool {
        let smooth = self.edges.iter().filter(|edge| edge.is_smooth);
        let mut pairs = smooth.map(|edge| edge.faces);
        pairs.any(|[a, b]| (a == face && others.contains(&b)) || (b == face && others.contains(&a)))
    }

    /// Reads the part of a seed from the folder of parts.
    pub(crate) fn read(folder: &Path, seed: u64) -> Result<Self> {
        let told = folder.join(format!("{seed}.json"));
        let text = fs::read_to_string(&told).with_context(|| told.display().to_string())?;
        let told: Told = serde_json::from_str(&text).with_context(|| told.display().to_string())?;
        ensure!(told.seed == seed, "it is the part of seed {}", told.seed);
        let stl = folder.join(format!("{seed}.stl"));
        let bytes = fs::read(&stl).with_context(|| stl.display().to_string())?;
        let triangles = triangles(&bytes).with_context(|| stl.display().to_string())?;
        let (mut faces, mut meshes) = (Vec::new(), Vec::new());
        for face in &told.faces {
            let surface = face.surface()?;
            let own = face.first_triangle..face.first_triangle + face.triangles;
            let own = triangles.get(own).context("a face has no triangles")?;
            meshes.push(MeshFace {
                triangles_mm: own.to_vec(),
                surface: surface.map(|surface| surface.of_scene()),
            });
            faces.push(surface);
        }
        let mesh = Mesh::of_faces(&meshes)?;
        let scene = Scene::new(vec![Body::Mesh(Box::new(mesh))], Material::PAPER);
        Ok(Self {
            seed,
            name: format!("{}: {}", told.name, told.features.join(", ")),
            faces,
            edges: told.edges,
            scene,
        })
    }
}

#[derive(Debug, Deserialize)]
struct Told {
    seed: u64,
    name: String,
    features: Vec<String>,
    faces: Vec<ToldFace>,
    edges: Vec<TrueEdge>,
}

#[derive(Debug, Deserialize)]
struct ToldFace {
    kind: String,
    #[serde(default)]
    point_mm: [f64; 3],
    #[serde(default)]
    direction: Option<[f64; 3]>,
    #[serde(default)]
    radius_mm: f64,
    #[serde(default)]
    tube_mm: f64,
    #[serde(default)]
    half_angle_rad: f64,
    first_triangle: usize,
    triangles: usize,
}

impl ToldFace {
    fn surface(&self) -> Result<Option<TrueSurface>> {
        if self.kind == Kind::FreeForm.to_string() {
            return Ok(None);
        }
        let Some(family) = Family::ALL.into_iter().find(|f| f.as_str() == self.kind) else {
            bail!("no kind of surface is called {}", self.kind);
        };
        let direction = self.direction.map_or_else(Vector3::z, Vector3::from);
        Ok(Some(TrueSurface {
            family,
            place_mm: Vector3::from(self.point_mm),
            direction: direction
                .try_normalize(f64::MIN_POSITIVE)
                .context("a direction without one")?,
            radius_mm: self.radius_mm,
            tube_mm: self.tube_mm,
            half_angle_rad: self.half_angle_rad,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_that_is_none_is_refused() {
        let face = |kind: &str| ToldFace {
            kind: kind.into(),
            point_mm: [0.0; 3],
            direction: Some([0.0, 0.0, 2.0]),
            radius_mm: 1.0,
            tube_mm: 0.0,
            half_angle_rad: 0.0,
            first_triangle: 0,
            triangles: 0,
        };
        assert!(face("hyperboloid").surface().is_err());
        assert_eq!(face("free-form").surface().unwrap(), None);
        let cylinder = face("cylinder").surface().unwrap().unwrap();
        assert_eq!(
            (cylinder.family, cylinder.direction.z),
            (Family::Cylinder, 1.0)
        );
    }
}
