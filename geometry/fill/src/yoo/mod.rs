//! The paper's way from an implicit surface to elements (Yoo, section 3.2), and trimmed surfaces.
//!
//! A hole's surroundings are seen along their mean normal. A grid of points is thrown along it onto the
//! implicit surface (equation 5), cubic Ferguson curves through the rows and columns of the grid give
//! tangents, and bicubic Ferguson patches the base surface. The hole's loop is projected onto it at
//! right angles (equations 6 and 7); what it encloses there is the trimmed surface, in whose parameter
//! plane elements are made. What no direction sees whole is parted first ([`parts`]), for files alone: its
//! elements are on the implicit surface itself.

mod base;
mod elements;
mod ferguson;
mod parts;
mod trim;

pub(crate) use base::{Base, Throw, Unseen, base};
pub(crate) use elements::elements;
pub(crate) use parts::{Elements, parts};
pub use trim::TrimmedPatch;
pub(crate) use trim::{Trim, trim};
