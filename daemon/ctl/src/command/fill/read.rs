//! The mesh from its file.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use mesh_files::{Triangles, read_triangles};

use crate::failure::Failure;

/// Longest file that is read.
const MOST_BYTES: u64 = 8 << 30;

pub(super) fn read(path: &Path) -> Result<Triangles, Failure> {
    let name = path.display();
    if path.is_dir() {
        return Err(Failure::Failed(format!(
            "{name} is a directory; name an STL, PLY or OBJ file in it"
        )));
    }
    let cannot = |error| Failure::at(format!("cannot read {name}"), &error);
    let file = File::open(path).map_err(cannot)?;
    let bytes = file.metadata().map_err(cannot)?.len();
    if bytes > MOST_BYTES {
        return Err(Failure::Failed(format!(
            "{name}: is longer than 8 GiB, the most that is read: decimate the mesh first"
        )));
    }
    read_triangles(&mut BufReader::with_capacity(1 << 16, file), bytes)
        .map_err(|error| Failure::Failed(format!("{name}: {error}")))
}
