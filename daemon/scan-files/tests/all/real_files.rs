//! Real scans, where the collection is present.

use crate::common;

use common::real;
use scan_files::{PointScan, ReadOptions, Units, read};

fn scan(name: &str, units: Option<Units>) -> Option<PointScan> {
    let options = ReadOptions {
        units,
        ..ReadOptions::default()
    };
    Some(read(&real(name)?, &options).expect(name))
}

#[test]
fn the_interlaced_bunny_has_its_quarter_millimetre_columns() {
    for (name, points, columns) in [
        ("stanford_bunny/bun000.ply.gz", 40_256, 624),
        ("stanford_bunny/bun045.ply.gz", 40_097, 590),
        ("stanford_bunny/chin.ply.gz", 37_738, 700),
        ("stanford_bunny/top3.ply.gz", 36_023, 773),
    ] {
        let Some(scan) = scan(name, None) else { return };
        assert_eq!(
            (scan.points(), scan.columns.len()),
            (points, columns),
            "{name}"
        );
        assert!((scan.column_pitch_mm - 0.25).abs() < 1e-12, "{name}");
        assert!(
            (1.2..1.6).contains(&scan.sample_spacing_mm),
            "{}",
            scan.sample_spacing_mm
        );
        for column in &scan.columns {
            let steps = column.x_mm / 0.25;
            assert!((steps - steps.round()).abs() < 1e-9, "{}", column.x_mm);
        }
    }
}

#[test]
fn line_ends_make_no_difference() {
    let (Some(a), Some(b)) = (
        scan("stanford_bunny/bun000.ply.gz", None),
        scan("stanford_bunny/bun000_crlf.ply.gz", None),
    ) else {
        return;
    };
    assert_eq!(a, b);
    assert!(a.recommended_pitch_mm() > 0.55 && a.recommended_pitch_mm() < 0.65);
}

#[test]
fn warped_scans_are_clouds() {
    for (name, points) in [
        ("stanford_dragon/dragonStandRight_0.ply.gz", 41_841),
        ("stanford_happy/happyStandRight_0.ply.gz", 78_056),
    ] {
        let Some(scan) = scan(name, None) else { return };
        assert!(
            (points - 50..=points).contains(&scan.points()),
            "{}",
            scan.points()
        );
        println!(
            "{name}: {:?} {} {}",
            scan.notes, scan.column_pitch_mm, scan.sample_spacing_mm
        );
        assert!(scan.notes.iter().any(|n| n.contains("bye")));
        assert!(scan.notes.iter().any(|n| n.contains("metres")));
        assert!(scan.notes.iter().any(|n| n.contains("not in columns")));
        assert!((0.2..0.9).contains(&scan.recommended_pitch_mm()));
    }
}

#[test]
fn robot_clouds_and_meshes_are_read() {
    let Some(plate) = scan("openlmd_plate/plate_welds.xyz.gz", Some(Units::Metre)) else {
        return;
    };
    println!(
        "{:?} {} {}",
        plate.notes, plate.column_pitch_mm, plate.sample_spacing_mm
    );
    assert!(plate.points() > 74_900 && plate.points() <= 74_983);
    let Some(strip) = scan("openlmd_plate/edge_strip.xyz.gz", None) else {
        return;
    };
    assert!(strip.notes.iter().any(|n| n.contains("3 further value(s)")));
    assert!(
        strip
            .notes
            .iter()
            .any(|n| n.contains("if the file is in metres"))
    );
    let Some(mesh) = scan("stanford_bunny/bun_zipper_res3.ply.gz", Some(Units::Metre)) else {
        return;
    };
    assert_eq!(mesh.points(), 1889);
    assert!(mesh.notes.iter().any(|n| n.contains("mesh")));
}
