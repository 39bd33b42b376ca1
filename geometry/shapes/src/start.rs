//! Where fits begin: shapes with the curvatures that the samples have in the middle.

use nalgebra::{Matrix2, Matrix3, SVector, SymmetricEigen, Vector3};

use crate::fit::Sample;
use crate::local::Local;
use crate::robust;
use crate::rotation;
use crate::shape::Family;
use crate::spread::spread;

/// Angles that a cone's generator may have with its axis.
const HALF_ANGLES_RAD: [f64; 4] = [-0.6, -0.15, 0.15, 0.6];
/// Angles that a torus's normal may have over the plane of its tube's middle.
const TUBE_ANGLES_RAD: [f64; 5] = [-1.2, -0.6, 0.1, 0.6, 1.2];
/// Weight below which a sample has no part in a start.
const NO_PART: f64 = 0.02;
/// Samples are flat whose variance across is less than this share of that in width.
const FLAT: f64 = 0.1;
/// Places besides the middle of all samples that tori begin at, and the share of the samples around
/// one, in numbers no less and no more than so: the middle of a ring is nowhere on it.
const PLACES: usize = 3;
const PATCH: f64 = 0.1;
const PATCH_OF: [usize; 2] = [60, 400];
/// Curvature taken for none, times the samples' extent.
const STRAIGHT: f64 = 1e-3;

/// A plane through the samples, and the frame in which they are told.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub(crate) middle: Vector3<f64>,
    pub(crate) normal: Vector3<f64>,
    pub(crate) along: Vector3<f64>,
    pub(crate) across: Vector3<f64>,
    /// Half the extent of the samples in the plane, about.
    pub(crate) reach: f64,
}

impl Frame {
    /// The frame of samples' principal axes, its normal towards +z: the least of them, or that
    /// nearest to the rays where the samples are not flat. `None` where they lie on a line.
    pub(crate) fn of(samples: &[Sample]) -> Option<Self> {
        let count = samples.len().max(1) as f64;
        let sum: Vector3<f64> = samples.iter().map(|s| s.point_mm).sum();
        let middle = sum / count;
        let mut spread = Matrix3::zeros();
        for sample in samples {
            let from = sample.point_mm - middle;
            spread += from * from.transpose();
        }
        let eigen = SymmetricEigen::new(spread / count);
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let ray: Vector3<f64> = samples.iter().map(|sample| sample.ray).sum();
        let vector = |k: usize| eigen.eigenvectors.column(k).into_owned();
        let variance = |k: usize| eigen.eigenvalues[k].max(0.0);
        if variance(order[0]) > FLAT * variance(order[1]) {
            // What was seen half around is as thick as it is wide: only where it was seen from
            // tells which side is up.
            let facing = |k: &usize| vector(*k).dot(&ray).abs();
            order.sort_by(|a, b| facing(b).total_cmp(&facing(a)));
            if variance(order[1]) > variance(order[2]) {
                order.swap(1, 2);
            }
        }
        let reach = 2.0 * variance(order[2]).sqrt();
        let width = variance(order[1]).sqrt();
        if width <= 1e-9 * reach || width.is_nan() {
            return None;
        }
        let normal: Vector3<f64> = vector(order[0]);
        let normal = if normal.z < 0.0 { -normal } else { normal };
        let along: Vector3<f64> = vector(order[2]);
        Some(Self {
            middle,
            normal,
            along,
            across: normal.cross(&along),
            reach,
        })
    }

    /// The terms of a quadratic at a point, and how far the point is above the plane.
    fn quadratic(&self, point: &Vector3<f64>) -> (SVector<f64, 6>, f64) {
        let [u, v, w] = self.coordinates(point);
        let (u, v) = (u / self.reach, v / self.reach);
        ([1.0, u, v, u * u, u * v, v * v].into(), w)
    }

    /// A point along, across and above.
    pub(crate) fn coordinates(&self, point: &Vector3<f64>) -> [f64; 3] {
        self.turned(&(point - self.middle))
    }

    /// A direction along, across and upwards.
    pub(crate) fn turned(&self, direction: &Vector3<f64>) -> [f64; 3] {
        [&self.along, &self.across, &self.normal].map(|axis| direction.dot(axis))
    }
}

/// What a quadratic through the samples says of their middle: where shapes begin.
pub(crate) struct Middle {
    frame: Frame,
    /// Samples that lie near to the quadratic.
    near: Vec<Sample>,
    place: Vector3<f64>,
    normal: Vector3<f64>,
    /// Principal directions and their curvatures, the most curved first; positive where the
    /// centre lies below.
    principal: [(Vector3<f64>, f64); 2],
    straight: f64,
}

