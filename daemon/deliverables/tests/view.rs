//! The view holds what model and report say, and stays small.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on is a test that has failed"
)]

mod common;

use std::collections::BTreeMap;

use common::{Nobody, columns};
use deliverables::{CadOptions, Inputs, PageFormats, Report, ScanReport, write_view};
use gltf::mesh::Mode;
use gltf::{Gltf, Primitive, Semantic};
use pipeline::{Outcome, Settings, process_columns};
use range_image::{GridColumn, Lattice, RangeImage, RangeImageBuilder};
use serde_json::Value;

struct Scan {
    image: RangeImage,
    outcome: Outcome,
    settings: Settings,
}

fn scan() -> Scan {
    let mut settings = Settings::new(0.5);
    settings.segment.minimum_nodes = 40;
    let (image, outcome) = process_columns(&columns(), &settings, &Nobody).unwrap();
    Scan {
        image,
        outcome,
        settings,
    }
}

fn view(scan: &Scan) -> (Report, Vec<u8>) {
    let inputs = Inputs {
        name: "three surfaces",
        timestamp: "2026-11-21T13:17:09.753Z".parse().unwrap(),
        image: &scan.image,
        outcome: &scan.outcome,
        settings: &scan.settings,
        cad: &CadOptions::default(),
        points: None,
        page: PageFormats::NONE,
        scan: ScanReport::default(),
        warnings: Vec::new(),
        versions: BTreeMap::new(),
    };
    let mut bytes = Vec::new();
    write_view(&inputs, &Nobody, &mut bytes).unwrap();
    (Report::new(&inputs, BTreeMap::new()), bytes)
}

/// What was read back.
struct Read(Gltf);

impl Read {
    fn of(bytes: &[u8]) -> Self {
        Self(Gltf::from_slice(bytes).unwrap())
    }

    fn primitives(&self, name: &str) -> Vec<Primitive<'_>> {
        let mut meshes = self.0.meshes();
        let mesh = meshes.find(|mesh| mesh.name() == Some(name));
        mesh.map_or(Vec::new(), |mesh| mesh.primitives().collect())
    }

    fn blob(&self) -> &[u8] {
        self.0.blob.as_deref().unwrap()
    }

    fn places(&self, primitive: &Primitive<'_>) -> Vec<[f64; 3]> {
        let reader = primitive.reader(|_| Some(self.blob()));
        let places = reader.read_positions().unwrap();
        places.map(|place| place.map(f64::from)).collect()
    }

    fn indices(&self, primitive: &Primitive<'_>) -> Vec<usize> {
        let reader = primitive.reader(|_| Some(self.blob()));
        let indices = reader.read_indices().unwrap().into_u32();
        indices.map(|index| index as usize).collect()
    }

    fn numbers(&self, primitive: &Primitive<'_>, name: &str) -> Option<Vec<f64>> {
        let (_, accessor) = primitive
            .attributes()
            .find(|(semantic, _)| *semantic == Semantic::Extras(name.to_owned()))?;
        let get = |_: gltf::Buffer<'_>| Some(self.blob());
        let values = gltf::accessor::Iter::<f32>::new(accessor, get)?;
        Some(values.map(f64::from).collect())
    }
}

fn extras(primitive: &Primitive<'_>) -> Value {
    serde_json::from_str(primitive.extras().as_ref().unwrap().get()).unwrap()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|d| a[d] - b[d])
}

