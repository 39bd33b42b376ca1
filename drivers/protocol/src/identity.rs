//! All that a device says about itself.

use crate::commands::{Calibration, Limits, Nameplate};
use crate::wire::Text;

/// All that a device says about itself, put together from three replies: one frame is
/// too small for it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// Name of the model.
    pub model: Text,
    /// Serial number.
    pub serial: Text,
    /// Version of the firmware.
    pub firmware: Text,
    /// What counts mean.
    pub calibration: Calibration,
    /// What the device can do.
    pub limits: Limits,
}

impl Identity {
    /// Puts the three replies together.
    #[must_use]
    pub fn new(nameplate: Nameplate, calibration: Calibration, limits: Limits) -> Self {
        Self {
            model: nameplate.model,
            serial: nameplate.serial,
            firmware: nameplate.firmware,
            calibration,
            limits,
        }
    }

    /// The part that answers [`crate::commands::Identify`].
    #[must_use]
    pub fn nameplate(&self) -> Nameplate {
        Nameplate {
            model: self.model.clone(),
            serial: self.serial.clone(),
            firmware: self.firmware.clone(),
        }
    }
}
