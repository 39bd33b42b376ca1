//! A part before the scanner, as `tests/judges/features` writes it: STL triangles by face, and the
//! conditions of its scan. The truth about its features stays in the file; the judge reads it.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use relief_tests::stl::triangles;
use serde::Deserialize;
use sim_scanner::Vec3;
use sim_scanner::scene::{Body, FaceSurface, Material, Mesh, MeshFace, Scene, Stain, Surface};

/// How a part is scanned.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Conditions {
    /// Seed of the scanner's noise.
    pub(crate) seed: u64,
    /// Distance of columns, and of samples in them at the part's middle, millimetres.
    pub(crate) pitch_mm: f64,
    pub(crate) noise_mm: f64,
    pub(crate) outliers: f64,
    pub(crate) mixed: f64,
    pub(crate) dropouts: f64,
    /// Gloss: see [`sim_scanner::noise::NoiseModel::glare`].
    #[serde(default)]
    pub(crate) glare: f64,
    #[serde(default)]
    pub(crate) glare_width_deg: f64,
    #[serde(default)]
    pub(crate) stains: Vec<ToldStain>,
    /// Distance of the laser from the part's middle, and of the sensor from the laser along y,
    /// millimetres; those of the preset unless told.
    #[serde(default)]
    pub(crate) standoff_mm: Option<f64>,
    #[serde(default)]
    pub(crate) baseline_mm: Option<f64>,
    pub(crate) spot_radius_mm: f64,
    /// Height of the table that the part lies on, where it is seen.
    pub(crate) table_z_mm: Option<f64>,
    /// Lower and upper corner of the box that the scan covers.
    pub(crate) view_mm: [[f64; 3]; 2],
    /// Samples outside of it are not taken: lower and upper x and y.
    pub(crate) window_mm: Option<[[f64; 2]; 2]>,
}

/// A patch that swallows light: see [`Stain`].
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct ToldStain {
    centre_mm: [f64; 2],
    radius_mm: f64,
    rim_mm: f64,
    loss: f64,
}

impl ToldStain {
    fn stain(&self) -> Stain {
        Stain {
            centre_mm: self.centre_mm.into(),
            radius_mm: self.radius_mm,
            rim_mm: self.rim_mm,
            loss: self.loss,
        }
    }
}

#[derive(Debug, Deserialize)]
struct Told {
    scan: Conditions,
    faces: Vec<ToldFace>,
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
    /// What rays meet; `None` for a free form, whose triangles they meet.
    fn surface(&self) -> Result<Option<FaceSurface>> {
        let point_mm = Vec3::from_array(self.point_mm);
        let axis = self.direction.map_or(Vec3::Z, Vec3::from_array);
        let axis = axis.try_normalize().context("a direction without one")?;
        let surface = match self.kind.as_str() {
            "plane" => Surface::Plane {
                normal: axis,
                offset_mm: axis.dot(point_mm),
            },
            "cylinder" => Surface::Cylinder {
                base_mm: point_mm,
                axis,
                radius_mm: self.radius_mm,
            },
            "cone" => Surface::Cone {
                apex_mm: point_mm,
                axis,
                half_angle_rad: self.half_angle_rad,
            },
            "sphere" => Surface::Sphere {
                centre_mm: point_mm,
                radius_mm: self.radius_mm,
            },
            "torus" => {
                return Ok(Some(FaceSurface::Torus {
                    centre_mm: point_mm,
                    axis,
                    radius_mm: self.radius_mm,
                    tube_mm: self.tube_mm,
                }));
            }
            "free-form" => return Ok(None),
            other => anyhow::bail!("no kind of surface is called {other}"),
        };
        Ok(Some(FaceSurface::Surface(surface)))
    }
}

/// Reads a part: its scene, and how it is scanned.
pub(crate) fn read(folder: &Path, name: &str) -> Result<(Scene, usize, Conditions)> {
    let told = folder.join(format!("{name}.json"));
    let text = fs::read_to_string(&told).with_context(|| told.display().to_string())?;
    let told: Told = serde_json::from_str(&text).with_context(|| told.display().to_string())?;
    let stl = folder.join(format!("{name}.stl"));
    let bytes = fs::read(&stl).with_context(|| stl.display().to_string())?;
    let triangles = triangles(&bytes).with_context(|| stl.display().to_string())?;
    let mut meshes = Vec::new();
    for face in &told.faces {
        let own = face.first_triangle..face.first_triangle + face.triangles;
        let own = triangles.get(own).context("a face has no triangles")?;
        meshes.push(MeshFace {
            triangles_mm: own.to_vec(),
            surface: face.surface()?,
        });
    }
    let mesh = Mesh::of_faces(&meshes)?;
    let mut scene = Scene::new(vec![Body::Mesh(Box::new(mesh))], Material::PAPER);
    if let Some(z_mm) = told.scan.table_z_mm {
        scene = scene.with_back_plane(z_mm, Material::PAPER);
    }
    let stains = told.scan.stains.iter().map(ToldStain::stain).collect();
    let scene = scene.with_stains(stains);
    let [low, high] = told.scan.view_mm;
    let scene = scene.with_view_mm(Vec3::from_array(low), Vec3::from_array(high));
    Ok((scene, told.faces.len(), told.scan))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_are_those_of_their_names() {
        let face = |kind: &str| ToldFace {
            kind: kind.into(),
            point_mm: [0.0, 0.0, 3.0],
            direction: Some([0.0, 0.0, 2.0]),
            radius_mm: 1.0,
            tube_mm: 0.0,
            half_angle_rad: 0.0,
            first_triangle: 0,
            triangles: 0,
        };
        let plane = face("plane").surface().unwrap().unwrap();
        assert!((plane.signed_distance_mm(Vec3::new(7.0, 8.0, 5.0)) - 2.0).abs() < 1e-12);
        assert!(face("free-form").surface().unwrap().is_none());
        assert!(face("hyperboloid").surface().is_err());
    }
}
