//! What can be wrong with a part.

/// Why pieces do not make an outline.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OutlineError {
    /// Less than two pieces.
    #[error("{given} pieces do not close: an outline has at least two")]
    TooFew {
        /// Pieces given.
        given: usize,
    },
    /// A number is not finite or beyond a kilometre.
    #[error("piece {index} has a coordinate that is not finite or beyond 1e6 mm")]
    Number {
        /// Which piece, from 0.
        index: usize,
    },
    /// The ends of an arc are not equally far from its centre.
    #[error("arc {index} has ends whose distances from its centre differ by {gap_mm:e} mm")]
    Arc {
        /// Which piece, from 0.
        index: usize,
        /// By how much.
        gap_mm: f64,
    },
    /// A piece does not begin where the one before it ends.
    #[error("piece {index} ends {gap_mm:e} mm from where the next begins")]
    Open {
        /// Which piece, from 0.
        index: usize,
        /// How far.
        gap_mm: f64,
    },
    /// A piece is too short.
    #[error("piece {index} is {length_mm:e} mm long: at least 0.01 mm is needed")]
    Short {
        /// Which piece, from 0.
        index: usize,
        /// Its length.
        length_mm: f64,
    },
    /// It encloses nothing.
    #[error("the outline encloses no area")]
    Flat,
    /// Corners of a rectangle do not fit it.
    #[error("corners of radius {radius_mm} mm do not fit the rectangle")]
    Radius {
        /// The radius.
        radius_mm: f64,
    },
}

/// Why a part cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// The block has no height.
    #[error("the block's top at {top_mm} mm is not above its bottom at {bottom_mm} mm")]
    Block {
        /// Its top.
        top_mm: f64,
        /// Its bottom.
        bottom_mm: f64,
    },
    /// The frame's axes are not unit vectors at a right angle.
    #[error("the frame's axes must be unit vectors at a right angle")]
    Frame,
    /// A floor does not suit its outline or has numbers that are none.
    #[error("operation {name:?}: {what}")]
    Floor {
        /// The operation.
        name: String,
        /// What is wrong.
        what: &'static str,
    },
    /// Two operations have one name.
    #[error("two operations are named {name:?}: each needs a name of its own")]
    Name {
        /// The name.
        name: String,
    },
    /// The operations leave nothing of the block.
    #[error("the operations leave nothing of the block")]
    Nothing,
    /// No valid solid came of it, though the outline was moved a little.
    #[error("operation {name:?} leaves no valid solid: {what}; move its outline a little")]
    Invalid {
        /// The operation at the place.
        name: String,
        /// What is wrong.
        what: String,
    },
}

/// What was done otherwise than asked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// A treatment of an edge was left out.
    #[error("{operation:?}: its {edge} edge is left as it is: {why}")]
    EdgeLeft {
        /// The operation.
        operation: String,
        /// `upper` or `lower`.
        edge: &'static str,
        /// Why.
        why: String,
    },
    /// An outline was made a little larger or smaller, since the solid would have touched itself.
    #[error(
        "{operation:?}: its outline is moved outwards by {by_mm} mm, since the solid would touch itself"
    )]
    Moved {
        /// The operation.
        operation: String,
        /// By how much.
        by_mm: f64,
    },
    /// A floor meets another surface along a curve that has no closed form here; it is taken as a
    /// whole where most of it is deeper.
    #[error(
        "{operation:?}: its floor crosses another surface along no line or circle; a step is left there"
    )]
    Crossing {
        /// The operation.
        operation: String,
    },
    /// The operations cut the block into several; the largest is kept.
    #[error("the operations cut the block into {parts} parts, of which the largest is kept")]
    Parted {
        /// How many there are.
        parts: usize,
    },
}