impl Middle {
    /// `None` where the samples lie on a line or curve.
    pub(crate) fn of(samples: &[Sample]) -> Option<Self> {
        let frame = Frame::of(samples)?;
        let quadratic = |sample: &Sample| frame.quadratic(&sample.point_mm);
        let equations: Vec<_> = samples.iter().map(quadratic).collect();
        let (c, weights) = robust::solve(&equations)?;
        let tilt = [c[1] / frame.reach, c[2] / frame.reach];
        let normal = (frame.normal - frame.along * tilt[0] - frame.across * tilt[1]).normalize();
        let bend = c.fixed_rows::<3>(3) / (frame.reach * frame.reach);
        let eigen = SymmetricEigen::new(Matrix2::new(
            -2.0 * bend[0],
            -bend[1],
            -bend[1],
            -2.0 * bend[2],
        ));
        let direction = |k: usize| {
            let column = eigen.eigenvectors.column(k);
            let direction = frame.along * column[0] + frame.across * column[1];
            (direction - normal * direction.dot(&normal)).normalize()
        };
        let mut principal = [0, 1].map(|k| (direction(k), eigen.eigenvalues[k]));
        if principal[0].1.abs() < principal[1].1.abs() {
            principal.swap(0, 1);
        }
        let near = samples.iter().zip(&weights);
        let near = near.filter(|(_, weight)| **weight > NO_PART);
        Some(Self {
            frame,
            near: near.map(|(sample, _)| *sample).collect(),
            place: frame.middle + frame.normal * c[0],
            normal,
            principal,
            straight: STRAIGHT / frame.reach,
        })
    }

    fn local(&self, family: Family, along: Vector3<f64>, numbers: [f64; 3]) -> Local {
        Local {
            family,
            place: self.place,
            normal: self.normal,
            along,
            numbers,
        }
    }

    /// A curvature that is not zero.
    fn bent(&self, curvature: f64) -> f64 {
        if curvature.abs() < self.straight {
            self.straight.copysign(curvature)
        } else {
            curvature
        }
    }

    /// The principal directions, each with the curvature across it and that along it.
    fn ways(&self) -> [(Vector3<f64>, f64, f64); 2] {
        let [(most, most_curvature), (least, least_curvature)] = self.principal;
        [
            (least, most_curvature, least_curvature),
            (most, least_curvature, most_curvature),
        ]
    }

    /// Shapes of a family to begin with, for these samples.
    pub(crate) fn starts(&self, family: Family, samples: &[Sample]) -> Vec<Local> {
        match family {
            Family::Plane => vec![self.local(family, self.principal[1].0, [0.0; 3])],
            Family::Sphere => {
                let [(_, most), (along, least)] = self.principal;
                vec![self.local(family, along, [0.5 * (most + least), 0.0, 0.0])]
            }
            Family::Cylinder => self
                .ways()
                .map(|(along, bend, _)| self.local(family, along, [bend, 0.0, 0.0]))
                .to_vec(),
            Family::Cone => {
                let mut all = Vec::new();
                for (along, bend, _) in self.ways() {
                    for angle in HALF_ANGLES_RAD {
                        let bend = self.bent(bend) / libm::cos(angle);
                        all.push(self.local(family, along, [bend, angle, 0.0]));
                    }
                }
                all
            }
            Family::Torus => {
                let mut all = Vec::new();
                all.extend(rotation::torus(&self.near, &self.frame));
                all.extend(tori(self));
                for patch in patches(samples) {
                    all.extend(Middle::of(&patch).iter().flat_map(tori));
                }
                all
            }
        }
    }
}

/// Tori with the curvatures that samples have in their middle.
fn tori(middle: &Middle) -> Vec<Local> {
    let mut all = Vec::new();
    for (along, about, tube) in middle.ways() {
        let (about, tube) = (middle.bent(about), middle.bent(tube));
        for angle in TUBE_ANGLES_RAD {
            // Meusnier: the circle about the axis bends by the cosine less than the surface does
            // along it.
            let radius = libm::cos(angle) * (1.0 / about - 1.0 / tube);
            let number = middle.bent(1.0 / radius);
            all.push(middle.local(Family::Torus, along, [number, angle, tube]));
        }
    }
    all
}

/// Samples around some places.
fn patches(samples: &[Sample]) -> Vec<Vec<Sample>> {
    let few = ((PATCH * samples.len() as f64) as usize).clamp(PATCH_OF[0], PATCH_OF[1]);
    if few >= samples.len() {
        return Vec::new();
    }
    let around = |place: usize| {
        let middle = samples[place].point_mm;
        let mut patch = samples.to_vec();
        let far2 = |sample: &Sample| (sample.point_mm - middle).norm_squared();
        patch.select_nth_unstable_by(few, |a, b| far2(a).total_cmp(&far2(b)));
        patch.truncate(few);
        patch
    };
    spread(samples.len(), PLACES).map(around).collect()
}
