//! What the user may choose, with units and limits.

/// Settings of [`regularize`](crate::regularize).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// How many standard uncertainties a regularity may be off, 1 to 6. One that ties several
    /// numbers at once may be off as far as is as unlikely. A true one is refused once in 370
    /// times at 3, which is the default, if the uncertainties are what they say.
    pub bound: f64,
    /// How often a part without any regularity of a kind may be given one by chance, above 0 and
    /// at most 0.5: once in 20 times by default. The more there are to try, the nearer each has
    /// to be.
    pub chance: f64,
    /// No place and no size is moved farther than this, millimetres, positive; 0.25 by default.
    pub most_mm: f64,
    /// No direction and no half angle is turned farther than this, radians, positive; 2 degrees
    /// by default.
    pub most_rad: f64,
    /// Which numbers are round.
    pub round: Round,
    /// Whether directions at 30, 45 and 60 degrees to each other count, too.
    pub angles: bool,
    /// Whether directions along and across the axes of the part frame count, too: not a property
    /// of the part, but of how it lies.
    pub frame: bool,
}

/// Which numbers are round.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Round {
    /// Whole millimetres, halves, quarters and tenths.
    #[default]
    Millimetre,
    /// Whole inches of 25.4 mm, halves, quarters, eighths, 16ths, 32nds and 64ths.
    Inch,
}

/// A setting outside of its limits. The message says which, its limits, and its value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what} must lie {limits}, not {value}")]
pub struct SettingsError {
    what: &'static str,
    limits: &'static str,
    value: f64,
}

/// Lengths or angles that are multiples of a part of a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grid {
    unit: f64,
    parts: f64,
}

impl Grid {
    /// Distance of its lines.
    pub(crate) fn pitch(self) -> f64 {
        self.unit / self.parts
    }

    /// Its line nearest to a value, where that is not 0.
    pub(crate) fn nearest(self, value: f64) -> Option<f64> {
        let times = (value / self.pitch()).round();
        // Not by the pitch, which tenths are not exactly.
        (times >= 1.0).then_some(times * self.unit / self.parts)
    }
}

/// One inch, millimetres.
const INCH_MM: f64 = 25.4;

const fn grid(unit: f64, parts: f64) -> Grid {
    Grid { unit, parts }
}

impl Round {
    /// The grids of lengths that are tried, the coarsest first, millimetres.
    pub(crate) fn grids_mm(self) -> Vec<Grid> {
        let (unit, parts): (_, &[f64]) = match self {
            Self::Millimetre => (1.0, &[1.0, 2.0, 4.0, 10.0]),
            Self::Inch => (INCH_MM, &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
        };
        parts.iter().map(|parts| grid(unit, *parts)).collect()
    }
}

/// The grids of half angles that are tried, the coarsest first, degrees.
pub(crate) const ANGLE_GRIDS_DEG: [Grid; 3] = [grid(5.0, 1.0), grid(1.0, 1.0), grid(1.0, 2.0)];
/// Angles between directions that are round, degrees.
pub(crate) const ROUND_ANGLES_DEG: [f64; 3] = [30.0, 45.0, 60.0];

impl Settings {
    /// Limits of [`Settings::bound`].
    pub const BOUNDS: (f64, f64) = (1.0, 6.0);

    /// Checks every setting against its limits.
    ///
    /// # Errors
    /// The first setting that lies outside.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let (low, high) = Self::BOUNDS;
        let is_positive = |value: f64| value > 0.0 && value.is_finite();
        let checks = [
            (
                (low..=high).contains(&self.bound),
                "the bound of regularities, in standard uncertainties,",
                "between 1 and 6",
                self.bound,
            ),
            (
                self.chance > 0.0 && self.chance <= 0.5,
                "the chance of a regularity that is none",
                "above 0 and at 0.5 at most",
                self.chance,
            ),
            (
                is_positive(self.most_mm),
                "the most that regularities move anything, in mm,",
                "above 0",
                self.most_mm,
            ),
            (
                is_positive(self.most_rad),
                "the most that regularities turn anything, in radians,",
                "above 0",
                self.most_rad,
            ),
        ];
        match checks.into_iter().find(|(is_met, ..)| !is_met) {
            None => Ok(()),
            Some((_, what, limits, value)) => Err(SettingsError {
                what,
                limits,
                value,
            }),
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            bound: 3.0,
            chance: 0.05,
            most_mm: 0.25,
            most_rad: 2.0_f64.to_radians(),
            round: Round::default(),
            angles: false,
            frame: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_rounded_to_nothing() {
        assert_eq!(grid(1.0, 2.0).nearest(7.98), Some(8.0));
        assert_eq!(grid(1.0, 10.0).nearest(7.31), Some(7.3));
        assert_eq!(grid(1.0, 2.0).nearest(0.2), None);
        assert_eq!(grid(1.0, 2.0).nearest(f64::NAN), None);
    }

    #[test]
    fn settings_outside_their_limits_are_named() {
        assert_eq!(Settings::default().validate(), Ok(()));
        let refused = |change: fn(&mut Settings)| {
            let mut settings = Settings::default();
            change(&mut settings);
            settings.validate().unwrap_err().to_string()
        };
        let bound = refused(|s| s.bound = 0.5);
        assert!(bound.contains("bound") && bound.contains("0.5"), "{bound}");
        assert!(refused(|s| s.bound = f64::NAN).contains("between 1 and 6"));
        assert!(refused(|s| s.chance = 0.0).contains("chance"));
        assert!(refused(|s| s.most_mm = f64::INFINITY).contains("mm"));
        assert!(refused(|s| s.most_rad = -1.0).contains("radians"));
    }
}
