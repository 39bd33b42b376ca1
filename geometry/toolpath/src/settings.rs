//! How a surface is to be milled.

use crate::cutter::Cutter;
use crate::error::ToolpathError;

/// The pattern of finishing passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    /// Straight as seen from above; the highest cusp between two is what is asked for.
    Parallel,
    /// Bent so that cusps are as high as asked for all along. For ball cutters.
    Scallop,
}

/// How a surface is to be milled.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The cutter that finishes it.
    pub finish: Cutter,
    /// The cutter that takes away most of the stock before, if there is one.
    pub rough: Option<Cutter>,
    /// Height of the cusps between finishing passes, above the surface and along its normal,
    /// millimetres.
    pub scallop_mm: f64,
    /// How far above where the cutter just touches it may be led, millimetres.
    pub tolerance_mm: f64,
    /// The pattern of finishing passes.
    pub pattern: Pattern,
    /// Direction of passes, degrees from x towards y.
    pub angle_deg: f64,
    /// What roughing leaves on the surface, millimetres along its normal.
    pub allowance_mm: f64,
    /// Whether arcs are fitted (G2, G3).
    pub arcs: bool,
}

impl Settings {
    /// Finishing alone with this cutter.
    #[must_use]
    pub fn finishing(finish: Cutter) -> Self {
        Self {
            finish,
            rough: None,
            scallop_mm: 0.01,
            tolerance_mm: 0.005,
            pattern: Pattern::Parallel,
            angle_deg: 0.0,
            allowance_mm: 0.3,
            arcs: true,
        }
    }

    /// Whether all settings are within their limits.
    ///
    /// # Errors
    /// [`ToolpathError::Setting`], [`ToolpathError::NeedsBall`]
    pub fn validate(&self) -> Result<(), ToolpathError> {
        let limits = [
            ("scallop_mm", self.scallop_mm, 1e-4, 10.0, "0.0001 to 10"),
            ("tolerance_mm", self.tolerance_mm, 1e-4, 1.0, "0.0001 to 1"),
            ("angle_deg", self.angle_deg, -360.0, 360.0, "-360 to 360"),
            ("allowance_mm", self.allowance_mm, 0.01, 10.0, "0.01 to 10"),
        ];
        for (name, value, low, high, must) in limits {
            if !(low..=high).contains(&value) {
                return Err(ToolpathError::Setting { name, value, must });
            }
        }
        let corner = match self.finish.corner_mm() {
            0.0 => self.finish.radius_mm(),
            corner => corner,
        };
        if self.scallop_mm >= 0.5 * corner {
            return Err(ToolpathError::Setting {
                name: "scallop_mm",
                value: self.scallop_mm,
                must: "less than half the radius of the finishing cutter, or of its corner",
            });
        }
        if self.pattern == Pattern::Scallop && self.finish.disc_mm() > 0.0 {
            return Err(ToolpathError::NeedsBall(self.finish));
        }
        Ok(())
    }
}
