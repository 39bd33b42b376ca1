//! What can be chosen, and what can go wrong.

use range_image::Cancelled;

/// How faces are made from regions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Patches are the spans of a spline fitted to the region's own nodes; borders are
    /// smoothed, straight where the region's outline is.
    #[default]
    Relief,
    /// By the letter of Shim & Lee 1995: patches pass through nodes of the extended
    /// range image, border segments through points of the traced border.
    ShimLee,
}

/// Settings of [`crate::reconstruct`].
#[derive(Debug, Clone, PartialEq)]
pub struct ReconstructSettings {
    /// How faces are made.
    pub method: Method,
    /// Root mean square residual at which the fitted spline gets no further knots, even
    /// if those would bring it nearer, and the least change of it that is worth knots;
    /// millimetres. Method [`Method::Relief`] only.
    pub tolerance_mm: f64,
    /// Most distinct knots ("nodes" in the paper) of a fitted spline along a side, ends
    /// included: one more than there are spans. As many are taken as the data give reason
    /// for. The comparison of the paper's Table 1 has 26 whatever is set here.
    /// [`Method::Relief`] only.
    pub knots_per_side: usize,
    /// Grid pitches between the points that cut a patch in thirds, so that a patch is
    /// three times as wide. The paper gives neither this nor M and N; 2 keeps most of
    /// the detail at a quarter of the patches that 1 would need. [`Method::ShimLee`] only.
    pub patch_third_nodes: usize,
    /// Least turn of a border that makes a vertex, radians. Blunter joints are rounded.
    pub corner_angle_rad: f64,
    /// Price of a straight piece of a border against the sum of its squared distances
    /// from the traced border, square pitches. Higher values give fewer, longer pieces.
    pub piece_price_pitch2: f64,
    /// How far a border segment may leave the traced border before it is divided, in
    /// pitches. [`Method::ShimLee`] only.
    pub border_bound_pitches: f64,
    /// Connected pieces of a region with fewer nodes give no face.
    pub min_piece_nodes: usize,
    /// Holes with fewer nodes are filled with the region that surrounds the most of them.
    pub min_hole_nodes: usize,
}

impl Default for ReconstructSettings {
    fn default() -> Self {
        Self {
            method: Method::Relief,
            tolerance_mm: 0.01,
            knots_per_side: 257,
            patch_third_nodes: 2,
            corner_angle_rad: 0.35,
            piece_price_pitch2: 7.0,
            border_bound_pitches: 0.6,
            min_piece_nodes: 12,
            min_hole_nodes: 5,
        }
    }
}

/// A setting is outside its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{name} is {value}, but must be {range}")]
pub struct SettingsError {
    /// Name of the field.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// What is allowed.
    pub range: &'static str,
}

impl ReconstructSettings {
    /// Checks every value.
    ///
    /// # Errors
    /// [`SettingsError`] naming the first one out of range.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let check = |name, value: f64, low: f64, high: f64, range| {
            if value >= low && value <= high {
                Ok(())
            } else {
                Err(SettingsError { name, value, range })
            }
        };
        let count = |v: usize| v as f64;
        check(
            "tolerance_mm",
            self.tolerance_mm,
            0.0,
            1e3,
            "from 0 to 1000",
        )?;
        check(
            "knots_per_side",
            count(self.knots_per_side),
            2.0,
            1025.0,
            "from 2 to 1025",
        )?;
        check(
            "patch_third_nodes",
            count(self.patch_third_nodes),
            1.0,
            100.0,
            "from 1 to 100",
        )?;
        check(
            "corner_angle_rad",
            self.corner_angle_rad,
            0.1,
            1.5,
            "from 0.1 to 1.5",
        )?;
        check(
            "piece_price_pitch2",
            self.piece_price_pitch2,
            0.5,
            1e3,
            "from 0.5 to 1000",
        )?;
        check(
            "border_bound_pitches",
            self.border_bound_pitches,
            0.3,
            1e3,
            "from 0.3 to 1000",
        )?;
        check(
            "min_piece_nodes",
            count(self.min_piece_nodes),
            4.0,
            1e9,
            "at least 4",
        )?;
        check(
            "min_hole_nodes",
            count(self.min_hole_nodes),
            0.0,
            1e9,
            "at most 1e9",
        )
    }
}

/// Why a range image gave no model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReconstructError {
    /// A setting is out of range.
    #[error("setting out of range: {0}")]
    Settings(#[from] SettingsError),
    /// The region map belongs to another image.
    #[error(
        "the region map has {map_columns} x {map_rows} nodes, the range image {columns} x {rows}"
    )]
    SizeMismatch {
        /// Columns of the image.
        columns: usize,
        /// Rows of the image.
        rows: usize,
        /// Columns of the map.
        map_columns: usize,
        /// Rows of the map.
        map_rows: usize,
    },
    /// A region's node has no z.
    #[error("node ({column}, {row}) belongs to region {label} but has no range value")]
    MaskedNode {
        /// Column of the node.
        column: usize,
        /// Row of the node.
        row: usize,
        /// Its label.
        label: u16,
    },
    /// There is no region at all.
    #[error("there is no region to reconstruct: the segmentation left every node unassigned")]
    NoRegions,
    /// Regions are there, but none can become a face.
    #[error(
        "none of the {regions} regions can become a face: each is thinner than two nodes or has \
         fewer than {min_nodes} nodes; scan at a finer pitch or lower min_piece_nodes"
    )]
    NoFaces {
        /// Number of regions.
        regions: usize,
        /// The limit in force.
        min_nodes: usize,
    },
    /// Not as many surfaces as regions were given.
    #[error("{surfaces} surfaces were given for {regions} regions")]
    Surfaces {
        /// Number of regions.
        regions: usize,
        /// Number of surfaces.
        surfaces: usize,
    },
    /// A surface could not be fitted.
    #[error("no surface fits region {label}: {reason}")]
    Fit {
        /// The region.
        label: u16,
        /// What went wrong.
        reason: String,
    },
    /// The caller gave up.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_nonsense_is_named() {
        assert_eq!(ReconstructSettings::default().validate(), Ok(()));
        let bad = ReconstructSettings {
            tolerance_mm: f64::NAN,
            ..Default::default()
        };
        assert_eq!(bad.validate().unwrap_err().name, "tolerance_mm");
        let bad = ReconstructSettings {
            knots_per_side: 1,
            ..Default::default()
        };
        let message = bad.validate().unwrap_err().to_string();
        assert_eq!(message, "knots_per_side is 1, but must be from 2 to 1025");
    }
}
