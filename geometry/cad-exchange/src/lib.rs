//! CAD files: IGES and STEP, written and read.
//!
//! Writers take any [`std::io::Write`], readers any [`std::io::Read`]; author and
//! timestamp are arguments, so that the same model gives the same bytes.

pub mod iges;
pub mod step;

mod brep;
mod common;
