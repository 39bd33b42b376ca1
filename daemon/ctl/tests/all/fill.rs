//! `relief fill` on small meshes, and on what is none.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

use crate::common;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Output;

use common::relief;
use common::schema::check;
use serde_json::Value;

type Triangle = [[f64; 3]; 3];

/// A wavy sheet of squares, but those of which `is_out` holds.
fn sheet(is_out: impl Fn(usize, usize) -> bool) -> Vec<Triangle> {
    let at = |i: usize, j: usize| {
        let (x, y) = (i as f64, j as f64);
        [x, y, libm::sin(0.2 * x) + 0.02 * y * y]
    };
    let mut triangles = Vec::new();
    for i in 0..20 {
        for j in 0..16 {
            if !is_out(i, j) {
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    triangles
}

fn holed() -> Vec<Triangle> {
    sheet(|i, j| (5..9).contains(&i) && (4..8).contains(&j) || (i, j) == (14, 10))
}

fn stl(triangles: &[Triangle]) -> String {
    let mut text = "solid part\n".to_owned();
    for own in triangles {
        text.push_str("facet normal 0 0 0\nouter loop\n");
        for [x, y, z] in own {
            writeln!(text, "vertex {x} {y} {z}").unwrap();
        }
        text.push_str("endloop\nendfacet\n");
    }
    text.push_str("endsolid part\n");
    text
}

fn binary_stl(triangles: &[Triangle]) -> Vec<u8> {
    let mut bytes = b"solid is how this one begins".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for own in triangles {
        bytes.extend([0; 12]);
        own.as_flattened()
            .iter()
            .for_each(|c| bytes.extend((*c as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn obj(triangles: &[Triangle]) -> String {
    let mut text = "# a sheet\no sheet\n".to_owned();
    for [x, y, z] in triangles.as_flattened() {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for k in 0..triangles.len() {
        writeln!(text, "f {} {} {}", 3 * k + 1, 3 * k + 2, 3 * k + 3).unwrap();
    }
    text
}

fn ply(triangles: &[Triangle]) -> String {
    let count = triangles.len();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {count}\nproperty list uchar int vertex_indices\n\
         end_header\n",
        3 * count
    );
    for [x, y, z] in triangles.as_flattened() {
        writeln!(text, "{x} {y} {z}").unwrap();
    }
    for k in 0..count {
        writeln!(text, "3 {} {} {}", 3 * k, 3 * k + 1, 3 * k + 2).unwrap();
    }
    text
}

fn told(output: &Output) -> Value {
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    let told = serde_json::from_slice(&output.stdout).unwrap();
    check("commands.schema.json#/$defs/fill", &told);
    told
}

fn refused(at: &Path, arguments: &[&str], code: i32) -> String {
    let output = relief(at, arguments);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{error}");
    // Behind what shows how far it was.
    let mut lines = error.lines().rev();
    let told = lines.next().unwrap();
    assert!(told.starts_with("relief: "), "{error}");
    assert!(lines.all(|line| line.starts_with("fill: ")), "{error}");
    told.to_owned()
}

#[test]
fn every_format_is_read_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("text.stl"), stl(&holed())).unwrap();
    fs::write(at.join("binary.stl"), binary_stl(&holed())).unwrap();
    fs::write(at.join("part.obj"), obj(&holed())).unwrap();
    fs::write(at.join("part.ply"), ply(&holed())).unwrap();
    for input in ["text.stl", "binary.stl", "part.obj", "part.ply"] {
        let listed = told(&relief(at, &["fill", input, "--list", "--json"]));
        let kinds: Vec<&str> = listed["loops"]
            .as_array()
            .unwrap()
            .iter()
            .map(|own| own["kind"].as_str().unwrap())
            .collect();
        assert_eq!(kinds, ["border", "hole", "hole"], "{input}");
        for output in ["out.stl", "out.ply", "out.obj"] {
            let own = told(&relief(at, &["fill", input, "-o", output, "--json"]));
            let outcomes: Vec<&str> = own["loops"]
                .as_array()
                .unwrap()
                .iter()
                .map(|own| own["outcome"].as_str().unwrap())
                .collect();
            assert_eq!(outcomes, ["border", "filled", "filled"], "{input} {output}");
            // What was written is read again, and has but its border.
            let again = told(&relief(at, &["fill", output, "--list", "--json"]));
            assert_eq!(again["triangles"], own["triangles"], "{input} {output}");
            assert_eq!(again["vertices"], own["vertices"], "{input} {output}");
            let loops = again["loops"].as_array().unwrap();
            assert_eq!(loops.len(), 1, "{input} {output}");
            assert_eq!(loops[0]["edges"], 72);
        }
    }
    // Facets that were there stand where they stood, to the bit.
    relief(at, &["fill", "binary.stl", "-o", "kept.stl"]);
    let (before, after) = (
        fs::read(at.join("binary.stl")).unwrap(),
        fs::read(at.join("kept.stl")).unwrap(),
    );
    let facets = |bytes: &[u8]| {
        let own = bytes[84..].chunks(50);
        own.map(|facet| facet[12..48].to_vec()).collect::<Vec<_>>()
    };
    let old = facets(&before);
    assert_eq!(facets(&after)[..old.len()], old);
}

#[test]
fn the_default_output_and_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("part.stl"), stl(&holed())).unwrap();
    let output = relief(at, &["fill", "part.stl"]);
    let (out, error) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert!(
        output.status.success() && at.join("part-filled.stl").is_file(),
        "{error}"
    );
    assert!(
        out.contains("filled") && out.contains("written    part-filled.stl"),
        "{out}"
    );
    assert!(
        error.contains("loop 1 is the border of an open sheet"),
        "{error}"
    );
    let listed = relief(at, &["fill", "part.stl", "--list"]);
    let listed = String::from_utf8_lossy(&listed.stdout);
    assert!(listed.starts_with("LOOP   IS"), "{listed}");
    assert_eq!(listed.lines().count(), 6, "{listed}");
}

#[test]
fn loops_that_are_kept_and_closed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("part.stl"), stl(&holed())).unwrap();
    let own = told(&relief(
        at,
        &["fill", "part.stl", "--json", "--keep", "2", "3"],
    ));
    assert_eq!(own["new_triangles"], 0);
    let notes = own["warnings"].to_string();
    assert!(notes.contains("no hole was filled"), "{notes}");
    let error = refused(at, &["fill", "part.stl", "--keep", "9"], 2);
    assert!(
        error.contains("there is no loop 9; there are 3; --list shows them"),
        "{error}"
    );
    let error = refused(at, &["fill", "part.stl", "--keep", "2", "--close", "2"], 2);
    assert!(error.contains("kept open and closed"), "{error}");
    fs::write(at.join("whole.stl"), stl(&tetrahedron())).unwrap();
    let own = told(&relief(at, &["fill", "whole.stl", "--json"]));
    assert!(
        own["warnings"]
            .to_string()
            .contains("the mesh has no holes")
    );
    let error = refused(at, &["fill", "whole.stl", "--keep", "1"], 2);
    assert!(error.contains("the mesh is closed"), "{error}");
}

fn tetrahedron() -> Vec<Triangle> {
    let [a, b, c, d] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    vec![[a, c, b], [a, b, d], [b, c, d], [c, a, d]]
}

#[test]
fn a_mesh_in_metres_is_told_in_millimetres() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("part.stl"), stl(&holed())).unwrap();
    let metres = |triangle: Triangle| triangle.map(|place| place.map(|c| c / 1e3));
    let small: Vec<Triangle> = holed().into_iter().map(metres).collect();
    fs::write(at.join("small.stl"), stl(&small)).unwrap();
    let [own, unsaid, said] = [
        &["part.stl"][..],
        &["small.stl"],
        &["small.stl", "--units", "m"],
    ]
    .map(|words| {
        let command = [&["fill", "--list", "--json"], words].concat();
        told(&relief(at, &command))
    });
    let is_remarked = |told: &Value| told["warnings"].to_string().contains("--units m");
    assert_eq!(
        [&own, &unsaid, &said].map(is_remarked),
        [false, true, false]
    );
    let length = |told: &Value| told["loops"][1]["length_mm"].as_f64().unwrap();
    assert!((length(&said) / length(&own) - 1.0).abs() < 1e-3);
    assert!((1e3 * length(&unsaid) / length(&own) - 1.0).abs() < 1e-3);
}

