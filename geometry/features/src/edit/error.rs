//! Changes that cannot be made.

/// A change that cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EditError {
    /// There is no such feature.
    #[error("there is no feature {id}; there are 0 to {last}")]
    NoFeature {
        /// The number asked for.
        id: u32,
        /// The last there is.
        last: u32,
    },
    /// It is changed by two.
    #[error("feature {id} is edited twice; give all that changes in one")]
    Twice {
        /// Its number.
        id: u32,
    },
    /// Nothing is changed.
    #[error("the edit of feature {id} changes nothing; give a type, a direction or a dimension")]
    Nothing {
        /// Its number.
        id: u32,
    },
    /// It can be no such feature.
    #[error("{class} {id} cannot be a \"{wanted}\": {why}")]
    Class {
        /// Its type.
        class: String,
        /// Its number.
        id: u32,
        /// The type asked for.
        wanted: String,
        /// Why not, and what it can be.
        why: String,
    },
    /// It has no such dimension.
    #[error("{class} {id} has no {name}; it has {has}")]
    NoDimension {
        /// Its type.
        class: String,
        /// Its number.
        id: u32,
        /// The dimension asked for.
        name: String,
        /// Those that it has.
        has: String,
    },
    /// A length that is none, or that the part has no room for.
    #[error("{class} {id}: {name} is {value_mm} mm; {must}")]
    Length {
        /// Its type.
        class: String,
        /// Its number.
        id: u32,
        /// The dimension.
        name: String,
        /// As given.
        value_mm: f64,
        /// What it must be.
        must: String,
    },
    /// A direction of what has none.
    #[error("{class} {id} is round and has no direction")]
    Round {
        /// Its type.
        class: String,
        /// Its number.
        id: u32,
    },
    /// A direction of an edge.
    #[error("{class} {id} runs along an edge of feature {of}; give that a direction")]
    OfEdge {
        /// Its type.
        class: String,
        /// Its number.
        id: u32,
        /// Whose edge it is.
        of: u32,
    },
    /// A direction that is none in the plan.
    #[error(
        "{class} {id}: a direction must be a vector of three numbers that is not along the axis"
    )]
    Direction {
        /// Its type.
        class: String,
        /// Its number.
        id: u32,
    },
}
