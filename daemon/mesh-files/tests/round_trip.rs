//! What is written is read again by readers of the libraries, and means what was meant.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeMap;
use std::io::Cursor;

use mesh_files::{
    MeshDetails, MeshFormat, Point, PointFormat, Points, ScanDetails, write_mesh, write_points,
};
use tessellate::{Accuracy, Corner, Mesh, MeshFace};

/// Two squares that meet at a right angle along x = 10, of one triangle pair each.
fn mesh() -> Mesh {
    let corner = |vertex: u32, normal: [f64; 3]| Corner { vertex, normal };
    let face = |name: &str, region, form, vertices: [u32; 4], normal| MeshFace {
        name: name.to_owned(),
        region,
        form,
        corners: vertices.map(|vertex| corner(vertex, normal)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    Mesh {
        vertices_mm: vec![
            [0.0, 0.0, 0.0],
            [10.0, 0.0, 10.0],
            [10.0, 5.0, 10.0],
            [0.0, 5.0, 0.0],
            [20.0, 0.0, 0.0],
            [20.0, 5.0, 0.0],
        ],
        faces: vec![
            face("R1", 1, "plane", [0, 1, 2, 3], [-half, 0.0, half]),
            face("R2", 12, "free form", [1, 4, 5, 2], [half, 0.0, half]),
        ],
        accuracy: Accuracy::default(),
    }
}

const PALETTE: [[u8; 3]; 10] = [
    [1, 2, 3],
    [255, 128, 0],
    [0, 64, 255],
    [0; 3],
    [0; 3],
    [0; 3],
    [0; 3],
    [0; 3],
    [0; 3],
    [0; 3],
];

fn details() -> MeshDetails<'static> {
    MeshDetails {
        name: "roof <&> \"7\" ]]>\n\u{e4}",
        generator: "Relief 0",
        palette: &PALETTE,
    }
}

fn written(format: MeshFormat) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_mesh(&mesh(), format, &details(), &mut bytes).unwrap();
    let mut again = Vec::new();
    write_mesh(&mesh(), format, &details(), &mut again).unwrap();
    assert!(bytes == again);
    bytes
}

