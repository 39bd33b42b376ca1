//! What the user may choose, with units and limits.

use core::fmt;

/// Which road is taken from nodes to regions; see the [crate].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Shim & Lee 1995, section II.2: clusters of normals and positions, merged. The baseline.
    ShimLee,
    /// Surfaces that grow from the flattest places and compete for nodes.
    #[default]
    Relief,
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ShimLee => "shim-lee",
            Self::Relief => "relief",
        })
    }
}

/// Settings of [`segment`](crate::segment).
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentSettings {
    /// Which road is taken.
    pub method: Method,
    /// Number of clusters B before merging, 1 to [`MAX_CLUSTERS`](Self::MAX_CLUSTERS), of
    /// [`Method::ShimLee`] alone. The paper uses 20. More cost time only, since what is split
    /// needlessly is merged again.
    pub clusters: usize,
    /// Two regions are kept apart where their surfaces meet at a greater change of direction
    /// than this, radians, above 0 and at most pi/2. 0 is a smooth passage.
    pub crease_angle_rad: f64,
    /// Two regions are kept apart where one lies further off the other's continuation than
    /// this many pitches of the image, positive. Never less than six times the noise that is
    /// measured in the image itself.
    pub step_factor: f64,
    /// Regions with fewer nodes than this stay unlabelled, at least 1.
    pub minimum_nodes: usize,
    /// Regions that cover less than this, seen from the camera, stay unlabelled, square
    /// millimetres; 0 for no such limit.
    pub minimum_area_mm2: f64,
    /// Whether regions also begin where a quadric fits and no plane does, which finds rounds and
    /// flanks of ridges that are only so many nodes wide. For free forms with creases: on parts of
    /// planes, cylinders and the like such regions take nodes from their neighbours.
    /// [`Method::Relief`] alone.
    pub bent_seeds: bool,
    /// Seed of the clustering's random starts; [`Method::Relief`] draws nothing.
    pub seed: u64,
}

impl Default for SegmentSettings {
    fn default() -> Self {
        Self {
            method: Method::default(),
            clusters: 20,
            crease_angle_rad: 0.1,
            step_factor: 1.0,
            minimum_nodes: 25,
            minimum_area_mm2: 0.0,
            bent_seeds: false,
            seed: 0,
        }
    }
}

/// A setting lies outside its limits.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// Number of clusters.
    #[error("clusters is {0}, but must be 1 to {max}", max = SegmentSettings::MAX_CLUSTERS)]
    Clusters(usize),
    /// Crease angle.
    #[error("crease_angle_rad is {0}, but must be above 0 and at most pi/2")]
    CreaseAngle(f64),
    /// Step factor.
    #[error("step_factor is {0}, but must be positive and finite")]
    StepFactor(f64),
    /// Minimum size of a region.
    #[error("minimum_nodes is 0, but a region has at least 1 node")]
    MinimumNodes,
    /// Minimum area of a region.
    #[error("minimum_area_mm2 is {0}, but must be 0 or more, and finite")]
    MinimumArea(f64),
}

impl SegmentSettings {
    /// Upper limit of `clusters`: the work grows with it, and 20 are ample in practice.
    pub const MAX_CLUSTERS: usize = 1000;

    /// Checks every setting against its limits.
    ///
    /// # Errors
    /// The first setting that lies outside.
    pub fn validate(&self) -> Result<(), SettingsError> {
        if self.clusters == 0 || self.clusters > Self::MAX_CLUSTERS {
            return Err(SettingsError::Clusters(self.clusters));
        }
        let angle = self.crease_angle_rad;
        if !(angle > 0.0 && angle <= core::f64::consts::FRAC_PI_2) {
            return Err(SettingsError::CreaseAngle(angle));
        }
        if !(self.step_factor > 0.0 && self.step_factor.is_finite()) {
            return Err(SettingsError::StepFactor(self.step_factor));
        }
        if self.minimum_nodes == 0 {
            return Err(SettingsError::MinimumNodes);
        }
        if !(self.minimum_area_mm2 >= 0.0 && self.minimum_area_mm2.is_finite()) {
            return Err(SettingsError::MinimumArea(self.minimum_area_mm2));
        }
        Ok(())
    }

    /// Fewest nodes of a region on a grid of this pitch, millimetres.
    pub(crate) fn fewest_nodes(&self, pitch_mm: f64) -> usize {
        let by_area = libm::ceil(self.minimum_area_mm2 / (pitch_mm * pitch_mm));
        self.minimum_nodes.max(by_area as usize)
    }
}
