//! Settings of the regridder.

use core::cmp::Ordering;
use core::fmt;

use crate::least_median::GREATEST_WINDOW;

/// How z at a node is estimated from its window of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Estimator {
    /// Local consensus. The noise is taken from the second differences along the columns
    /// within reach. A plane is rated by a bounded score in its units, near samples more
    /// than far ones, and must be borne out by neighbouring columns, since outliers may come
    /// in runs along one. Where the samples left over agree on another surface, the line
    /// between the samples of both tells on which of them the node is. z is that of the
    /// least-squares plane of the samples that agree with its surface. Holds where most of
    /// the window is wrong, as next to a step edge.
    #[default]
    Consensus,
    /// Least median of squared residuals (MLMS), the paper's: stands up to almost half of
    /// the window being wrong, and keeps step edges but where outliers are many.
    LeastMedian,
    /// The same over all triples of the window's samples instead of some, each plane shifted
    /// to where its median is least: the objective's true minimum, to compare with. Slow:
    /// its time grows with the fourth power of the window.
    ExhaustiveLeastMedian,
    /// The least-squares plane, for comparison: one outlier moves it, step edges smear.
    LeastSquares,
}

impl Estimator {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::Consensus,
        Self::LeastMedian,
        Self::ExhaustiveLeastMedian,
        Self::LeastSquares,
    ];

    /// As it is spelt in settings and reports.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Consensus => "consensus",
            Self::LeastMedian => "least-median",
            Self::ExhaustiveLeastMedian => "exhaustive-least-median",
            Self::LeastSquares => "least-squares",
        }
    }

    /// M, the samples in a node's window, where nothing else is set: 32 as in the paper, 49
    /// for others, for which more samples withstand more outliers and are less noise.
    #[must_use]
    pub fn neighbours(self) -> usize {
        match self {
            Self::LeastMedian | Self::ExhaustiveLeastMedian => 32,
            Self::Consensus | Self::LeastSquares => 49,
        }
    }

    /// Columns on either side that a window may reach into, where nothing else is set:
    /// consensus follows step edges farther than its window.
    #[must_use]
    pub fn reach_columns(self) -> usize {
        match self {
            Self::Consensus => 20,
            Self::LeastMedian | Self::ExhaustiveLeastMedian | Self::LeastSquares => 8,
        }
    }
}

/// The region of interest, millimetres in the part frame, limits included. Samples
/// outside of it are ignored, nodes outside of it in x and y are masked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roi {
    /// Least and greatest x.
    pub x_mm: (f64, f64),
    /// Least and greatest y.
    pub y_mm: (f64, f64),
    /// Least and greatest z.
    pub z_mm: (f64, f64),
}

impl Default for Roi {
    /// Everything.
    fn default() -> Self {
        let all = (f64::NEG_INFINITY, f64::INFINITY);
        Self {
            x_mm: all,
            y_mm: all,
            z_mm: all,
        }
    }
}

impl fmt::Display for Roi {
    /// Such as `x -50 to 50 mm, z from -30 mm`; `everything` without limits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for (axis, (low, high)) in [("x", self.x_mm), ("y", self.y_mm), ("z", self.z_mm)] {
            match (low.is_finite(), high.is_finite()) {
                (true, true) => write!(f, "{separator}{axis} {low} to {high} mm")?,
                (true, false) => write!(f, "{separator}{axis} from {low} mm")?,
                (false, true) => write!(f, "{separator}{axis} up to {high} mm")?,
                (false, false) => continue,
            }
            separator = ", ";
        }
        if separator.is_empty() {
            f.write_str("everything")?;
        }
        Ok(())
    }
}

/// When a node has samples enough around it to get a value.
///
/// Lengths are in local spacings: the square root of column spacing times sample spacing
/// (the side of the square that holds one sample on average), but in x at least the column
/// spacing and in y at least half the sample spacing, so that stretched patterns count as
/// closed too. Both spacings are taken from the node's surroundings, so they follow the
/// scan.
///
/// A node is supported when its plane's inliers within `radius` number at least
/// `least_samples`, and the node lies in their convex hull or no farther than `margin`
/// from it. The hull makes a lone dropout or outlier harmless, since its neighbours
/// surround it; the margin undoes that the outermost samples lie inside the true outline,
/// by half a spacing or less.
///
/// By consensus the inliers within twice the radius count where they surround the node and no
/// sample is missing there: outliers lie in its surface's stead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupportSettings {
    /// Radius in which inliers count. Larger closes larger gaps, and fills concave corners
    /// of the outline by about `radius^2 / 2R` spacings at a radius of curvature of R
    /// spacings. Default 2.
    pub radius: f64,
    /// How far outside the hull of its inliers a node may lie. Default 0.4.
    pub margin: f64,
    /// The same where samples of another surface close the gap on the other side, as at a
    /// step edge: a little more than half, so that one of the two gets the node. By consensus
    /// half the diagonal of a square of samples at the default, since there the line of the
    /// edge tells which of the two, and farther in proportion where outliers leave the samples thinner. Default 0.6.
    pub step_margin: f64,
    /// Least number of inliers within the radius. Default 3.
    pub least_samples: usize,
    /// Samples are inliers within 2.5 robust standard deviations of the plane, and always
    /// within this many spacings of it (so that coarsely quantised depths stay inliers).
    /// Default 0.5.
    pub inlier_floor: f64,
    /// A plane whose 2.5 robust standard deviations exceed this many spacings describes no
    /// surface, only stray samples. Default 6.
    pub inlier_ceiling: f64,
}