/// Sides that one triangle has, points being the same where their coordinates are.
fn free_edges(triangles: &[[[f64; 3]; 3]]) -> usize {
    let mut uses = BTreeMap::new();
    for triangle in triangles {
        let ids = triangle.map(|p| p.map(f64::to_bits));
        for k in 0..3 {
            let (a, b) = (ids[k], ids[(k + 1) % 3]);
            *uses.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    uses.values().filter(|uses| **uses == 1).count()
}

fn area(triangles: &[[[f64; 3]; 3]]) -> f64 {
    let area = |[a, b, c]: &[[f64; 3]; 3]| {
        let [u, v]: [[f64; 3]; 2] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
        let n = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        assert!(n[2] > 0.0);
        n.iter().map(|c| c * c).sum::<f64>().sqrt() / 2.0
    };
    triangles.iter().map(area).sum()
}

/// Two squares of 5 by 10 root 2, in the square of a unit.
fn is_the_mesh(triangles: &[[[f64; 3]; 3]], unit_mm: f64) {
    assert_eq!((triangles.len(), free_edges(triangles)), (4, 6));
    let exact = 2.0 * 50.0 * 2.0_f64.sqrt() / (unit_mm * unit_mm);
    assert!((area(triangles) / exact - 1.0).abs() < 1e-6);
    let highest = triangles.iter().flatten().map(|p| p[2]).fold(0.0, f64::max);
    assert!((highest * unit_mm - 10.0).abs() < 1e-6);
}

#[test]
fn stl_has_millimetres_and_normals_towards_the_camera() {
    let read = stl_io::read_stl(&mut Cursor::new(written(MeshFormat::Stl))).unwrap();
    let at = |k: usize| read.vertices[k].0.map(f64::from);
    let triangles: Vec<_> = read.faces.iter().map(|f| f.vertices.map(at)).collect();
    is_the_mesh(&triangles, 1.0);
    assert_eq!(read.vertices.len(), 6);
    for (face, x) in read.faces.iter().zip([-1.0, -1.0, 1.0, 1.0]) {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        assert_eq!(face.normal.0, [x * half, 0.0, half]);
    }
}

#[test]
fn ply_has_colours_regions_and_names() {
    use ply_rs_bw::ply::{DefaultElement, Property};
    let bytes = written(MeshFormat::Ply);
    let parser = ply_rs_bw::parser::Parser::<DefaultElement>::new();
    let ply = parser.read_ply(&mut Cursor::new(&bytes)).unwrap();
    let comments = &ply.header.comments;
    assert!(
        comments.contains(&"face 0: R1, plane".to_owned()),
        "{comments:?}"
    );
    assert!(
        comments.contains(&"face 1: R2, free form".to_owned()),
        "{comments:?}"
    );
    assert!(
        comments.iter().any(|c| c == "part roof <&> \"7\" ]]>__"),
        "{comments:?}"
    );
    let number = |element: &DefaultElement, key: &str| match element[key] {
        Property::Float(value) => f64::from(value),
        Property::UChar(value) => f64::from(value),
        Property::UShort(value) => f64::from(value),
        ref other => panic!("{key}: {other:?}"),
    };
    let place = |k: i32| {
        let vertex = &ply.payload["vertex"][k as usize];
        ["x", "y", "z"].map(|axis| number(vertex, axis))
    };
    let facets = &ply.payload["face"];
    let triangles: Vec<_> = facets
        .iter()
        .map(|facet| match &facet["vertex_indices"] {
            Property::ListInt(corners) => [0, 1, 2].map(|k| place(corners[k])),
            other => panic!("{other:?}"),
        })
        .collect();
    is_the_mesh(&triangles, 1.0);
    let told = |k: usize| ["red", "green", "blue", "region", "face"].map(|p| number(&facets[k], p));
    assert_eq!(told(0), [255.0, 128.0, 0.0, 1.0, 0.0]);
    assert_eq!(told(3), [0.0, 64.0, 255.0, 12.0, 1.0]);
}

#[test]
fn threemf_is_a_surface_in_millimetres_with_a_material_for_each_face() {
    use threemf2::model::domain::model::Unit;
    use threemf2::model::domain::object::{ObjectKind, ObjectType};
    let bytes = Cursor::new(written(MeshFormat::ThreeMf));
    let package =
        threemf2::package::ThreemfPackage::from_reader_with_memory_optimized_deserializer(
            bytes, true,
        )
        .unwrap();
    let model = &package.root;
    assert!(matches!(model.unit, Some(Unit::Millimeter)));
    let [object] = &model.resources.object[..] else {
        panic!("{} objects", model.resources.object.len());
    };
    assert_eq!(object.objecttype, Some(ObjectType::Surface));
    let name: &str = object.name.as_ref().unwrap();
    assert_eq!(name, "roof <&> \"7\" ]]>_\u{e4}");
    assert_eq!(model.build.item.len(), 1);
    let [materials] = &model.resources.basematerials[..] else {
        panic!("no materials");
    };
    let named: Vec<_> = materials
        .base
        .iter()
        .map(|base| (base.name.to_string(), base.displaycolor.to_string()))
        .collect();
    let expected = [("R1 (plane)", "#FF8000"), ("R2 (free form)", "#0040FF")];
    assert_eq!(
        named,
        expected.map(|(name, colour)| (name.into(), colour.into()))
    );
    let Some(ObjectKind::Mesh(mesh)) = &object.kind else {
        panic!("no mesh");
    };
    let place = |k: u32| {
        let vertex = &mesh.vertices.vertex[k as usize];
        [vertex.x.value(), vertex.y.value(), vertex.z.value()]
    };
    let facets = &mesh.triangles.triangle;
    let triangles: Vec<_> = facets
        .iter()
        .map(|t| [t.v1, t.v2, t.v3].map(place))
        .collect();
    is_the_mesh(&triangles, 1.0);
    let materials: Vec<_> = facets.iter().map(|t| t.p1.get()).collect();
    assert_eq!(materials, [Some(0), Some(0), Some(1), Some(1)]);
}

#[test]
fn glb_has_metres_and_a_named_node_for_each_face() {
    let bytes = written(MeshFormat::Glb);
    // Checks indices, offsets, limits and all that the standard demands of the description.
    let file = gltf::Gltf::from_slice(&bytes).unwrap();
    let binary = file.blob.as_deref().unwrap();
    assert_eq!(file.buffers().next().unwrap().length(), binary.len());
    let part = file.default_scene().unwrap().nodes().next().unwrap();
    assert_eq!(part.name(), Some(details().name));
    let names: Vec<_> = part
        .children()
        .map(|node| node.name().unwrap().to_owned())
        .collect();
    assert_eq!(names, ["R1", "R2"]);
    let mut triangles = Vec::new();
    for node in part.children() {
        let shape = node.mesh().unwrap();
        let primitive = shape.primitives().next().unwrap();
        let reader = primitive.reader(|_| Some(binary));
        let places: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
        let bounds = primitive.bounding_box();
        for d in 0..3 {
            let along = || places.iter().map(|p| p[d]);
            assert_eq!(along().fold(f32::INFINITY, f32::min), bounds.min[d]);
            assert_eq!(along().fold(f32::NEG_INFINITY, f32::max), bounds.max[d]);
        }
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let side = if node.name() == Some("R1") {
            -half
        } else {
            half
        };
        assert!(
            reader
                .read_normals()
                .unwrap()
                .all(|n| n == [side, 0.0, half])
        );
        let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
        for corners in indices.chunks(3) {
            triangles.push([0, 1, 2].map(|k| places[corners[k] as usize].map(f64::from)));
        }
        let material = primitive.material();
        assert!(material.double_sided());
        let [red, green, blue, alpha] = material.pbr_metallic_roughness().base_color_factor();
        // 128 of 255 is 0.2158605 of the light.
        let expected = match node.name() {
            Some("R1") => [1.0, 0.215_860_5, 0.0],
            _ => [0.0, 0.051_269_46, 1.0],
        };
        for (is, should) in [red, green, blue].iter().zip(expected) {
            assert!((is - should).abs() < 1e-6, "{is} {should}");
        }
        assert_eq!(alpha, 1.0);
    }
    is_the_mesh(&triangles, 1000.0);
}

fn points(intensity: impl Fn(usize) -> u8) -> Vec<Point> {
    let at = |k: usize| 0.1 * k as f64;
    (0..5000)
        .map(|k| Point {
            place_mm: [at(k / 70) + 1.0 / 3.0, at(k % 70), libm::sin(at(k)) * 40.0],
            intensity: intensity(k),
        })
        .collect()
}

fn scan() -> ScanDetails<'static> {
    ScanDetails {
        name: "house ]]> <7>",
        generator: "Relief 0",
        source: "Table scanner, serial number 12",
        serial: Some("12"),
        // 2026-11-21T09:30:00Z.
        taken_s: 1_795_253_400.0,
        guids: [
            "{3f2504e0-4f89-41d3-9a0c-0305e82c3301}",
            "{3f2504e0-4f89-41d3-9a0c-0305e82c3302}",
        ],
    }
}

fn written_points(points: &[Point], format: PointFormat) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_points(&Source(points), format, &scan(), &mut bytes).unwrap();
    let mut again = Vec::new();
    write_points(&Source(points), format, &scan(), &mut again).unwrap();
    assert!(bytes == again);
    bytes
}

