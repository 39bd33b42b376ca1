//! What the programs of this package share: pages about a paper that are written and checked, and
//! pictures as SVG.

pub mod kept;
pub mod svg;
