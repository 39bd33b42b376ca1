//! Which kinds of surface faces may be of.

use core::fmt;
use core::str::FromStr;

/// Which kinds of surface faces may be of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Kinds {
    /// Planes, spheres, cylinders, cones and tori where the samples speak for them, else free
    /// forms.
    #[default]
    Auto,
    /// Free forms all. What the samples speak for is told all the same.
    FreeForm,
}

impl Kinds {
    /// Every choice.
    pub const ALL: [Self; 2] = [Self::Auto, Self::FreeForm];

    /// As it is spelt in settings and reports.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::FreeForm => "freeform",
        }
    }
}

impl fmt::Display for Kinds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// What becomes of a region of several surfaces that join smoothly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum SmoothJoins {
    /// It is taken apart into faces of one kind each ([`faces::divide`]).
    #[default]
    Split,
    /// It stays one.
    Keep,
}

impl SmoothJoins {
    /// Every choice.
    pub const ALL: [Self; 2] = [Self::Split, Self::Keep];

    /// As it is spelt in settings and reports.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Split => "split",
            Self::Keep => "keep",
        }
    }
}

/// No such choice.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no choice of kinds; known are auto and freeform")]
pub struct UnknownKinds(pub String);

impl FromStr for Kinds {
    type Err = UnknownKinds;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let known = Self::ALL.into_iter().find(|kinds| kinds.as_str() == text);
        known.ok_or_else(|| UnknownKinds(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_are_read_as_they_are_written() {
        for kinds in Kinds::ALL {
            assert_eq!(kinds.to_string().parse(), Ok(kinds));
        }
        let error = "planes".parse::<Kinds>().unwrap_err().to_string();
        assert!(
            error.contains("`planes`") && error.contains("freeform"),
            "{error}"
        );
    }
}
