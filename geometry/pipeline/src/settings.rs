//! The settings of every stage, and their agreement with each other.

use reconstruct::ReconstructSettings;
use regrid::{Estimator, RegridSettings};
use segment::SegmentSettings;

use crate::{BackgroundPolicy, FillSettings, Kinds, Method, SmoothJoins};

/// The settings of every stage that can change the result.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// From columns to the range image.
    pub regrid: RegridSettings,
    /// From the range image to regions.
    pub segment: SegmentSettings,
    /// What is done with a recognised table or back plane.
    pub background: BackgroundPolicy,
    /// Which enclosed holes of the range image are closed; method `relief` only.
    pub fill: FillSettings,
    /// Which kinds of surface faces may be of; method `relief` only.
    pub kinds: Kinds,
    /// Whether regions whose surfaces join smoothly are taken apart; kinds `auto` of method
    /// `relief` only.
    pub smooth_joins: SmoothJoins,
    /// Whether shapes are given the regularities that they are likely to have; kinds `auto` of
    /// method `relief` only, and only where the samples are at hand.
    pub regularize: Regularize,
    /// From regions to the model.
    pub reconstruct: ReconstructSettings,
}

/// Whether regularities among the shapes of regions are looked for, and imposed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Regularize {
    /// Each shape is what its own samples say.
    #[default]
    Off,
    /// Shapes are parallel, coaxial, of equal radii and so on where their uncertainties allow of
    /// it ([`regularize::regularize`]).
    On(regularize::Settings),
}

impl Regularize {
    /// The bound, in standard uncertainties; `None` where it is off.
    #[must_use]
    pub fn bound(&self) -> Option<f64> {
        match self {
            Self::Off => None,
            Self::On(settings) => Some(settings.bound),
        }
    }
}

/// A setting that cannot be used. The message says which, its limits, and its value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{stage}: {message}")]
pub struct SettingsError {
    /// The stage it belongs to: `regrid`, `segment`, `fill` or `reconstruct`.
    pub stage: &'static str,
    /// What is wrong with it, and its limits.
    pub message: String,
}

impl Settings {
    /// Defaults for a grid of this pitch, millimetres, with seed 1.
    #[must_use]
    pub fn new(pitch_mm: f64) -> Self {
        Self {
            regrid: RegridSettings::with_pitch(pitch_mm),
            segment: SegmentSettings::default(),
            background: BackgroundPolicy::default(),
            fill: FillSettings::default(),
            kinds: Kinds::default(),
            smooth_joins: SmoothJoins::default(),
            regularize: Regularize::default(),
            reconstruct: ReconstructSettings::default(),
        }
        .with_seed(1)
    }

    /// The same settings on one road throughout, the regridder's estimator with its windows
    /// included.
    #[must_use]
    pub fn with_method(mut self, method: Method) -> Self {
        self.regrid = self.regrid.with_estimator(match method {
            Method::Relief => Estimator::default(),
            Method::ShimLee => Estimator::LeastMedian,
        });
        self.segment.method = method.into();
        self.reconstruct.method = method.into();
        self
    }

    /// The same settings with this seed for every random draw.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.regrid.seed = seed;
        self.segment.seed = seed;
        self
    }

    /// The road taken in reconstruction, which names the whole.
    #[must_use]
    pub fn method(&self) -> Method {
        self.reconstruct.method.into()
    }

    /// Checks every setting against its limits.
    ///
    /// # Errors
    /// The first setting that lies outside.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let wrong = |stage, error: &dyn core::error::Error| SettingsError {
            stage,
            message: error.to_string(),
        };
        self.regrid
            .validate()
            .map_err(|error| wrong("regrid", &error))?;
        self.segment
            .validate()
            .map_err(|error| wrong("segment", &error))?;
        self.fill
            .validate()
            .map_err(|error| wrong("fill", &error))?;
        if let Regularize::On(settings) = &self.regularize {
            settings
                .validate()
                .map_err(|error| wrong("reconstruct", &error))?;
        }
        self.reconstruct
            .validate()
            .map_err(|error| wrong("reconstruct", &error))
    }
}