#[test]
fn faces_lie_on_the_shapes_of_the_report() {
    let scan = scan();
    let (report, bytes) = view(&scan);
    let read = Read::of(&bytes);
    let faces = read.primitives("faces");
    assert_eq!(faces.len(), report.model.faces);
    assert_eq!(faces.len(), 3);
    let mut kinds = Vec::new();
    for (index, face) in faces.iter().enumerate() {
        let told = extras(face);
        assert_eq!(told["face"], index);
        let mut regions = report.regions.list.iter();
        let region = regions.find(|r| told["region"] == r.label).unwrap();
        assert_eq!(told["kind"], region.kind.as_str());
        assert!(
            region
                .faces
                .iter()
                .any(|name| told["name"] == name.as_str())
        );
        kinds.push(region.kind.clone());

        let (places, indices) = (read.places(face), read.indices(face));
        assert_eq!(face.mode(), Mode::Triangles);
        assert!(!indices.is_empty() && indices.len().is_multiple_of(3));
        let reader = face.reader(|_| Some(read.blob()));
        let normals: Vec<[f64; 3]> = reader
            .read_normals()
            .unwrap()
            .map(|normal| normal.map(f64::from))
            .collect();
        let area: f64 = indices
            .chunks(3)
            .map(|t| {
                let [a, b, c] = [places[t[0]], places[t[1]], places[t[2]]];
                let (u, v) = (minus(b, a), minus(c, a));
                let cross = [
                    u[1] * v[2] - u[2] * v[1],
                    u[2] * v[0] - u[0] * v[2],
                    u[0] * v[1] - u[1] * v[0],
                ];
                // Towards the camera, as the normals.
                assert!(dot(cross, normals[t[0]]) > 0.0);
                dot(cross, cross).sqrt() / 2.0
            })
            .sum();
        let whole = region.area_mm2.unwrap();
        assert!((area / whole - 1.0).abs() < 0.02, "{area} of {whole}");

        let Some(numbers) = region.shape.as_ref().and_then(|s| s.numbers.as_ref()) else {
            continue;
        };
        let (Some(direction), point) = (numbers.direction, numbers.point_mm) else {
            continue;
        };
        for (&place, &normal) in places.iter().zip(&normals) {
            let along = dot(minus(place, point), direction);
            match region.kind.as_str() {
                "plane" => {
                    assert!(along.abs() < 1e-4, "{along}");
                    assert!((dot(normal, direction) - 1.0).abs() < 1e-6);
                }
                "cylinder" => {
                    let across = minus(minus(place, point), direction.map(|c| along * c));
                    let radius = numbers.radius_mm.unwrap().value;
                    let off = dot(across, across).sqrt() - radius;
                    // As far as patches may lie off a form.
                    assert!(off.abs() < 0.02, "{off}");
                }
                other => panic!("{other}"),
            }
        }
    }
    kinds.sort();
    assert_eq!(kinds, ["bicubic patches", "cylinder", "plane"]);
}

