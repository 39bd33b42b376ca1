//! How the caller learns which stage is at work, so that it can time and show stages.

use core::fmt;

use range_image::{Monitor, Unmonitored};

/// A stage of the road from columns to deliverables, in the order in which they run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stage {
    /// Columns become a uniform range image. Not seen where the image came from a
    /// streaming regridder.
    Regrid,
    /// The range image becomes regions of one surface each.
    Segment,
    /// The regions become a model: extension, surface fits, borders, trimming.
    Reconstruct,
    /// The model becomes a CAD file.
    Export,
    /// One B-spline surface is made of the range image, where that is asked for.
    Surface,
    /// A surface is skinned over sections of it, where that is asked for.
    Skin,
    /// The milling of the model is planned and simulated, where that is asked for.
    Toolpath,
    /// Machining features are recognised, where that is asked for.
    Features,
    /// The pictures are drawn.
    Pictures,
}

impl Stage {
    /// Every stage, in order.
    pub const ALL: [Self; 9] = [
        Self::Regrid,
        Self::Segment,
        Self::Reconstruct,
        Self::Export,
        Self::Surface,
        Self::Skin,
        Self::Toolpath,
        Self::Features,
        Self::Pictures,
    ];

    /// As it is spelt in reports and events.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Regrid => "regrid",
            Self::Segment => "segment",
            Self::Reconstruct => "reconstruct",
            Self::Export => "export",
            Self::Surface => "surface",
            Self::Skin => "skin",
            Self::Toolpath => "toolpath",
            Self::Features => "features",
            Self::Pictures => "pictures",
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// A monitor that is also told which stage begins. [`Monitor::progress`] starts anew
/// with each stage.
pub trait Observer: Monitor {
    /// This stage begins; the one before it has ended.
    fn stage(&self, stage: Stage);
}

impl Observer for Unmonitored {
    fn stage(&self, _stage: Stage) {}
}
