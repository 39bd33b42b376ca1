//! The whole road from faces to triangles.

use crate::chart::{Chart, prepare};
use crate::division::Division;
use crate::face::fill;
use crate::orient::oriented;
use crate::{Body, BodyError, Point};

/// How much finer edges are divided where they cross in a face, and how often that is tried.
const FINER: f64 = 0.25;
const ATTEMPTS: usize = 4;

/// How fine triangles are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacetSettings {
    /// How far triangles may lie from their surfaces, and chords from their edges, millimetres.
    pub tolerance_mm: f64,
    /// Most triangles.
    pub most: usize,
}

/// Triangles of a body.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Facets {
    /// Points, millimetres.
    pub points_mm: Vec<Point>,
    /// Indices of points, counter-clockwise seen from outside.
    pub triangles: Vec<[usize; 3]>,
    /// Of each triangle the index of its face.
    pub faces: Vec<usize>,
}

/// Triangles of all faces, which share the points of their edges.
///
/// # Errors
/// [`BodyError`], naming the face.
pub fn facets(body: &Body, settings: &FacetSettings) -> Result<Facets, BodyError> {
    let body = &oriented(body);
    let mut edges_mm = settings.tolerance_mm;
    for _ in 1..ATTEMPTS {
        match attempt(body, settings, edges_mm) {
            // Chords may cross where their edges do not.
            Err(BodyError::Loops { .. }) => edges_mm *= FINER,
            done => return done,
        }
    }
    attempt(body, settings, edges_mm)
}

fn attempt(body: &Body, settings: &FacetSettings, edges_mm: f64) -> Result<Facets, BodyError> {
    let mut division = Division::new(body, edges_mm)?;
    let mut cuts = Vec::with_capacity(body.faces.len());
    for face in &body.faces {
        cuts.push(prepare(body, &mut division, face)?);
    }
    let mut all = Facets {
        points_mm: division.points_mm.clone(),
        ..Facets::default()
    };
    for (k, (face, cuts)) in body.faces.iter().zip(cuts).enumerate() {
        let chart = Chart::new(&division, face, cuts)?;
        let left = settings.most.saturating_sub(all.triangles.len());
        let too_many = BodyError::TooMany {
            most: settings.most,
        };
        let filled = fill(
            face,
            &chart,
            &mut all.points_mm,
            settings.tolerance_mm,
            left,
        );
        let triangles = match filled {
            // A face is told what is left for it; who asked knows the whole.
            Err(BodyError::TooMany { .. }) => return Err(too_many),
            filled => filled?,
        };
        if triangles.len() > left {
            return Err(too_many);
        }
        all.faces.extend(core::iter::repeat_n(k, triangles.len()));
        all.triangles.extend(triangles);
    }
    Ok(all)
}