struct Source<'a>(&'a [Point]);

impl Points for Source<'_> {
    fn visit(&self, take: &mut dyn FnMut(Point) -> std::io::Result<()>) -> std::io::Result<()> {
        self.0.visit(take)
    }
}

#[test]
fn points_of_ply_come_back_to_the_last_bit() {
    use ply_rs_bw::ply::{DefaultElement, Property};
    let of = |bytes: &[u8]| {
        let parser = ply_rs_bw::parser::Parser::<DefaultElement>::new();
        parser.read_ply(&mut Cursor::new(bytes)).unwrap()
    };
    let points = points(|k| (k % 251) as u8);
    let ply = of(&written_points(&points, PointFormat::Ply));
    let vertices = &ply.payload["vertex"];
    assert_eq!(vertices.len(), points.len());
    for (vertex, point) in vertices.iter().zip(&points) {
        let at = |axis: &str| match vertex[axis] {
            Property::Double(value) => value,
            ref other => panic!("{other:?}"),
        };
        assert_eq!(["x", "y", "z"].map(at), point.place_mm);
        assert_eq!(vertex["intensity"], Property::UChar(point.intensity));
    }
    let plain = of(&written_points(&self::points(|_| 255), PointFormat::Ply));
    assert!(plain.payload["vertex"][0].get("intensity").is_none());
}

