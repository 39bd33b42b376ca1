//! Implicit surfaces through scattered points with normals (Yoo, section 2).
//!
//! A function is zero on the surface and grows along its normals as distances do. It is made of radial
//! functions around the points and a polynomial (equation 1); that it is zero at the points and grows
//! beside them gives its weights (equations 3 and 4). Two things differ from the paper unless asked for:
//!
//! - Kernels that have second derivatives take the slope along the normal at some of the points as
//!   conditions of their own ([Hermite-Birkhoff][kernel]), instead of values at points off the surface.
//!   What is meant is then exact, however large the offset would have been.
//! - Points are as exact as they are: how far the function may stay off zero at them is what makes the
//!   points likeliest (restricted maximum likelihood), which is next to nothing where they lie on a
//!   smooth surface, and their noise where they do not.
//!
//! Nothing here knows of meshes.

mod assemble;
pub(crate) mod dense;
mod fine;
mod fit;
mod kernel;
mod thin;

use glam::DVec3;

pub use fit::{FitSettings, ImplicitError, Smoothing, Solver};
pub use kernel::Kernel;

use fine::Fine;
use kernel::Radial;

/// A point that the surface passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Where it is, millimetres.
    pub place_mm: DVec3,
    /// Unit normal there; zero where it is not known.
    pub normal: DVec3,
    /// How far it is from where the surface is wanted, millimetres: the farther, the thinner the points
    /// may be spread.
    pub reach_mm: f64,
}

/// A function of space that is zero on a surface.
///
/// Beside the surface it is about the signed distance, millimetres, positive on the side that normals
/// point to.
#[derive(Debug, Clone)]
pub struct Implicit {
    kernel: Kernel,
    origin_mm: DVec3,
    /// Millimetres to a unit of what is inside.
    unit_mm: f64,
    /// Places of values and their weights.
    values: Vec<(DVec3, f64)>,
    /// Places of slopes, and directions times weights.
    slopes: Vec<(DVec3, DVec3)>,
    polynomial: Vec<f64>,
    fine: Vec<Fine>,
    noise_mm: f64,
}

impl Implicit {
    /// The function at a place, millimetres, and its gradient.
    #[must_use]
    pub fn at(&self, place_mm: DVec3) -> (f64, DVec3) {
        let at = (place_mm - self.origin_mm) / self.unit_mm;
        let (mut value, mut gradient) = match self.kernel {
            Kernel::ThinPlate => self.sum(at, |squared| Kernel::ThinPlate.at(squared)),
            Kernel::Biharmonic => self.sum(at, |squared| Kernel::Biharmonic.at(squared)),
            Kernel::Triharmonic => self.sum(at, |squared| Kernel::Triharmonic.at(squared)),
            Kernel::Quintic => self.sum(at, |squared| Kernel::Quintic.at(squared)),
        };
        for level in &self.fine {
            let (own, slope) = level.at(at);
            value += own;
            gradient += slope;
        }
        (value * self.unit_mm, gradient)
    }

    #[inline]
    fn sum(&self, at: DVec3, radial: impl Fn(f64) -> Radial) -> (f64, DVec3) {
        let (mut value, mut gradient) = kernel::evaluated(&self.polynomial, at);
        for &(centre, weight) in &self.values {
            let arm = at - centre;
            let own = radial(arm.length_squared());
            value += weight * own.value;
            gradient += weight * own.slope * arm;
        }
        for &(centre, moment) in &self.slopes {
            let arm = at - centre;
            let own = radial(arm.length_squared());
            let along = moment.dot(arm);
            value -= own.slope * along;
            gradient -= own.slope * moment + own.bend * along * arm;
        }
        (value, gradient)
    }

    /// What the points are taken to lie off the surface, root mean square, millimetres.
    #[must_use]
    pub fn noise_mm(&self) -> f64 {
        self.noise_mm
    }

    /// Radial functions in it, of all levels.
    #[must_use]
    pub fn centres(&self) -> usize {
        let fine: usize = self.fine.iter().map(Fine::centres).sum();
        self.values.len() + self.slopes.len() + fine
    }

    /// Where a line through a place meets the surface, by Newton's iteration (Yoo, equation 5).
    ///
    /// `None` where it does not within `reach_mm` of the place.
    #[must_use]
    pub fn along(&self, place_mm: DVec3, direction: DVec3, reach_mm: f64) -> Option<DVec3> {
        let mut way = 0.0_f64;
        for _ in 0..MOST_STEPS {
            let (value, gradient) = self.at(place_mm + way * direction);
            let slope = gradient.dot(direction);
            let step = -value / slope;
            if !step.is_finite() {
                return None;
            }
            way += step.clamp(-0.25 * reach_mm, 0.25 * reach_mm);
            if way.abs() > reach_mm {
                return None;
            }
            if step.abs() <= NEAR * self.unit_mm {
                return Some(place_mm + way * direction);
            }
        }
        None
    }

    /// The foot of a place on the surface, down the gradient.
    ///
    /// `None` where there is none within `reach_mm`.
    #[must_use]
    pub fn foot(&self, place_mm: DVec3, reach_mm: f64) -> Option<DVec3> {
        let mut at = place_mm;
        for _ in 0..MOST_STEPS {
            let (value, gradient) = self.at(at);
            let step = -value / gradient.length_squared() * gradient;
            let length = step.length();
            if !length.is_finite() {
                return None;
            }
            let most = 0.25 * reach_mm;
            at += if length > most {
                step * (most / length)
            } else {
                step
            };
            if at.distance_squared(place_mm) > reach_mm * reach_mm {
                return None;
            }
            if length <= NEAR * self.unit_mm {
                return Some(at);
            }
        }
        None
    }
}

/// Newton's iteration gives up after so many steps, and ends at steps as short as this, in the units
/// of the region.
const MOST_STEPS: usize = 30;
const NEAR: f64 = 1e-8;
