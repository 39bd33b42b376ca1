//! What can be chosen.

/// Settings of [`crate::tessellate`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TessellateSettings {
    /// Farthest that a triangle may lie off its face's surface, and a straight side off the edge
    /// that it stands for, millimetres.
    pub tolerance_mm: f64,
    /// Most that a surface may turn within a triangle, and an edge within a side, radians. What is
    /// smaller than [`TessellateSettings::SMALL`] tolerances may turn more.
    pub angle_rad: f64,
    /// A crease is shared where the heights of its two faces are as near as this, millimetres; the
    /// triangles of both then meet half way between. Where they part, each face has its own.
    pub sharing_mm: f64,
}

impl Default for TessellateSettings {
    /// A hundredth of a millimetre, 15 degrees, and creases shared as in STEP files.
    fn default() -> Self {
        Self {
            tolerance_mm: 0.01,
            angle_rad: 15.0_f64.to_radians(),
            sharing_mm: 0.05,
        }
    }
}

/// A setting that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{name} is {value}; expected {expected}")]
pub struct SettingsError {
    /// Name of the setting.
    pub name: &'static str,
    /// What was given.
    pub value: f64,
    /// What can be.
    pub expected: &'static str,
}

impl TessellateSettings {
    /// Triangles and sides shorter than this many tolerances are not divided for their angle.
    pub const SMALL: f64 = 5.0;

    /// Least and greatest tolerance, millimetres. Finer ones are below what single precision keeps
    /// of a part of this size; coarser ones leave nothing of it.
    pub const TOLERANCES_MM: [f64; 2] = [1e-4, 10.0];

    /// Checks every setting.
    ///
    /// # Errors
    /// The first that cannot be, by its name.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let [least, most] = Self::TOLERANCES_MM;
        let checks = [
            (
                "tolerance_mm",
                self.tolerance_mm,
                (least..=most).contains(&self.tolerance_mm),
                "a distance between 0.0001 and 10 mm",
            ),
            (
                "angle_rad",
                self.angle_rad,
                (0.01..=1.6).contains(&self.angle_rad),
                "an angle between 0.01 and 1.6 radians",
            ),
            (
                "sharing_mm",
                self.sharing_mm,
                (0.0..=1.0).contains(&self.sharing_mm),
                "a gap between 0 and 1 mm",
            ),
        ];
        let wrong = checks.into_iter().find(|(_, _, is_right, _)| !is_right);
        wrong.map_or(Ok(()), |(name, value, _, expected)| {
            Err(SettingsError {
                name,
                value,
                expected,
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_settings_are_named() {
        let right = TessellateSettings::default();
        assert_eq!(right.validate(), Ok(()));
        let named = |change: fn(&mut TessellateSettings)| {
            let mut settings = right;
            change(&mut settings);
            settings.validate().unwrap_err().name
        };
        assert_eq!(named(|s| s.tolerance_mm = 0.0), "tolerance_mm");
        assert_eq!(named(|s| s.tolerance_mm = f64::NAN), "tolerance_mm");
        assert_eq!(named(|s| s.angle_rad = 2.0), "angle_rad");
        assert_eq!(named(|s| s.sharing_mm = -0.1), "sharing_mm");
    }
}
