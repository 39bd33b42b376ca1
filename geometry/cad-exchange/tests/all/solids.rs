//! Parts that OpenCASCADE wrote, as triangles, against their volumes and areas by OpenCASCADE
//! (`solids/make.py`); and what is refused.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on says where")]

use std::collections::BTreeMap;

use cad_exchange::step::read_body;
use solids::{FacetSettings, Facets, facets};

const TOLERANCE_MM: f64 = 0.002;

fn text(name: &str) -> String {
    let path = format!("{}/tests/solids/{name}.step", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

fn made(text: &str) -> Facets {
    let body = read_body(text.as_bytes()).unwrap();
    let settings = FacetSettings {
        tolerance_mm: TOLERANCE_MM,
        most: 1_000_000,
    };
    facets(&body, &settings).unwrap()
}

/// Volume and area of a closed body.
fn measured(facets: &Facets) -> (f64, f64) {
    let mut sides: BTreeMap<[usize; 2], i32> = BTreeMap::new();
    let (mut volume, mut area) = (0.0, 0.0);
    for t in &facets.triangles {
        let [a, b, c] = t.map(|k| facets.points_mm[k]);
        volume += a.dot(&b.cross(&c)) / 6.0;
        area += (b - a).cross(&(c - a)).norm() / 2.0;
        for k in 0..3 {
            let (from, to) = (t[k], t[(k + 1) % 3]);
            let way = if from < to { 1 } else { -1 };
            *sides.entry([from.min(to), from.max(to)]).or_insert(0) += way;
        }
    }
    let open = sides.values().filter(|net| **net != 0).count();
    assert_eq!(open, 0, "sides of one triangle");
    (volume, area)
}

fn holds(name: &str, (volume_mm3, area_mm2): (f64, f64)) {
    let (volume, area) = measured(&made(&text(name)));
    // Triangles lie inside of what is round, by a part of the tolerance.
    let is_near = (volume - volume_mm3).abs() < 0.25 * TOLERANCE_MM * area_mm2
        && (area / area_mm2 - 1.0).abs() < 1e-4;
    assert!(is_near, "{name}: {volume} mm3, {area} mm2");
}

const BRACKET: (f64, f64) = (11_002.154, 3_808.857);

#[test]
fn a_part_of_planes_cylinders_cones_spheres_and_tori_closes() {
    holds("bracket", BRACKET);
}

#[test]
fn a_part_in_inches_is_as_large() {
    holds("bracket-inch", BRACKET);
}

#[test]
fn a_part_of_rational_splines_that_close_is_the_same() {
    holds("bracket-splines", BRACKET);
}

#[test]
fn turned_and_swept_splines_close() {
    holds("vase", (2498.440, 1350.393));
}

#[test]
fn angles_in_degrees_are_taken_as_such() {
    let radians = "( NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.) );";
    let degrees = "( CONVERSION_BASED_UNIT('DEGREE',#99998) NAMED_UNIT(*) PLANE_ANGLE_UNIT() );
#99998 = PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(1.745329251994E-02),#99999);
#99999 = ( NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.) );";
    let text = text("bracket");
    let text = text
        .replace("2.,0.404891786285", "2.,23.19859051365")
        .replace(radians, degrees);
    assert!(text.contains("DEGREE") && text.contains("23.19"));
    let (volume, area) = measured(&made(&text));
    assert!((volume - BRACKET.0).abs() < 0.5 && (area - BRACKET.1).abs() < 0.5);
}

#[test]
fn a_shell_turned_inside_out_is_a_void() {
    let text = text("bracket").replace(
        "MANIFOLD_SOLID_BREP('',#16);",
        "MANIFOLD_SOLID_BREP('',#99999);\n#99999 = ORIENTED_CLOSED_SHELL('',*,#16,.F.);",
    );
    let (volume, _) = measured(&made(&text));
    assert!((volume + BRACKET.0).abs() < 0.5, "{volume}");
}

#[test]
fn shells_of_this_writer_are_read_as_well() {
    let path = format!("{}/tests/golden", env!("CARGO_MANIFEST_DIR"));
    let mut read = 0;
    for entry in std::fs::read_dir(path).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "step") {
            let facets = made(&std::fs::read_to_string(&path).unwrap());
            assert!(!facets.triangles.is_empty(), "{}", path.display());
            read += 1;
        }
    }
    assert!(read > 0);
}

#[test]
fn what_is_not_read_is_told() {
    let refused = |text: &str| read_body(text.as_bytes()).unwrap_err().to_string();
    let bracket = text("bracket");
    let told = refused(&bracket.replacen("CYLINDRICAL_SURFACE", "OFFSET_SURFACE", 1));
    assert!(
        told.contains("OFFSET_SURFACE") && told.contains("line "),
        "{told}"
    );
    assert!(told.contains("export the part as a solid"), "{told}");
    let end = "ENDSEC;\nEND-ISO";
    let placed = format!("#99999 = MAPPED_ITEM('',#1,#2);\n{end}");
    let told = refused(&bracket.replace(end, &placed));
    assert!(told.contains("assembly"), "{told}");
    let told = refused(&bracket.replace("MANIFOLD_SOLID_BREP(", "GEOMETRIC_CURVE_SET("));
    assert!(
        told.contains("holds no solid or shell with faces"),
        "{told}"
    );
    let told = refused(&bracket[..bracket.len() / 2]);
    assert!(told.contains("cut off") || told.contains("line "), "{told}");
    assert!(refused("solid x").contains("no STEP file"));
}

#[test]
fn bytes_changed_and_lost_cause_no_panic() {
    let whole = text("vase").into_bytes();
    let mut state = 7_u64;
    let mut dice = |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let settings = FacetSettings {
        tolerance_mm: 0.1,
        most: 20_000,
    };
    let mut read = 0;
    for _ in 0..150 {
        let mut bytes = whole.clone();
        for _ in 0..1 + dice(3) {
            let at = dice(bytes.len());
            match dice(3) {
                0 => bytes[at] = b"0123456789.#$*(),'EF"[dice(20)],
                1 => {
                    bytes.remove(at);
                }
                _ => bytes.truncate(bytes.len() - dice(40)),
            }
        }
        if let Ok(body) = read_body(bytes.as_slice()) {
            // Whatever the numbers are, there are triangles or a reason why not.
            let _ = facets(&body, &settings);
            read += 1;
        }
    }
    assert!(read > 0);
}
