//! What can be chosen.

use crate::error::CompareError;

/// How the scan is brought onto the nominal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Alignment {
    /// By best fit, from many starts if need be.
    #[default]
    BestFit,
    /// Not at all: both are in one frame.
    AsPlaced,
}

impl Alignment {
    /// As it is spelt in options and reports.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::BestFit => "best-fit",
            Self::AsPlaced => "as-placed",
        }
    }
}

/// Least and greatest deviation allowed, millimetres; positive means more material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Least, usually negative.
    pub lower_mm: f64,
    /// Greatest.
    pub upper_mm: f64,
}

/// Settings of [`crate::compare`](fn@crate::compare).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompareSettings {
    /// How the scan is brought onto the nominal. Default [`Alignment::BestFit`].
    pub alignment: Alignment,
    /// Deviations allowed. `None` (default): none that is significant, of more than a tenth of
    /// the noise of single samples, below which systematic errors of scanner and registration lie.
    pub tolerance: Option<Tolerance>,
    /// Points farther than this from the nominal belong to something else, millimetres. `None`
    /// (default): 2 mm, ten times the noise, or three times the tolerance, whatever is most.
    pub limit_mm: Option<f64>,
    /// Diameter of the smallest patch that is averaged, millimetres; others are twice, four and
    /// eight times as wide. `None` (default): 5.5 times the distance of samples, which makes 24
    /// samples that are worth 18 in the middle.
    pub patch_mm: Option<f64>,
    /// Probability that anything is found on a scan of a part that just meets its limits
    /// everywhere. Default 0.01.
    pub false_alarm: f64,
    /// A best fit that leaves fewer nodes than this near the nominal is an error, 0 to 1.
    /// Default 0.5.
    pub least_near_share: f64,
}

impl Default for CompareSettings {
    fn default() -> Self {
        Self {
            alignment: Alignment::default(),
            tolerance: None,
            limit_mm: None,
            patch_mm: None,
            false_alarm: 0.01,
            least_near_share: 0.5,
        }
    }
}

impl CompareSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`CompareError::Setting`] with the first that is out of its range.
    pub fn validate(&self) -> Result<(), CompareError> {
        let refused = |name, value, must| Err(CompareError::Setting { name, value, must });
        if let Some(Tolerance { lower_mm, upper_mm }) = self.tolerance {
            if !(upper_mm.is_finite() && upper_mm.abs() <= 1e3) {
                return refused("upper_mm", upper_mm, "a length of at most 1000 mm");
            }
            if !(lower_mm.is_finite() && lower_mm.abs() <= 1e3) {
                return refused("lower_mm", lower_mm, "a length of at most 1000 mm");
            }
            if lower_mm >= upper_mm {
                return refused("lower_mm", lower_mm, "less than upper_mm");
            }
        }
        for (name, value) in [("limit_mm", self.limit_mm), ("patch_mm", self.patch_mm)] {
            if let Some(value) = value
                && !(1e-3..=1e3).contains(&value)
            {
                return refused(name, value, "from 0.001 to 1000 mm");
            }
        }
        if !(1e-12..=0.5).contains(&self.false_alarm) {
            return refused("false_alarm", self.false_alarm, "from 1e-12 to 0.5");
        }
        if !(0.0..=1.0).contains(&self.least_near_share) {
            return refused("least_near_share", self.least_near_share, "from 0 to 1");
        }
        Ok(())
    }
}
