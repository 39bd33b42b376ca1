//! Elements that close a hole.
//!
//! ```text
//! loops --> one polygon --> few of its vertices --> triangles of least bend between these --> fair
//!   --> onto the surface --> all of its vertices --> refined to the size of what is around, relaxed
//! ```

mod cavity;
mod cover;
mod fair;
mod grow;
mod net;
mod polygon;
mod relax;

pub(crate) use grow::{Ground, Patch, Trouble, grow};
pub(crate) use polygon::Polygon;
