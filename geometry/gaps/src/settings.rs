//! What may be chosen.

use core::fmt;
use core::str::FromStr;

/// Which gaps are closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Mode {
    /// None; they are not even looked for.
    #[default]
    Off,
    /// Those that are no openings, as far as can be told.
    Auto,
    /// All that are small enough.
    All,
}

impl Mode {
    /// Every mode.
    pub const ALL: [Self; 3] = [Self::Off, Self::Auto, Self::All];

    /// As it is spelt in settings and reports.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Auto => "auto",
            Self::All => "all",
        }
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// No such mode.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no way to fill holes; known are off, auto and all")]
pub struct UnknownMode(pub String);

impl FromStr for Mode {
    type Err = UnknownMode;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let known = Self::ALL.into_iter().find(|mode| mode.as_str() == text);
        known.ok_or_else(|| UnknownMode(text.to_owned()))
    }
}

/// Which gaps are closed, and which are not whatever the evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Which.
    pub mode: Mode,
    /// Diameter of the largest circle that fits into a gap, millimetres, up to which it is closed.
    pub max_size_mm: f64,
    /// The gaps at these places, x and y in millimetres, stay open.
    pub keep_mm: Vec<[f64; 2]>,
    /// The gaps at these places, x and y in millimetres, are closed, whatever their size.
    pub close_mm: Vec<[f64; 2]>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            mode: Mode::Off,
            max_size_mm: 10.0,
            keep_mm: Vec::new(),
            close_mm: Vec::new(),
        }
    }
}

/// Greatest size that may be asked for, millimetres.
pub(crate) const MAX_SIZE_MM: f64 = 1000.0;

/// A setting that cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// The size is none.
    #[error("max_size_mm must be above 0 and at most 1000, not {0}")]
    Size(f64),
    /// A place is none.
    #[error("a place to keep or close must be two finite numbers, not [{}, {}]", .0[0], .0[1])]
    Place([f64; 2]),
}

impl Settings {
    /// Whether all are within their limits.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), SettingsError> {
        if !(self.max_size_mm > 0.0 && self.max_size_mm <= MAX_SIZE_MM) {
            return Err(SettingsError::Size(self.max_size_mm));
        }
        let places = self.keep_mm.iter().chain(&self.close_mm);
        let mut wrong = places.filter(|place| !place.iter().all(|own| own.is_finite()));
        wrong
            .next()
            .map_or(Ok(()), |place| Err(SettingsError::Place(*place)))
    }
}