#[test]
fn edges_are_the_borders_of_the_faces() {
    let scan = scan();
    let read = Read::of(&view(&scan).1);
    let length = |places: &[[f64; 3]], [a, b]: [usize; 2]| {
        let side = minus(places[b], places[a]);
        dot(side, side).sqrt()
    };
    // Nothing joins these faces: a side of one triangle only is one of the border.
    let mut borders_mm = 0.0;
    for face in read.primitives("faces") {
        let (places, indices) = (read.places(&face), read.indices(&face));
        let mut uses: BTreeMap<[usize; 2], usize> = BTreeMap::new();
        for triangle in indices.chunks(3) {
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        let free = uses.iter().filter(|(_, uses)| **uses == 1);
        borders_mm += free.map(|(side, _)| length(&places, *side)).sum::<f64>();
    }
    let mut lines_mm = BTreeMap::new();
    for lines in read.primitives("edges") {
        assert_eq!(lines.mode(), Mode::Lines);
        let (places, indices) = (read.places(&lines), read.indices(&lines));
        let sides = indices
            .chunks(2)
            .map(|ends| length(&places, [ends[0], ends[1]]));
        let kind = extras(&lines)["kind"].as_str().unwrap().to_owned();
        *lines_mm.entry(kind).or_insert(0.0) += sides.sum::<f64>();
    }
    let whole: f64 = lines_mm.values().sum();
    assert!(
        (whole / borders_mm - 1.0).abs() < 2e-3,
        "{whole} of {borders_mm} mm"
    );
    // Outlines are told by the samples beside them.
    assert!(lines_mm["measured"] > 0.5 * whole, "{lines_mm:?}");
}

#[test]
fn nodes_have_the_deviations_of_the_report() {
    let scan = scan();
    let (report, bytes) = view(&scan);
    let read = Read::of(&bytes);
    let nodes = read.primitives("nodes");
    let [with, without] = nodes.as_slice() else {
        panic!("{} primitives", nodes.len());
    };
    assert_eq!((with.mode(), without.mode()), (Mode::Points, Mode::Points));
    assert_eq!(extras(with)["step"], 1);
    assert_eq!(extras(with)["pitch_mm"], 0.5);
    let told = report.deviations.as_ref().unwrap();
    let off = read.numbers(with, "DEVIATION").unwrap();
    assert_eq!(off.len(), told.nodes);
    assert!(off.iter().all(|off| off.is_finite()));
    let mean =
        |of: &dyn Fn(f64) -> f64| off.iter().map(|off| of(*off)).sum::<f64>() / off.len() as f64;
    let rms = mean(&|off| off * off).sqrt();
    assert!((rms - told.rms_mm.unwrap()).abs() < 1e-8, "{rms}");
    assert!((mean(&|off| off) - told.mean_mm.unwrap()).abs() < 1e-8);
    assert!(read.numbers(without, "DEVIATION").is_none());
    let settled = scan
        .outcome
        .settled
        .as_ref()
        .map_or(&scan.image, |s| &s.image);
    let places = [with, without].map(|nodes| read.places(nodes).len());
    assert_eq!(places[0] + places[1], settled.valid_nodes());
    for region in &report.regions.list {
        let labels = [with, without].map(|nodes| read.numbers(nodes, "REGION").unwrap());
        let of = labels
            .iter()
            .flatten()
            .filter(|l| **l == f64::from(region.label));
        assert_eq!(of.count(), region.nodes, "region {}", region.label);
    }
}

#[test]
fn places_are_millimetres_below_a_node_that_makes_metres_of_them() {
    let read = Read::of(&view(&scan()).1);
    let root = read.0.default_scene().unwrap().nodes().next().unwrap();
    let (_, _, scale) = root.transform().decomposed();
    assert_eq!(scale, [1e-3; 3]);
    let names: Vec<String> = root
        .children()
        .filter_map(|n| n.name().map(str::to_owned))
        .collect();
    assert_eq!(names, ["faces", "edges", "nodes"]);
    let asset = read.0.as_json().asset.extras.as_ref().unwrap();
    let told: Value = serde_json::from_str(asset.get()).unwrap();
    assert_eq!(told["units"], "mm");
    // The scan is 60 mm long: its diagonal, not the finer tolerance of files, says how coarse.
    assert!(told["tolerance_mm"].as_f64().unwrap() > 0.02, "{told}");
}

#[test]
fn bytes_follow_from_the_scan_alone() {
    let scan = scan();
    let [one, three] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| view(&scan).1)
    });
    assert!(one == three);
}

#[test]
fn a_large_scan_is_thinned_out() {
    let mut scan = scan();
    scan.outcome.settled = None;
    // What model and labels have to say of these nodes does not matter here.
    let mut builder = RangeImageBuilder::new(Lattice { pitch_mm: 0.05 });
    for i in 0..1500 {
        builder.push(GridColumn {
            i,
            j_first: 0,
            z_mm: (0..1000).map(|j| f64::from(j) * 0.001).collect(),
            quality: Vec::new(),
        });
    }
    scan.image = builder.finish();
    let (_, bytes) = view(&scan);
    assert!(bytes.len() < 4_000_000, "{}", bytes.len());
    let read = Read::of(&bytes);
    let nodes = read.primitives("nodes");
    let shown: usize = nodes.iter().map(|nodes| read.places(nodes).len()).sum();
    // 1.5 million nodes, of which 500 columns and 334 rows remain: every second would be too many.
    assert_eq!(extras(&nodes[0])["step"], 3);
    assert_eq!(shown, 500 * 334);
}
