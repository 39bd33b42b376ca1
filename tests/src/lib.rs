//! The whole house under one roof: a simulated scanner on a real pseudo-terminal, a private
//! service in this process, and a client that speaks to it as any other program would.
//!
//! [`rig`] starts them and waits on events, never for a while. [`direct`] takes the other
//! road from a scan to a CAD file, without a service, for comparison. The tests proper lie
//! in `tests/`; the program `scan-scene` scans a scene for judges outside.
//!
//! [`mutations`] damages scan files of every format and reads them with every reader.
//!
//! The program `study-segmentation` judges the segmentation: [`scenes`] draws objects from
//! seeds, scans them and knows the face over each node; [`score`] compares labels with it.
//! `study-reproduction` repeats the experiments of Shim & Lee 1995; [`outline`] and
//! [`trimming`] say how far trim loops lie from true outlines, [`intervals`] what samples allow
//! of those along an axis.

pub mod columns;
pub mod direct;
pub mod iges;
pub mod intervals;
pub mod mutations;
pub mod outline;
pub mod rig;
pub mod scenes;
pub mod score;
pub mod seeds;
pub mod stl;
pub mod trimming;
