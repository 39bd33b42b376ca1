//! All tests of scan files.

mod common;
mod ply;
mod real_files;
mod text;
