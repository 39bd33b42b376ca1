//! Recorded scans, zippered: boundary loops, doubled triangles and crowded edges as they come.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_types
)]

use crate::common;

use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

use fill::{Precision, Settings, TriangleMesh, fill};
use range_image::Unmonitored;

/// A text PLY file, packed; `None` where it is not there.
fn read(name: &str) -> Option<TriangleMesh> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data/stanford_bunny")
        .join(name);
    let file = std::fs::File::open(path).ok()?;
    let mut text = String::new();
    flate2::read::GzDecoder::new(file)
        .read_to_string(&mut text)
        .unwrap();
    let (head, body) = text.split_once("end_header\n").unwrap();
    let count = |of: &str| -> usize {
        let line = head.lines().find(|line| line.starts_with(of)).unwrap();
        line[of.len()..].trim().parse().unwrap()
    };
    let vertices = count("element vertex ");
    let mut mesh = TriangleMesh::default();
    for (k, line) in body.lines().enumerate() {
        let words: Vec<&str> = line.split_whitespace().collect();
        if k < vertices {
            let place = [0, 1, 2].map(|j| f64::from(words[j].parse::<f32>().unwrap()));
            mesh.vertices_mm.push(place);
        } else if words.len() == 4 {
            mesh.triangles
                .push([1, 2, 3].map(|j| words[j].parse().unwrap()));
        }
    }
    assert_eq!(mesh.triangles.len(), count("element face "));
    Some(mesh)
}

#[test]
fn bunnies_are_closed() {
    for name in ["bun_zipper_res3.ply.gz", "bun_zipper_res2.ply.gz"] {
        let Some(mesh) = read(name) else {
            continue;
        };
        let settings = Settings {
            precision: Precision::Single,
            ..Settings::default()
        };
        let own = fill(mesh, &settings, &Unmonitored).unwrap();
        assert!(own.open().is_empty(), "{name}: {:?}", own.open());
        assert!(common::is_watertight(&own.mesh), "{name}");
        // Also for who tells vertices by their coordinates.
        let mut edges: HashMap<[[u64; 3]; 2], usize> = HashMap::new();
        let at = |v: u32| own.mesh.vertices_mm[v as usize].map(f64::to_bits);
        for &[a, b, c] in &own.mesh.triangles {
            for (u, v) in [(a, b), (b, c), (c, a)] {
                let (u, v) = (at(u), at(v));
                *edges.entry([u.min(v), u.max(v)]).or_default() += 1;
            }
        }
        assert!(edges.values().all(|count| *count == 2), "{name}");
    }
}
