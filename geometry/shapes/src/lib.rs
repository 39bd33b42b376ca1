//! Analytic surfaces: planes, spheres, cylinders, cones and tori, fitted to samples with
//! uncertainties, and told apart.
//!
//! ```text
//! samples --> starts (curvatures in their middle) --> descent --> Fit: shape, numbers, rms
//!                                       of each family, and polynomials --> Evidence
//! ```
//!
//! A fit minimises how far samples lie off along their rays, each in its own standard deviation,
//! over the samples that are not too far off to be noise. Its numbers come with standard
//! uncertainties: those of the noise met, to first order.

mod descent;
mod distance;
mod evidence;
mod fit;
mod form;
mod local;
mod robust;
mod rotation;
mod several;
mod shape;
mod spread;
mod start;
mod sweep;
mod uncertainty;

pub use evidence::{Candidate, Evidence, Verdict, decide, decide_whole};
pub use fit::{Fit, Sample, fit};
pub use form::Form;
pub use several::{is_part_of_free_form, is_smooth, is_smoother};
pub use shape::{Cone, Cylinder, Family, Plane, Shape, Sphere, Torus};
pub use spread::{is_in_share, spread};
pub use sweep::{MOST_FREE, Motion, Normal, Placed, Sweep, Swept, SweptFit, motions, swept};
pub use uncertainty::{Joint, Measured, Numbers, Spread};