#[test]
fn trimmed_surfaces_go_into_iges() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("part.stl"), stl(&holed())).unwrap();
    let command = ["fill", "part.stl", "--patches", "holes.igs", "--json"];
    for method in ["relief", "yoo"] {
        let own = told(&relief(at, &[&command[..], &["--method", method]].concat()));
        assert_eq!(own["patches"], "holes.igs");
        let file = fs::File::open(at.join("holes.igs")).unwrap();
        let model = cad_exchange::iges::read_model(std::io::BufReader::new(file)).unwrap();
        let names: Vec<Option<&str>> = model.faces.iter().map(|f| f.name.as_deref()).collect();
        assert_eq!(names, [Some("hole-2"), Some("hole-3")], "{method}");
        for face in &model.faces {
            assert_eq!(face.outer.len(), 1);
            let (first, last) = face.outer[0].space_curve.domain();
            assert!(last - first >= 4.0);
        }
    }
}

#[test]
fn clear_answers() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let told = |content: &[u8]| {
        fs::write(at.join("in"), content).unwrap();
        refused(at, &["fill", "in", "-o", "out.stl"], 1)
    };
    assert!(told(b"").contains("in: is empty"));
    assert!(told(b"some words\n").contains("is no mesh: STL, PLY and OBJ files are read"));
    assert!(told(b"ISO-10303-21;\n").contains("is a STEP file, and no mesh"));
    assert!(told(b"solid x\nendsolid x\n").contains("in: it holds no triangle"));
    let flat = [[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]];
    assert!(told(stl(&flat).as_bytes()).contains("none of its 1 triangles has an area"));
    let points = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                  property float z\nend_header\n0 0 0\n";
    assert!(told(points.as_bytes()).contains("is a PLY file of points, without faces"));
    assert!(told(b"v 0 0 0\nf 1 2 3\n").contains("is damaged, or no OBJ file"));
    let broken = ply(&tetrahedron()).replace("3 0 1 2", "3 0 1 99");
    assert!(told(broken.as_bytes()).contains("triangle 1 names vertex 100, and there are 12"));
    let mut cut = binary_stl(&tetrahedron());
    cut.truncate(150);
    assert!(told(&cut).contains("is cut off"));
    let whole = ply(&tetrahedron());
    let (cut, _) = whole.trim_end().rsplit_once('\n').unwrap();
    let cut = told(format!("{cut}\n").as_bytes());
    assert!(
        cut.contains("is cut off: it ends before the last of 4 face entries"),
        "{cut}"
    );
    assert!(!at.join("out.stl").exists());
    fs::write(at.join("part.stl"), stl(&holed())).unwrap();
    for (arguments, why) in [
        (&["-o", "out.step"][..], "ending .stl, .ply or .obj"),
        (
            &["-o", "part.stl"],
            "is read, and cannot be written as well",
        ),
        (&["-o", "none/out.stl"], "there is no directory none"),
        (&["--patches", "out.step"], "ending .igs"),
        (
            &["--max-edge", "0"],
            "--max-edge 0: must be a length above 0",
        ),
        (&["--list", "-o", "out.stl"], "cannot be used with"),
    ] {
        let error = refused(at, &[&["fill", "part.stl"], arguments].concat(), 2);
        assert!(error.contains(why), "{error}");
    }
    let error = refused(at, &["fill", "nothing.stl"], 1);
    assert!(error.contains("cannot read nothing.stl"), "{error}");
}
