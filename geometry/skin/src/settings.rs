//! What the user may choose.

/// How a surface is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Common knots for all sections from the start, their places and number chosen together.
    #[default]
    Relief,
    /// The paper's: each section for itself, open at its seam, then knots merged and removed.
    Jo,
}

/// What the user may choose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// No data point is farther from the surface than this, millimetres.
    pub tolerance_mm: f64,
    /// How.
    pub method: Method,
    /// Degree of the surface across the sections, 1 to 5; lower where there are fewer sections.
    pub degree_across: usize,
    /// Whether sections are turned to one sense. If not, mixed senses are an error.
    pub turn_sections: bool,
}

/// Highest degree across sections.
const MOST_DEGREE: usize = 5;

impl Settings {
    /// The defaults at a tolerance, millimetres.
    #[must_use]
    pub fn new(tolerance_mm: f64) -> Self {
        Self {
            tolerance_mm,
            method: Method::default(),
            degree_across: 3,
            turn_sections: true,
        }
    }

    /// Whether all settings are within their limits.
    ///
    /// # Errors
    /// [`SettingsError`]
    pub fn check(&self) -> Result<(), SettingsError> {
        if !(self.tolerance_mm.is_finite() && self.tolerance_mm > 0.0) {
            return Err(SettingsError::Tolerance(self.tolerance_mm));
        }
        if !(1..=MOST_DEGREE).contains(&self.degree_across) {
            return Err(SettingsError::Degree(self.degree_across));
        }
        Ok(())
    }
}

/// A setting that cannot be.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// Not a length.
    #[error("the tolerance must be a length above 0 mm, and {0} is not")]
    Tolerance(f64),
    /// Not a degree that is offered.
    #[error("the degree across sections must be 1 to {MOST_DEGREE}, and {0} is not")]
    Degree(usize),
}
