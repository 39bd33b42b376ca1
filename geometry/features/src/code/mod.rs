//! The code of a section curve (Jun & Park, section 6.3 and Table 2), and what else the network is
//! told of a feature.
//!
//! A section runs from one side of the feature to the other; s is the way along it in the plane,
//! z the height, both millimetres. Its directions are [`Digit`]s. Each wall counts three digits,
//! the bend before it, itself and the bend behind it, and each floor one, so that a pocket is
//! 4 5 4 3 2 1 2. Chamfers and fillets that are small beside their wall are its bends.

mod digits;
mod pieces;

pub use digits::code;

/// A direction of the section curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Digit {
    /// 1: straight up.
    Up,
    /// 2: slanting up.
    Rising,
    /// 3: level.
    Level,
    /// 4: slanting down.
    Falling,
    /// 5: straight down.
    Down,
}

impl Digit {
    /// All, 1 to 5.
    pub const ALL: [Self; 5] = [
        Self::Up,
        Self::Rising,
        Self::Level,
        Self::Falling,
        Self::Down,
    ];

    /// Its number, 1 to 5.
    #[must_use]
    pub fn number(self) -> u8 {
        match self {
            Self::Up => 1,
            Self::Rising => 2,
            Self::Level => 3,
            Self::Falling => 4,
            Self::Down => 5,
        }
    }

    /// The digit of a number, if it is one.
    #[must_use]
    pub fn of(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|own| own.number() == number)
    }

    /// The same, gone along the other way.
    #[must_use]
    pub fn turned(self) -> Self {
        match self {
            Self::Up => Self::Down,
            Self::Rising => Self::Falling,
            Self::Level => Self::Level,
            Self::Falling => Self::Rising,
            Self::Down => Self::Up,
        }
    }
}

/// The code of the same section, gone along from its other end.
#[must_use]
pub fn mirrored(code: &[Digit]) -> Vec<Digit> {
    code.iter().rev().map(|digit| digit.turned()).collect()
}

/// The digits side by side: `4543212`.
#[must_use]
pub fn written(code: &[Digit]) -> String {
    let digit = |digit: &Digit| char::from(b'0' + digit.number());
    code.iter().map(digit).collect()
}

/// Whether a feature goes into the material or stands out of it; attribute (A) of Table 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Sense {
    /// Goes in; -1.
    Concave,
    /// Stands out; 1.
    Convex,
}

impl Sense {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Concave, Self::Convex];

    /// What the network is given.
    #[must_use]
    pub fn number(self) -> f64 {
        match self {
            Self::Concave => -1.0,
            Self::Convex => 1.0,
        }
    }

    /// Its name in files.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Concave => "concave",
            Self::Convex => "convex",
        }
    }
}

/// The form of a feature's outline; attribute (B) of Table 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Form {
    /// A circle; -1.
    Circular,
    /// Rectangular, or else closed without being a circle; 1.
    ClosedRectangular,
    /// Running out at one side at least; 2.
    Open,
}

impl Form {
    /// All.
    pub const ALL: [Self; 3] = [Self::Circular, Self::ClosedRectangular, Self::Open];

    /// What the network is given.
    #[must_use]
    pub fn number(self) -> f64 {
        match self {
            Self::Circular => -1.0,
            Self::ClosedRectangular => 1.0,
            Self::Open => 2.0,
        }
    }

    /// Its name in files.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Circular => "circular",
            Self::ClosedRectangular => "closed",
            Self::Open => "open",
        }
    }
}

/// All that the network is told of a feature.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Attributes {
    /// Of its section.
    pub code: Vec<Digit>,
    /// In or out.
    pub sense: Sense,
    /// Of its outline.
    pub form: Form,
}

/// What a section ends in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// What lies before the first wall (behind the last) are the feature's surroundings, which its
    /// code leaves out.
    Rim,
    /// The feature goes on to the very end, as the floor of a step does that runs out, or one that
    /// the scan's border cuts.
    Open,
}

/// A section of a feature, as measured.
#[derive(Debug, Clone, Copy)]
pub struct Section<'a> {
    /// (s, z) in the order along it, millimetres; may have gaps. s may stay as it is along a wall.
    /// Points that are not finite are left out.
    pub points: &'a [[f64; 2]],
    /// Standard deviation of z, millimetres.
    pub noise_mm: f64,
    /// Usual distance of points along s, millimetres; 0 where they are corners and not samples.
    pub pitch_mm: f64,
    /// At its first and its last point.
    pub ends: [End; 2],
}