#[test]
fn points_of_e57_are_metres_with_name_sensor_and_time() {
    let points = points(|k| (k % 251) as u8);
    let bytes = written_points(&points, PointFormat::E57);
    // Checks the sums of every page.
    let mut file = e57::E57Reader::new(Cursor::new(&bytes)).unwrap();
    assert_eq!(file.guid(), scan().guids[0]);
    let clouds = file.pointclouds();
    let [cloud] = &clouds[..] else {
        panic!("{} scans", clouds.len());
    };
    assert_eq!(cloud.records, points.len() as u64);
    assert_eq!(cloud.guid.as_deref(), Some(scan().guids[1]));
    assert_eq!(cloud.name.as_deref(), Some("house ]] > <7>"));
    assert_eq!(cloud.sensor_serial.as_deref(), Some("12"));
    assert_eq!(cloud.sensor_model.as_deref(), Some(scan().source));
    // 17 days short of 46 years and 11 months, and 18 leap seconds.
    let taken = cloud.acquisition_start.as_ref().unwrap().gps_time;
    assert_eq!(taken, 1_795_253_400.0 - 315_964_800.0 + 18.0);
    let bounds = cloud.cartesian_bounds.as_ref().unwrap();
    let highest = points.iter().map(|p| p.place_mm[2]).fold(0.0, f64::max);
    assert_eq!(bounds.z_max, Some(highest / 1000.0));
    let read = file.pointcloud_raw(cloud).unwrap();
    for (values, point) in read.zip(&points) {
        let values = values.unwrap();
        for (value, mm) in values.iter().zip(point.place_mm) {
            assert!(matches!(value, e57::RecordValue::Double(m) if *m == mm / 1000.0));
        }
        let light = i64::from(point.intensity);
        assert!(matches!(values[3], e57::RecordValue::Integer(i) if i == light));
    }
    let plain = written_points(&self::points(|_| 255), PointFormat::E57);
    let file = e57::E57Reader::new(Cursor::new(&plain)).unwrap();
    assert!(!file.pointclouds()[0].has_intensity());
}

#[test]
fn a_destination_that_fails_is_told() {
    struct Full;
    impl std::io::Write for Full {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(std::io::ErrorKind::StorageFull.into())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let is_full = |error: mesh_files::MeshFileError| {
        error.io().map(std::io::Error::kind) == Some(std::io::ErrorKind::StorageFull)
    };
    for format in MeshFormat::ALL {
        let error = write_mesh(&mesh(), format, &details(), &mut Full).unwrap_err();
        assert!(is_full(error), "{format:?}");
    }
    let points = points(|_| 7);
    for format in PointFormat::ALL {
        let error = write_points(&Source(&points), format, &scan(), &mut Full).unwrap_err();
        assert!(is_full(error), "{format:?}");
    }
}
