//! Cutters that turn about a vertical axis: flat, ball and bull-nose.

use std::fmt;
use std::str::FromStr;

/// Diameters of cutters, millimetres.
pub const DIAMETERS_MM: std::ops::RangeInclusive<f64> = 0.01..=500.0;

/// A cutter whose end is a flat disc with a rounded corner: flat where the corner has no radius,
/// a ball where there is no disc, a bull-nose between. Its tip is where its axis meets its lowest
/// height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cutter {
    radius_mm: f64,
    corner_mm: f64,
}

/// What a cutter's end looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A disc with a sharp corner.
    Flat,
    /// Half a sphere.
    Ball,
    /// A disc with a rounded corner.
    Bull,
}

/// Why there is no such cutter.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CutterError {
    /// The words are not those of a cutter.
    #[error(
        "`{0}` is no cutter: say ball:DIAMETER, flat:DIAMETER or bull:DIAMETER:CORNER_RADIUS in \
         millimetres, as in ball:6"
    )]
    Words(String),
    /// The diameter lies outside of [`DIAMETERS_MM`].
    #[error("a cutter of {0} mm: the diameter must be 0.01 to 500 mm")]
    Diameter(f64),
    /// The corner does not fit the cutter.
    #[error(
        "a corner of {corner_mm} mm on a cutter of {diameter_mm} mm: it must be above 0 and below \
         half the diameter, else say flat or ball"
    )]
    Corner {
        /// The corner's radius.
        corner_mm: f64,
        /// The cutter's diameter.
        diameter_mm: f64,
    },
}

impl Cutter {
    /// A point, which finds the height of the surface itself.
    pub(crate) const POINT: Self = Self {
        radius_mm: 0.0,
        corner_mm: 0.0,
    };

    /// A flat end of this diameter, millimetres.
    ///
    /// # Errors
    /// [`CutterError::Diameter`]
    pub fn flat(diameter_mm: f64) -> Result<Self, CutterError> {
        let radius_mm = radius(diameter_mm)?;
        Ok(Self {
            radius_mm,
            corner_mm: 0.0,
        })
    }

    /// A ball end of this diameter, millimetres.
    ///
    /// # Errors
    /// [`CutterError::Diameter`]
    pub fn ball(diameter_mm: f64) -> Result<Self, CutterError> {
        let radius_mm = radius(diameter_mm)?;
        Ok(Self {
            radius_mm,
            corner_mm: radius_mm,
        })
    }

    /// A bull-nose of this diameter with this radius of its corner, millimetres.
    ///
    /// # Errors
    /// [`CutterError`]
    pub fn bull(diameter_mm: f64, corner_mm: f64) -> Result<Self, CutterError> {
        let radius_mm = radius(diameter_mm)?;
        if !(corner_mm > 0.0 && corner_mm < radius_mm) {
            return Err(CutterError::Corner {
                corner_mm,
                diameter_mm,
            });
        }
        Ok(Self {
            radius_mm,
            corner_mm,
        })
    }

    /// Half the diameter, millimetres.
    #[must_use]
    pub fn radius_mm(&self) -> f64 {
        self.radius_mm
    }

    /// Radius of the corner: 0 for a flat end, the cutter's own for a ball. Millimetres.
    #[must_use]
    pub fn corner_mm(&self) -> f64 {
        self.corner_mm
    }

    /// Radius of the disc at the end, millimetres.
    #[must_use]
    pub fn disc_mm(&self) -> f64 {
        self.radius_mm - self.corner_mm
    }

    /// What its end looks like.
    #[must_use]
    pub fn kind(&self) -> Kind {
        if self.corner_mm == 0.0 {
            Kind::Flat
        } else if self.corner_mm == self.radius_mm {
            Kind::Ball
        } else {
            Kind::Bull
        }
    }

    /// How far above the tip its surface is at a distance from the axis, both in millimetres;
    /// `None` beyond its radius.
    #[must_use]
    pub fn height_mm(&self, distance_mm: f64) -> Option<f64> {
        (distance_mm <= self.radius_mm).then(|| self.profile(distance_mm))
    }

