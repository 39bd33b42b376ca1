//! Borders: from labels to a planar map of smooth paths (Shim & Lee 1995, section IV).

pub(crate) mod beam;
pub(crate) mod cracks;
pub(crate) mod crossing;
pub(crate) mod deflect;
pub(crate) mod intersection;
pub(crate) mod junctions;
pub(crate) mod map;
pub(crate) mod path;
pub(crate) mod segments;
pub(crate) mod separate;
pub(crate) mod smooth;
pub(crate) mod spline;
pub(crate) mod sums;
