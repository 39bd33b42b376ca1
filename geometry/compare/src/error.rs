//! Why a scan cannot be held against a nominal.

use range_image::Cancelled;

/// Why a scan cannot be held against a nominal.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// The caller has lost interest.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A setting lies outside its limits.
    #[error("{name} = {value}: must be {must}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// The range image has too few nodes.
    #[error("the scan has {nodes} nodes with a value, too few to be compared")]
    NothingMeasured {
        /// Nodes with a value.
        nodes: usize,
    },
    /// The nominal looks to be in another unit.
    #[error(
        "the nominal measures {nominal_mm:.4} mm across and the scan {scan_mm:.1} mm: it is \
         probably not in millimetres{unit}"
    )]
    Units {
        /// Diagonal of the nominal's box.
        nominal_mm: f64,
        /// Diagonal of the scan's box.
        scan_mm: f64,
        /// In which unit it would be of one size with the scan.
        unit: &'static str,
    },
    /// As placed, nothing of the scan is near the nominal.
    #[error(
        "no point of the scan lies within {limit_mm} mm of what the camera can see of the nominal \
         as they are placed"
    )]
    NoOverlap {
        /// The distance up to which points belong to the nominal.
        limit_mm: f64,
    },
    /// No start led to a fit.
    #[error(
        "the scan could not be registered: in the best of {starts} starts {share_percent:.0} % of \
         it lie within {limit_mm} mm of the nominal"
    )]
    NotRegistered {
        /// Share of the nodes that lie near.
        share_percent: f64,
        /// The distance up to which points belong to the nominal.
        limit_mm: f64,
        /// Starts tried.
        starts: usize,
    },
    /// Nothing could be compared.
    #[error(
        "nothing of the scan can be compared: what lies near the nominal lies at its edges alone"
    )]
    NothingCompared,
    /// The nominal covers too large a lattice.
    #[error(
        "the nominal would take {columns} x {rows} nodes at a pitch of {pitch_mm} mm, too many: \
         choose a larger pitch"
    )]
    TooManyNodes {
        /// Columns.
        columns: usize,
        /// Rows.
        rows: usize,
        /// Their distance.
        pitch_mm: f64,
    },
}
