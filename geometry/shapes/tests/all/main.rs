//! All tests of shapes.

mod evidence;
mod fit;
mod known;
mod several;
mod swept;
