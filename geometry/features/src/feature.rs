//! Features, as they are told.

use std::sync::Arc;

use nalgebra::Vector3;
use nurbs::BSplineSurface;

use crate::candidate::Lie;
use crate::class::Class;
use crate::floor::Curve;
use crate::outline::Shape;
use crate::thread::nominal_thread;

/// A length with its standard uncertainty, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dimension {
    /// What it is the length of.
    pub name: &'static str,
    /// The length.
    pub value_mm: f64,
    /// Its standard uncertainty.
    pub sigma_mm: f64,
}

/// What a feature ends in, besides a plane at its height.
#[derive(Debug, Clone, PartialEq)]
pub enum Bottom {
    /// A plane.
    Level,
    /// Not seen.
    Unseen,
    /// A cone, as a drill leaves it: rise over run of its side. The height is that of its edge.
    Tip(f64),
    /// A free form: heights over u and v of the plan.
    FreeForm(Arc<BSplineSurface<1>>),
}

/// One feature.
#[derive(Debug, Clone, PartialEq)]
pub struct Feature {
    /// Its number; the block is 0.
    pub id: u32,
    /// The feature that it goes into or stands on.
    pub parent: Option<u32>,
    /// Name of its class; `unknown` where the network has no answer.
    pub class: String,
    /// How sure the network is of the class, 0 to 1; 1 where the user said so. Of treated edges the share
    /// of the samples that the section explains.
    pub score: f64,
    /// The code of its section.
    pub code: String,
    /// The middle of its outline, on the face that it goes into or stands on.
    pub centre_mm: Vector3<f64>,
    /// Standard uncertainties of that along u, v and w of the plan.
    pub centre_sigma_mm: [f64; 3],
    /// Unit vector out of the material.
    pub axis: Vector3<f64>,
    /// Unit vector along its length, of what has one.
    pub direction: Option<Vector3<f64>>,
    /// Its dimensions.
    pub dimensions: Vec<Dimension>,
    /// Its outline in the plan.
    pub outline: Shape,
    /// Heights above the plan of the face it goes into or stands on, and of its floor or top;
    /// the second is `None` where that was not seen.
    pub heights_mm: (f64, Option<f64>),
    /// How it lies in what is around it; `None` of treated edges.
    pub lie: Option<Lie>,
    /// What it ends in.
    pub bottom: Bottom,
    /// The sphere or cylinder that a free form is part of, if it is of one.
    pub curve: Option<Curve>,
    /// Whether it goes through the part.
    pub through: bool,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Whether the user changed something of it.
    pub is_edited: bool,
}

impl Feature {
    /// The thread that a hole may have, by its diameter: a guess, since a plain hole of that size looks
    /// the same.
    #[must_use]
    pub fn thread(&self) -> Option<&'static str> {
        let diameter = self.dimension("diameter")?;
        let is_hole = self.class == Class::Hole.as_str();
        is_hole
            .then(|| nominal_thread(diameter.value_mm, diameter.sigma_mm))
            .flatten()
    }

    /// A dimension by its name.
    #[must_use]
    pub fn dimension(&self, name: &str) -> Option<&Dimension> {
        self.dimensions.iter().find(|own| own.name == name)
    }
}
