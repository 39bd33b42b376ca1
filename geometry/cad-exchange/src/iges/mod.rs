//! IGES 5.3 in fixed 80-column ASCII.
//!
//! [`write()`] turns a [`reconstruct::Model`] into trimmed surfaces (entity 144 on 142 on
//! 114 and 112, on 128 and 126, or on 190 to 198), one per face, or into shells (514) of faces on
//! common edges, with name, colour and level;
//! [`read_points`] takes measured points (106, 116) from anybody's file; [`read_model`]
//! reads back what [`write()`] writes. [`write_surfaces`] writes whole B-spline surfaces (128; as 114 by
//! [`write_parametric_surfaces`]), [`write_trimmed`] such with trims that are given as B-splines,
//! [`read_surfaces`] reads them, and [`read_chains`] curves and chains of points (106, 112, 126).
//!
//! A file is sections of 80-column lines: Start, Global, Directory entry, Parameter
//! data, Terminate. Column 73 tells the section, columns 74 to 80 number its lines.
//! Every entity has two lines in the directory, which point to its parameters.

mod read;
mod write;

pub use read::{
    AnalyticSurface, Chain, MAX_FILE_BYTES, PlainSurface, ReadError, Shell, SplineCurve,
    SurfaceFrame, TrimmedCurve, TrimmedFace, TrimmedModel, TrimmedSurface, read_chains, read_model,
    read_points, read_surfaces,
};
pub use write::{
    DEFAULT_PALETTE, Entities, FaceDefect, NamedPatch, NamedSurface, Summary, WriteError,
    WriteOptions, write, write_parametric_surfaces, write_surfaces, write_trimmed,
};
