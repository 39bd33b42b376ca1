//! Why sections cannot be skinned.

use range_image::Cancelled;

use crate::settings::SettingsError;

/// Greatest coordinate: ten kilometres.
pub(crate) const MOST_MM: f64 = 1e7;

/// Why sections cannot be skinned. Sections are named as they came.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SkinError {
    /// A setting that cannot be.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// Nothing to skin between.
    #[error("there are {0} sections, and a surface needs 2 at least")]
    TooFewSections(usize),
    /// Too few points.
    #[error("{section} has {points} distinct points, and needs 4 at least")]
    TooFewPoints {
        /// Its name.
        section: String,
        /// How many it has.
        points: usize,
    },
    /// A coordinate that is none.
    #[error(
        "point {index} of {section} has a coordinate that is not finite, or beyond {MOST_MM} mm"
    )]
    NotFinite {
        /// Its name.
        section: String,
        /// Counted from 1.
        index: usize,
    },
    /// Some are open, some closed.
    #[error(
        "{open} is open, {closed} is closed: all must be the one or the other. A section is closed \
         if its last point is the first again, or as near to it as the others are to each other"
    )]
    OpenAmongClosed {
        /// An open one.
        open: String,
        /// A closed one.
        closed: String,
    },
    /// Two at one height.
    #[error(
        "{first} and {second} lie at the same height: the body branches there, or a section came \
         twice. Skin each limb by itself, with the sections that are its own"
    )]
    Branching {
        /// One of them.
        first: String,
        /// The other.
        second: String,
    },
    /// Two that pass through each other.
    #[error(
        "{first} and {second} cross each other: a part of the one is above the other, a part below"
    )]
    Crossing {
        /// One of them.
        first: String,
        /// The other.
        second: String,
    },
    /// One that passes through itself.
    #[error(
        "{section} crosses itself near ({:.3}, {:.3}, {:.3}): its inside cannot be told from its \
         outside", place_mm[0], place_mm[1], place_mm[2]
    )]
    CrossingItself {
        /// Its name.
        section: String,
        /// Where.
        place_mm: [f64; 3],
    },
    /// One whose sense cannot be told, or is not to be changed.
    #[error(
        "{section} runs in another sense than {reference}, or in none that can be told: {hint}"
    )]
    Sense {
        /// Its name.
        section: String,
        /// The one it is compared with.
        reference: String,
        /// What to do.
        hint: &'static str,
    },
    /// No surface holds the tolerance.
    #[error(
        "no surface with a knot for each data point comes nearer to {section} than {reached_mm:.4} \
         mm, and {tolerance_mm} mm were asked for. Ask for less, or look at that section for \
         points that are not of it"
    )]
    OutOfReach {
        /// The section that is the farthest off.
        section: String,
        /// How near a surface came, millimetres.
        reached_mm: f64,
        /// What was asked for, millimetres.
        tolerance_mm: f64,
    },
    /// No curve follows from a section's points.
    #[error(
        "{section}: its points do not determine a curve; look for points that nearly lie on each \
         other, or sections that do"
    )]
    Undetermined {
        /// Its name.
        section: String,
    },
    /// The published method would need too many numbers.
    #[error(
        "the published method gives each of {sections} sections the knots of all, {knots}, and that \
         is more than it can remove again; skin fewer sections, or without --method jo"
    )]
    TooMany {
        /// Knots of all.
        knots: usize,
        /// Sections.
        sections: usize,
    },
    /// Given up because the caller asked for it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
