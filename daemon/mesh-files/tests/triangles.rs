//! Bare triangles are read as they were written.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use std::io::Cursor;

use mesh_files::{TriangleFormat, Triangles, read_triangles, write_triangles};

const VERTICES: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [10.0, 0.1, 0.0],
    [10.0, 5.0, -0.3],
    [0.0, 5.0, 1e-3],
    [5.0, 2.5, 7.0],
];
const TRIANGLES: [[u32; 3]; 4] = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];

fn read(bytes: &[u8]) -> Result<Triangles, String> {
    let length = bytes.len() as u64;
    read_triangles(&mut Cursor::new(bytes), length).map_err(|error| error.to_string())
}

/// Corners by triangle.
fn corners(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<[[f64; 3]; 3]> {
    let own = triangles.iter();
    own.map(|t| t.map(|v| vertices[v as usize])).collect()
}

#[test]
fn what_is_written_is_read_again() {
    for (format, is_single) in [
        (TriangleFormat::Stl, true),
        (TriangleFormat::Ply, true),
        (TriangleFormat::Ply, false),
        (TriangleFormat::Obj, false),
    ] {
        let mut bytes = Vec::new();
        let kind = (format, is_single);
        write_triangles(&VERTICES, &TRIANGLES, kind, "relief 0", &mut bytes).unwrap();
        let own = read(&bytes).unwrap();
        assert_eq!((own.format, own.is_single), kind);
        let rounded = |c: f64| if is_single { f64::from(c as f32) } else { c };
        let expected = VERTICES.map(|p| p.map(rounded));
        assert_eq!(
            corners(&own.vertices, &own.triangles),
            corners(&expected, &TRIANGLES)
        );
        assert_eq!(own.vertices.len(), 5);
    }
}

#[test]
fn faces_of_more_corners_are_divided() {
    let quad = "o roof\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nmtllib none.mtl\nf 1 2 3 4\n";
    assert_eq!(read(quad.as_bytes()).unwrap().triangles.len(), 2);
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\n\
               property double z\nproperty uchar red\nelement face 1\n\
               property list uchar uint vertex_index\nend_header\n\
               0 0 0 1\n1 0 0 1\n1 1 0 1\n0 1 0 1\n4 0 1 2 3\n";
    let own = read(ply.as_bytes()).unwrap();
    assert_eq!(own.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert!(!own.is_single);
}

#[test]
fn what_cannot_be_written_is_refused() {
    let write = |triangles: &[[u32; 3]]| {
        let kind = (TriangleFormat::Stl, true);
        let mut bytes = Vec::new();
        write_triangles(&VERTICES, triangles, kind, "relief 0", &mut bytes).map(|()| bytes)
    };
    assert_eq!(write(&TRIANGLES).unwrap().len(), 84 + 4 * 50);
    let refused = write(&[[0, 1, 5]]).unwrap_err().to_string();
    assert!(refused.contains("a vertex that is not there"), "{refused}");
}

#[test]
fn a_header_alone_takes_no_memory() {
    let ply = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\n\
               property float y\nproperty float z\nelement face 1\n\
               property list uchar int vertex_indices\nend_header\n";
    assert!(read(ply.as_bytes()).unwrap_err().contains("is cut off"));
}
