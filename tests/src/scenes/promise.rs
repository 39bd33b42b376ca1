//! What a scene must hold, read off the truth.

use std::collections::{BTreeMap, BTreeSet};

use sim_scanner::preset::SetupError;
use sim_scanner::scanner::{Scanner, Sweep};
use sim_scanner::scene::{Body, FaceId, Scene, Surface};

use super::truth::{Faces, STEP_MM, Seen};
use super::{Set, Truth, scan};

/// Neighbouring faces without a step differ by at least this much in direction, radians.
const CREASE_RAD: f64 = 10.0 * core::f64::consts::PI / 180.0;
/// Below this, and below [`SMOOTH_MM`], two faces join smoothly and are one.
const SMOOTH_RAD: f64 = 0.5 * core::f64::consts::PI / 180.0;
const SMOOTH_MM: f64 = 0.02;

/// Why a candidate is no scene of its set.
#[derive(Debug, Clone, PartialEq)]
pub enum Broken {
    /// The scanner cannot hold it.
    DoesNotFit(SetupError),
    /// Too few or too many visible faces that count.
    Faces(usize),
    /// Only flat faces where curved ones are promised.
    AllFlat,
    /// Two faces meet at less than a crease and less than a step, yet not smoothly.
    Border {
        /// The faces.
        between: (FaceId, FaceId),
        /// Angle between their normals, radians.
        angle_rad: f64,
        /// Distance of the surfaces, millimetres.
        step_mm: f64,
    },
}

/// The truth of a scene, if that holds what the set promises.
pub(super) fn check(set: Set, scanner: &Scanner, sweep: &Sweep) -> Result<Truth, Broken> {
    let lattice = scan::lattice(scanner, sweep);
    let faces = Faces::of(scanner, sweep, lattice);
    let same = joined(&faces, &scanner.scene)?;
    let truth = faces.regions(&same);
    let counted: Vec<FaceId> = truth
        .regions
        .iter()
        .filter(|region| region.counts())
        .map(|region| region.face)
        .collect();
    let (least, most) = set.faces();
    if counted.len() < least || counted.len() > most {
        return Err(Broken::Faces(counted.len()));
    }
    if set == Set::Curved && counted.iter().all(|face| is_flat(&scanner.scene, *face)) {
        return Err(Broken::AllFlat);
    }
    Ok(truth)
}

/// Maps each face that joins another smoothly all along their border to one of the joined.
fn joined(faces: &Faces, scene: &Scene) -> Result<BTreeMap<FaceId, FaceId>, Broken> {
    let mut smooth = BTreeSet::new();
    let mut sharp = BTreeSet::new();
    for (a, b) in faces.borders().filter(|(a, b)| a.face != b.face) {
        let pair = (a.face.min(b.face), a.face.max(b.face));
        let (angle_rad, step_mm) = (angle_rad(scene, a, b), a.step_mm(b));
        if angle_rad >= CREASE_RAD || step_mm >= STEP_MM {
            sharp.insert(pair);
        } else if angle_rad <= SMOOTH_RAD && step_mm <= SMOOTH_MM + curl_mm(a, b) {
            smooth.insert(pair);
        } else {
            return Err(Broken::Border {
                between: pair,
                angle_rad,
                step_mm,
            });
        }
    }
    let mut same: BTreeMap<FaceId, FaceId> = BTreeMap::new();
    for pair in &smooth {
        if sharp.contains(pair) {
            return Err(Broken::Border {
                between: *pair,
                angle_rad: 0.0,
                step_mm: 0.0,
            });
        }
        let of = |face: FaceId, same: &BTreeMap<FaceId, FaceId>| *same.get(&face).unwrap_or(&face);
        let (keep, drop) = (of(pair.0, &same), of(pair.1, &same));
        for target in same.values_mut().filter(|target| **target == drop) {
            *target = keep;
        }
        same.insert(drop, keep);
        same.insert(pair.1, keep);
    }
    Ok(same)
}

/// The angle between two faces where they meet: between their normals at one point where the
/// faces are known in closed form, else between the normals of neighbouring nodes.
fn angle_rad(scene: &Scene, a: &Seen, b: &Seen) -> f64 {
    let here = match surface(scene, a.face) {
        Some(surface) => surface.normal_at(b.point_mm),
        None => a.normal,
    };
    libm::acos(here.dot(b.normal).clamp(-1.0, 1.0))
}

/// How far a curved surface leaves its tangent plane between two nodes.
fn curl_mm(a: &Seen, b: &Seen) -> f64 {
    let turn = libm::acos(a.normal.dot(b.normal).clamp(-1.0, 1.0));
    a.point_mm.distance(b.point_mm) * libm::sin(turn)
}

fn surface(scene: &Scene, face: FaceId) -> Option<&Surface> {
    match scene.bodies.get(face.body) {
        Some((Body::Solid(solid), _)) => solid.faces().get(face.face),
        _ => None,
    }
}

fn is_flat(scene: &Scene, face: FaceId) -> bool {
    matches!(surface(scene, face), Some(Surface::Plane { .. }))
}
