//! The road as a whole, applied alike to every stage that knows more than one.

use core::fmt;
use core::str::FromStr;

/// Which road is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Method {
    /// Ours: less noise, borders where the surfaces meet.
    #[default]
    Relief,
    /// Shim & Lee 1995 as printed.
    ShimLee,
}

impl Method {
    /// Every road.
    pub const ALL: [Self; 2] = [Self::Relief, Self::ShimLee];

    /// As it is spelt in settings and reports.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Relief => "relief",
            Self::ShimLee => "shim-lee",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// No such method.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a method; known are relief and shim-lee")]
pub struct UnknownMethod(pub String);

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let known = Self::ALL.into_iter().find(|method| method.as_str() == text);
        known.ok_or_else(|| UnknownMethod(text.to_owned()))
    }
}

impl From<Method> for segment::Method {
    fn from(method: Method) -> Self {
        match method {
            Method::Relief => Self::Relief,
            Method::ShimLee => Self::ShimLee,
        }
    }
}

impl From<Method> for reconstruct::Method {
    fn from(method: Method) -> Self {
        match method {
            Method::Relief => Self::Relief,
            Method::ShimLee => Self::ShimLee,
        }
    }
}

impl From<reconstruct::Method> for Method {
    fn from(method: reconstruct::Method) -> Self {
        match method {
            reconstruct::Method::Relief => Self::Relief,
            reconstruct::Method::ShimLee => Self::ShimLee,
        }
    }
}