impl Default for SupportSettings {
    fn default() -> Self {
        Self {
            radius: 2.0,
            margin: 0.4,
            step_margin: 0.6,
            least_samples: 3,
            inlier_floor: 0.5,
            inlier_ceiling: 6.0,
        }
    }
}

/// Settings of [`crate::Regridder`] and [`crate::regrid`](fn@crate::regrid).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RegridSettings {
    /// Distance of grid nodes in x and y, millimetres. No default: it depends on the scan.
    pub pitch_mm: f64,
    /// M: samples in a node's window. At most half of them come from one column, so that
    /// columns far apart with dense samples still span a plane. Default
    /// [`Estimator::neighbours`]: of noise of 0.05 mm on a plane 49 samples leave 0.0085 mm
    /// by consensus, which takes z from the nearest four fifths, and 32 leave 0.021 mm by the
    /// median. By consensus the window grows with the share of outliers, to as many samples
    /// without any.
    pub neighbours: usize,
    /// N_s: planes tried at a node ([`Estimator::LeastMedian`]). [`Estimator::Consensus`]
    /// tries no more than it needs to be sure of the best to 1 in 10,000, and at most 16
    /// times as many. Default 32.
    pub draws: usize,
    /// Columns on either side of a node that its window may reach into; bounds memory and
    /// the delay until a node is finished. In y the window reaches as far as that many
    /// columns, or that many sample spacings if they are wider. [`Estimator::Consensus`] sees
    /// the line of a step edge as far. Default [`Estimator::reach_columns`].
    pub reach_columns: usize,
    /// The estimator.
    pub estimator: Estimator,
    /// The region of interest; everything by default.
    pub roi: Roi,
    /// Seed of the draws. Default 1.
    pub seed: u64,
    /// When a node gets a value.
    pub support: SupportSettings,
    /// Threads of [`crate::regrid`](fn@crate::regrid) and of what follows it; 0 (default) for all
    /// processors. The result does not depend on it.
    pub threads: usize,
}

impl RegridSettings {
    /// Defaults for everything but the pitch, millimetres.
    #[must_use]
    pub fn with_pitch(pitch_mm: f64) -> Self {
        Self {
            pitch_mm,
            neighbours: Estimator::default().neighbours(),
            draws: 32,
            reach_columns: Estimator::default().reach_columns(),
            estimator: Estimator::default(),
            roi: Roi::default(),
            seed: 1,
            support: SupportSettings::default(),
            threads: 0,
        }
    }

    /// The same settings with an estimator, its window and its reach.
    #[must_use]
    pub fn with_estimator(mut self, estimator: Estimator) -> Self {
        self.estimator = estimator;
        self.neighbours = estimator.neighbours();
        self.reach_columns = estimator.reach_columns();
        self
    }

    /// Checks every setting.
    ///
    /// # Errors
    /// [`SettingsError`] with the name of the first setting that is out of its range.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let number = |name, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(SettingsError::Number {
                    name,
                    value,
                    low,
                    high,
                })
            }
        };
        let count = |name, value: usize, low: usize, high: usize| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(SettingsError::Count {
                    name,
                    value,
                    low,
                    high,
                })
            }
        };
        number("pitch_mm", self.pitch_mm, 1e-3, 1e3)?;
        count("neighbours", self.neighbours, LEAST_WINDOW, GREATEST_WINDOW)?;
        count("draws", self.draws, 1, 100_000)?;
        count("reach_columns", self.reach_columns, 1, 1000)?;
        count("threads", self.threads, 0, 1024)?;
        number("support.radius", self.support.radius, 1.0, 10.0)?;
        number("support.margin", self.support.margin, 0.0, 1.0)?;
        number("support.step_margin", self.support.step_margin, 0.0, 1.0)?;
        number("support.inlier_floor", self.support.inlier_floor, 0.0, 10.0)?;
        number(
            "support.inlier_ceiling",
            self.support.inlier_ceiling,
            self.support.inlier_floor,
            1000.0,
        )?;
        count("support.least_samples", self.support.least_samples, 3, 100)?;
        for (axis, (low, high)) in [
            ("roi.x_mm", self.roi.x_mm),
            ("roi.y_mm", self.roi.y_mm),
            ("roi.z_mm", self.roi.z_mm),
        ] {
            if low.partial_cmp(&high) != Some(Ordering::Less) {
                return Err(SettingsError::Limits { axis, low, high });
            }
        }
        Ok(())
    }
}

/// Fewest samples that can outvote an outlier: a plane takes three of them.
pub(crate) const LEAST_WINDOW: usize = 6;

/// A setting out of its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// A number out of range.
    #[error("{name} = {value:?}: must be from {low} to {high}")]
    Number {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Least value allowed.
        low: f64,
        /// Greatest value allowed.
        high: f64,
    },
    /// A count out of range.
    #[error("{name} = {value}: must be from {low} to {high}")]
    Count {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: usize,
        /// Least value allowed.
        low: usize,
        /// Greatest value allowed.
        high: usize,
    },
    /// Limits of the region of interest that enclose nothing.
    #[error("{axis} = [{low}, {high}]: the first limit must be below the second")]
    Limits {
        /// Name of the setting.
        axis: &'static str,
        /// First limit.
        low: f64,
        /// Second limit.
        high: f64,
    },
}
