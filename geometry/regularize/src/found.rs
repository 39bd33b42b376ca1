//! What was found, as it is told.

use core::fmt;

/// What a regularity is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Planes or axes of one direction; an axis along a plane.
    Parallel,
    /// Planes or axes at right angles; an axis square to a plane.
    Perpendicular,
    /// Planes or axes at 30, 45 or 60 degrees.
    Angle,
    /// Along an axis of the part frame: 0 is x.
    AlongFrame(usize),
    /// Square to an axis of the part frame.
    AcrossFrame(usize),
    /// Planes that are one.
    Coplanar,
    /// Axes that are one.
    Coaxial,
    /// A sphere's centre on an axis.
    OnAxis,
    /// Spheres of one centre.
    Concentric,
    /// Radii of spheres, cylinders and tubes of tori, or of rings of tori.
    EqualRadii,
    /// Half angles of cones.
    EqualHalfAngles,
    /// The first two are mirrored in the same plane as the others.
    Symmetric,
    /// The third lies in the plane that the first two are mirrored in.
    Centred,
    /// A radius of a sphere, a cylinder, or of a torus's ring.
    RoundRadius,
    /// A radius of a torus's tube.
    RoundTubeRadius,
    /// A distance of parallel planes or axes.
    RoundDistance,
    /// A half angle of a cone.
    RoundHalfAngle,
    /// Surfaces that have one tangent plane along the line in which they meet.
    Tangent,
}

impl Kind {
    /// As reports have it.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Parallel => "parallel",
            Self::Perpendicular => "perpendicular",
            Self::Angle => "angle",
            Self::AlongFrame(0) => "parallel to x",
            Self::AlongFrame(1) => "parallel to y",
            Self::AlongFrame(_) => "parallel to z",
            Self::AcrossFrame(0) => "perpendicular to x",
            Self::AcrossFrame(1) => "perpendicular to y",
            Self::AcrossFrame(_) => "perpendicular to z",
            Self::Coplanar => "coplanar",
            Self::Coaxial => "coaxial",
            Self::OnAxis => "centre on axis",
            Self::Concentric => "concentric",
            Self::EqualRadii => "equal radii",
            Self::EqualHalfAngles => "equal half angles",
            Self::Symmetric => "symmetric",
            Self::Centred => "centred",
            Self::RoundRadius => "round radius",
            Self::RoundTubeRadius => "round tube radius",
            Self::RoundDistance => "round distance",
            Self::RoundHalfAngle => "round half angle",
            Self::Tangent => "tangent",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// The number that a regularity makes something be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// A length.
    Millimetres(f64),
    /// An angle.
    Degrees(f64),
}

/// A regularity that the adjusted shapes have.
#[derive(Debug, Clone, PartialEq)]
pub struct Regularity {
    /// What it is.
    pub kind: Kind,
    /// The shapes that it ties.
    pub labels: Vec<u16>,
    /// What a round number is.
    pub target: Option<Target>,
    /// By how much directions and half angles were off it as fitted, radians.
    pub off_rad: Option<f64>,
    /// By how much places and sizes were, millimetres.
    pub off_mm: Option<f64>,
    /// How far off it was when its turn came, in standard uncertainties: the root of chi-square.
    pub deviations: f64,
    /// Degrees of freedom of that.
    pub freedom: usize,
    /// Probability that something that has it is measured to be so far off.
    pub p: f64,
    /// Probability that things without any tie are so near it by chance.
    pub chance: f64,
    /// Most that a direction or half angle of these was turned by it, radians.
    pub turned_rad: f64,
    /// Most that a place or a size of these was moved by it, millimetres.
    pub moved_mm: f64,
}

/// Why something is no regularity, though it is nearly one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reason {
    /// It is off by more than the bound.
    TooFar,
    /// As uncertain as the shapes are, chance makes as much often enough.
    MaybeChance,
    /// It does not go together with likelier ones.
    Contradicted,
    /// It would move or turn something too far.
    Limit,
    /// The samples of one of its shapes do not allow of the shape that it would be.
    Samples,
}

impl Reason {
    /// As reports have it.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::TooFar => "off by more than the bound",
            Self::MaybeChance => "may be chance",
            Self::Contradicted => "contradicts likelier ones",
            Self::Limit => "would move something too far",
            Self::Samples => "refused by the samples",
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// What is nearly a regularity.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    /// What it would be.
    pub kind: Kind,
    /// The shapes that it would tie.
    pub labels: Vec<u16>,
    /// What a round number would be.
    pub target: Option<Target>,
    /// As [`Regularity::off_rad`].
    pub off_rad: Option<f64>,
    /// As [`Regularity::off_mm`].
    pub off_mm: Option<f64>,
    /// As [`Regularity::deviations`].
    pub deviations: f64,
    /// As [`Regularity::p`].
    pub p: f64,
    /// Why not.
    pub reason: Reason,
}

impl Refused {
    /// What was accepted, and is not any more.
    #[must_use]
    pub fn of(accepted: &Regularity, reason: Reason) -> Self {
        Self {
            kind: accepted.kind,
            labels: accepted.labels.clone(),
            target: accepted.target,
            off_rad: accepted.off_rad,
            off_mm: accepted.off_mm,
            deviations: accepted.deviations,
            p: accepted.p,
            reason,
        }
    }
}
