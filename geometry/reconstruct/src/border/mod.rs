//! Borders: from labels to a planar map of smooth paths (Shim & Lee 1995, section IV).

pub(crate) mod beam;
pub(crate) mod beside;
pub(crate) mod closeness;
pub(crate) mod conic;
pub(crate) mod course;
pub(crate) mod cracks;
pub(crate) mod crossing;
pub(crate) mod deflect;
pub(crate) mod intersection;
pub(crate) mod junctions;
pub(crate) mod layout;
pub(crate) mod likelihood;
pub(crate) mod map;
pub(crate) mod path;
pub(crate) mod pins;
pub(crate) mod redraw;
pub(crate) mod search;
pub(crate) mod segments;
pub(crate) mod separate;
pub(crate) mod settle;
pub(crate) mod smooth;
pub(crate) mod spline;
pub(crate) mod split;
pub(crate) mod sums;
pub(crate) mod sway;
