//! A part: a block, and what is done to it.

use std::sync::Arc;

use nurbs::BSplineSurface;

use crate::outline::Outline;

/// A part as it is made: its block, then each operation in turn. Lengths in millimetres.
#[derive(Debug, Clone)]
pub struct Part {
    /// Name of the block, which its faces are named by.
    pub name: String,
    /// The block's outline in the plan of the frame.
    pub outline: Outline,
    /// Height of its top along the frame's z.
    pub top_mm: f64,
    /// Height of its bottom.
    pub bottom_mm: f64,
    /// What becomes of the edge around its top.
    pub upper: Option<Treatment>,
    /// What is cut and raised, in order.
    pub operations: Vec<Operation>,
    /// Where the part is.
    pub frame: Frame,
    /// Lines and circles of outlines, and levels, that are as near as this become one,
    /// millimetres; 0 leaves all where they are.
    pub snap_mm: f64,
}

impl Part {
    /// A plain block: [`Part::snap_mm`] is 0.02, the frame that of the coordinates.
    #[must_use]
    pub fn new(outline: Outline, top_mm: f64, bottom_mm: f64) -> Self {
        Self {
            name: "block".to_owned(),
            outline,
            top_mm,
            bottom_mm,
            upper: None,
            operations: Vec::new(),
            frame: Frame::default(),
            snap_mm: 0.02,
        }
    }
}

/// The frame of outlines and heights: right-handed, `y` is `z` times `x`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Its origin, millimetres.
    pub origin_mm: [f64; 3],
    /// Unit vector along x of the plan.
    pub x: [f64; 3],
    /// Unit vector along heights, out of the part.
    pub z: [f64; 3],
}

impl Default for Frame {
    fn default() -> Self {
        Self {
            origin_mm: [0.0; 3],
            x: [1.0, 0.0, 0.0],
            z: [0.0, 0.0, 1.0],
        }
    }
}

impl Frame {
    pub(crate) fn y(&self) -> [f64; 3] {
        let ([a, b, c], [x, y, z]) = (self.z, self.x);
        [b * z - c * y, c * x - a * z, a * y - b * x]
    }

    /// A direction of the frame in space.
    pub(crate) fn direction(&self, v: [f64; 3]) -> [f64; 3] {
        let y = self.y();
        core::array::from_fn(|k| v[0] * self.x[k] + v[1] * y[k] + v[2] * self.z[k])
    }

    /// A point of the frame in space.
    pub(crate) fn point(&self, p: [f64; 3]) -> [f64; 3] {
        let v = self.direction(p);
        core::array::from_fn(|k| self.origin_mm[k] + v[k])
    }

    pub(crate) fn is_valid(&self) -> bool {
        let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let finite = self.origin_mm.iter().all(|x| x.is_finite());
        finite
            && (dot(self.x, self.x) - 1.0).abs() < 1e-9
            && (dot(self.z, self.z) - 1.0).abs() < 1e-9
            && dot(self.x, self.z).abs() < 1e-9
    }
}

/// One step of making the part.
#[derive(Debug, Clone)]
pub struct Operation {
    /// Name, which faces are named by; one of its own for each operation.
    pub name: String,
    /// Whether it takes away or adds.
    pub kind: Kind,
    /// Where. It may reach beyond the block, outside of which nothing is done.
    pub outline: Outline,
    /// How high the part is there afterwards.
    pub floor: Floor,
    /// What becomes of the edge around the top of its wall.
    pub upper: Option<Treatment>,
    /// What becomes of the edge around the foot of its wall.
    pub lower: Option<Treatment>,
}

impl Operation {
    /// A cut without treated edges.
    #[must_use]
    pub fn cut(name: impl Into<String>, outline: Outline, floor: Floor) -> Self {
        Self {
            name: name.into(),
            kind: Kind::Cut,
            outline,
            floor,
            upper: None,
            lower: None,
        }
    }

    /// Something raised, without treated edges.
    #[must_use]
    pub fn raise(name: impl Into<String>, outline: Outline, top: Floor) -> Self {
        Self {
            kind: Kind::Raise,
            ..Self::cut(name, outline, top)
        }
    }
}

/// Whether an operation takes away or adds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// What is higher than the floor is lowered to it.
    Cut,
    /// What is lower than the floor is raised to it.
    Raise,
}

/// The surface that an operation leaves.
#[derive(Debug, Clone)]
pub enum Floor {
    /// Level.
    Level {
        /// Its height.
        z_mm: f64,
    },
    /// A plane, `z_mm + slope . (x, y)`.
    Plane {
        /// Its height over the origin.
        z_mm: f64,
        /// Rise along x and along y, millimetres by millimetre.
        slope: [f64; 2],
    },
    /// No floor: the cut goes through the block.
    Through,
    /// A cone around the middle of a circular outline, as a drill leaves it.
    Tip {
        /// Height of the cone's rim on the outline.
        rim_mm: f64,
        /// Angle of the cone between opposite sides, radians; 118 degrees of most drills.
        angle_rad: f64,
    },
    /// A sphere around a place; its lower half for a cut, its upper half for something raised.
    Sphere {
        /// The middle of the sphere.
        center_mm: [f64; 3],
        /// Its radius. The outline must lie within.
        radius_mm: f64,
    },
    /// Heights over the outline; parameters are x and y of the frame.
    FreeForm(Arc<BSplineSurface<1>>),
}

/// What becomes of an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Treatment {
    /// A slanting band. On the rim of a round hole it is a countersink: [`Treatment::countersink`].
    Chamfer {
        /// How far it reaches in the plan, millimetres.
        width_mm: f64,
        /// How far it reaches along z, millimetres.
        height_mm: f64,
    },
    /// A quarter of a circle: a round of an outer edge, a fillet of an inner one.
    Round {
        /// Its radius, millimetres.
        radius_mm: f64,
    },
}

impl Treatment {
    /// The countersink of a hole: its own diameter, the countersink's at the top, and the angle
    /// between opposite sides.
    #[must_use]
    pub fn countersink(hole_diameter_mm: f64, top_diameter_mm: f64, angle_rad: f64) -> Self {
        let width_mm = 0.5 * (top_diameter_mm - hole_diameter_mm);
        Self::Chamfer {
            width_mm,
            height_mm: width_mm / libm::tan(0.5 * angle_rad),
        }
    }

    pub(crate) fn width_mm(&self) -> f64 {
        match *self {
            Self::Chamfer { width_mm, .. } => width_mm,
            Self::Round { radius_mm } => radius_mm,
        }
    }

    pub(crate) fn height_mm(&self) -> f64 {
        match *self {
            Self::Chamfer { height_mm, .. } => height_mm,
            Self::Round { radius_mm } => radius_mm,
        }
    }
}
