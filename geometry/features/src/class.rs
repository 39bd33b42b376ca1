//! What a feature can be.

/// A class of features that Relief has a meaning for. The first six are those of Jun & Park, Table 1,
/// in the order of Table 2. Networks know classes by their names alone, so that users add theirs
/// without code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// A closed hollow with a floor that is not round.
    Pocket,
    /// A hollow that runs out at one side of the part, with one wall or two that meet.
    Step,
    /// A hollow between two walls that runs out at one end or both.
    Slot,
    /// What stands out of its surroundings, round or not.
    Boss,
    /// A round hollow, through or not.
    Hole,
    /// The body that the others are cut into and stand on.
    Block,
    /// A round hollow that narrows by a level ring: a counterbore.
    SteppedHole,
    /// A round hollow that narrows by a cone.
    CountersunkHole,
}

impl Class {
    /// All, in the order of the outputs of the published network.
    pub const ALL: [Self; 6] = [
        Self::Pocket,
        Self::Step,
        Self::Slot,
        Self::Boss,
        Self::Hole,
        Self::Block,
    ];

    /// What the default network is taught, in the order of its outputs.
    pub const TAUGHT: [Self; 8] = [
        Self::Pocket,
        Self::Step,
        Self::Slot,
        Self::Boss,
        Self::Hole,
        Self::Block,
        Self::SteppedHole,
        Self::CountersunkHole,
    ];

    /// The class of a name, if it is one of these.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::TAUGHT.into_iter().find(|own| own.as_str() == name)
    }

    /// Its name in files.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Pocket => "pocket",
            Self::Step => "step",
            Self::Slot => "slot",
            Self::Boss => "boss",
            Self::Hole => "hole",
            Self::Block => "block",
            Self::SteppedHole => "stepped_hole",
            Self::CountersunkHole => "countersunk_hole",
        }
    }
}