    /// The same within the radius, by rounding a little beyond it as well.
    pub(crate) fn profile(&self, distance_mm: f64) -> f64 {
        let out = distance_mm - self.disc_mm();
        if out <= 0.0 {
            return 0.0;
        }
        let r = self.corner_mm;
        r - ((r - out) * (r + out)).max(0.0).sqrt()
    }

    /// The cutter around which material stays: larger by `allowance_mm` all around. Its tip is as
    /// much lower.
    pub(crate) fn grown(&self, allowance_mm: f64) -> Self {
        Self {
            radius_mm: self.radius_mm + allowance_mm,
            corner_mm: self.corner_mm + allowance_mm,
        }
    }
}

fn radius(diameter_mm: f64) -> Result<f64, CutterError> {
    if DIAMETERS_MM.contains(&diameter_mm) {
        Ok(diameter_mm / 2.0)
    } else {
        Err(CutterError::Diameter(diameter_mm))
    }
}

impl FromStr for Cutter {
    type Err = CutterError;

    /// `ball:6`, `flat:10`, `bull:10:2`: diameter, and radius of the corner.
    fn from_str(text: &str) -> Result<Self, CutterError> {
        let words = || CutterError::Words(text.to_owned());
        let mut parts = text.split(':');
        let kind = parts.next().unwrap_or_default();
        let numbers: Vec<f64> = parts
            .map(|part| part.trim().parse().map_err(|_| words()))
            .collect::<Result<_, _>>()?;
        match (kind, &numbers[..]) {
            ("ball", [diameter_mm]) => Self::ball(*diameter_mm),
            ("flat", [diameter_mm]) => Self::flat(*diameter_mm),
            ("bull", [diameter_mm, corner_mm]) => Self::bull(*diameter_mm, *corner_mm),
            _ => Err(words()),
        }
    }
}

impl fmt::Display for Cutter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let diameter_mm = 2.0 * self.radius_mm;
        match self.kind() {
            Kind::Flat => write!(f, "flat:{diameter_mm}"),
            Kind::Ball => write!(f, "ball:{diameter_mm}"),
            Kind::Bull => write!(f, "bull:{diameter_mm}:{}", self.corner_mm),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_make_cutters_and_come_back() {
        for text in ["ball:6", "flat:10", "bull:10:2", "bull:0.5:0.125"] {
            let cutter: Cutter = text.parse().unwrap();
            assert_eq!(cutter.to_string(), text);
        }
        let bull: Cutter = "bull:10:2".parse().unwrap();
        assert_eq!((bull.radius_mm(), bull.disc_mm()), (5.0, 3.0));
        assert_eq!(bull.kind(), Kind::Bull);
    }

    #[test]
    fn what_is_no_cutter_is_told() {
        let told = |text: &str| text.parse::<Cutter>().unwrap_err().to_string();
        for text in [
            "", "ball", "ball:", "ball:six", "cone:6", "ball:6:1", "bull:6",
        ] {
            assert!(told(text).contains("is no cutter: say ball:"), "{text}");
        }
        assert!(told("ball:-1").contains("-1 mm: the diameter must be"));
        assert!(told("flat:NaN").contains("the diameter must be"));
        assert!(told("bull:10:5").contains("below half the diameter"));
        assert!(told("bull:10:0").contains("above 0"));
    }

    #[test]
    fn profiles_are_those_of_disc_and_corner() {
        let bull = Cutter::bull(10.0, 2.0).unwrap();
        assert_eq!(bull.height_mm(3.0), Some(0.0));
        assert_eq!(bull.height_mm(5.0), Some(2.0));
        assert_eq!(bull.height_mm(5.1), None);
        let ball = Cutter::ball(10.0).unwrap();
        assert!((ball.height_mm(3.0).unwrap() - 1.0).abs() < 1e-15);
        assert_eq!(Cutter::flat(10.0).unwrap().height_mm(5.0), Some(0.0));
    }
}
