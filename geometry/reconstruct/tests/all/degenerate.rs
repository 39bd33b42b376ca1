//! Input at the edge of what can be: nothing, lines, nests, and a caller who gives up.

#![allow(clippy::unwrap_used)]

use crate::common;

use common::run;
use range_image::image::{Lattice, RangeImage};
use range_image::{Monitor, RegionMap, Unmonitored};
use reconstruct::{EdgeKind, Method, ReconstructError, ReconstructSettings, check, reconstruct};

/// An image of 0.5 mm pitch with `label` at each node; z is 3 mm per label.
fn labelled(
    columns: usize,
    rows: usize,
    label: impl Fn(usize, usize) -> u16,
) -> (RangeImage, RegionMap) {
    let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, 2, -9, columns, rows);
    let mut labels = vec![0; columns * rows];
    for column in 0..columns {
        for row in 0..rows {
            let label = label(column, row);
            if label != 0 {
                image.set_z_mm(column, row, Some(f64::from(label) * 3.0));
                labels[column * rows + row] = label;
            }
        }
    }
    let map = RegionMap::new(&image, labels);
    (image, map)
}

fn refusal(image: &RangeImage, map: &RegionMap) -> ReconstructError {
    reconstruct(image, map, &ReconstructSettings::default(), &Unmonitored).unwrap_err()
}

#[test]
fn nothing_is_an_error_that_says_so() {
    let (image, map) = labelled(10, 10, |_, _| 0);
    assert_eq!(refusal(&image, &map), ReconstructError::NoRegions);
    let (image, map) = labelled(0, 0, |_, _| 1);
    assert_eq!(refusal(&image, &map), ReconstructError::NoRegions);
}

#[test]
fn lines_and_single_columns_give_no_face() {
    for (columns, rows) in [(1, 200), (200, 1)] {
        let (image, map) = labelled(columns, rows, |_, _| 1);
        assert!(matches!(
            refusal(&image, &map),
            ReconstructError::NoFaces { regions: 1, .. }
        ));
    }
    // A line beside a region: the region stays, the line is named.
    let (image, map) = labelled(60, 40, |c, r| match (c, r) {
        (10, 5..35) => 1,
        (20..50, 5..35) => 2,
        _ => 0,
    });
    let done = run(&image, &map, Method::Relief);
    assert_eq!(done.model.faces.len(), 1);
    assert_eq!(done.warnings.len(), 1);
    assert!(
        done.warnings[0].contains("too thin"),
        "{}",
        done.warnings[0]
    );
    assert_eq!(done.metrics.lost_nodes, 30);
}

#[test]
fn a_map_of_another_image_is_refused() {
    let (image, _) = labelled(10, 10, |_, _| 1);
    let (_, map) = labelled(10, 11, |_, _| 1);
    assert!(matches!(
        refusal(&image, &map),
        ReconstructError::SizeMismatch { map_rows: 11, .. }
    ));
}

#[test]
fn a_region_may_touch_every_side_of_the_image() {
    for method in [Method::Relief, Method::ShimLee] {
        let (image, map) = labelled(40, 30, |_, _| 1);
        let done = run(&image, &map, method);
        let model = &done.model;
        assert_eq!(
            (model.faces.len(), model.edges.len(), model.vertices.len()),
            (1, 4, 4)
        );
        assert_eq!(
            (done.metrics.lost_nodes, done.metrics.invented_nodes),
            (0, 0)
        );
        // The border runs half a pitch outside the outermost nodes.
        let corners = model.vertices.iter().map(|v| (v.x_mm, v.y_mm));
        let far = corners.fold((0.0_f64, f64::MIN), |a, v| (a.0.max(v.0), a.1.max(v.1)));
        assert!(
            (far.0 - 20.75).abs() < 0.15 && (far.1 - 10.25).abs() < 0.15,
            "{far:?}"
        );
    }
}

#[test]
fn nests_of_regions_keep_their_holes() {
    let ring = |c: usize, r: usize| c.abs_diff(40).max(r.abs_diff(40));
    let (image, map) = labelled(81, 81, |c, r| match ring(c, r) {
        0..=8 => 3,
        9..=16 => 0,
        17..=25 => 2,
        26..=38 => 1,
        _ => 0,
    });
    for method in [Method::Relief, Method::ShimLee] {
        let done = run(&image, &map, method);
        let holes: Vec<usize> = done.model.faces.iter().map(|f| f.inner.len()).collect();
        assert_eq!(holes, [1, 1, 0]);
        let kinds = |kind| done.model.edges.iter().filter(|e| e.kind == kind).count();
        assert!(kinds(EdgeKind::Step) >= 4 && kinds(EdgeKind::Silhouette) >= 12);
    }
}

#[test]
fn two_regions_may_share_two_borders() {
    // Region 2 bridges a gap in region 1 twice: they meet on both sides of a hole.
    let (image, map) = labelled(60, 60, |c, r| match (c, r) {
        (25..35, 22..38) => 0,
        (5..55, 5..30) => 1,
        (5..55, 30..55) => 2,
        _ => 0,
    });
    let done = run(&image, &map, Method::Relief);
    assert_eq!(done.model.faces.len(), 2);
    let shared = done
        .model
        .edges
        .iter()
        .filter(|e| e.kind != EdgeKind::Silhouette)
        .count();
    assert_eq!(shared, 2);
    assert_eq!(done.model.vertices.len(), 12);
}

#[test]
fn a_region_in_parts_gives_a_face_for_each_with_its_own_name() {
    let (image, map) = labelled(50, 20, |c, r| match (c, r) {
        (2..20 | 30..48, 2..18) => 1,
        _ => 0,
    });
    let done = run(&image, &map, Method::Relief);
    let names: Vec<&str> = done.model.faces.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["Region 1 part 1", "Region 1 part 2"]);
    assert_eq!((done.regions.len(), done.regions[0].faces), (1, 2));
}

struct GivesUp;

impl Monitor for GivesUp {
    fn is_cancelled(&self) -> bool {
        true
    }

    fn progress(&self, _: f64) {}
}

#[test]
fn cancelling_is_heard() {
    let (image, map) = labelled(30, 30, |_, _| 1);
    let done = reconstruct(&image, &map, &ReconstructSettings::default(), &GivesUp);
    assert!(matches!(done, Err(ReconstructError::Cancelled(_))));
}

#[test]
fn the_check_finds_what_is_broken() {
    let (image, map) = labelled(30, 30, |c, _| 1 + u16::from(c > 14));
    let whole = run(&image, &map, Method::Relief).model;
    let broken = |change: &dyn Fn(&mut reconstruct::Model)| {
        let mut model = whole.clone();
        change(&mut model);
        check::model(&model).is_err()
    };
    assert!(broken(&|m| m.faces[0].outer.coedges.reverse()));
    assert!(broken(&|m| {
        m.faces[0].outer.coedges.pop();
    }));
    assert!(broken(&|m| m.faces[0].outer.coedges[1]
        .space_curve
        .pieces[0][2][0] += 1e-3));
    assert!(broken(&|m| m.faces[1].outer.coedges[0].edge.0 = 999));
    assert!(broken(&|m| m.faces[1].outer.coedges[0]
        .parameter_curve
        .breaks[0] = f64::NAN));
    assert!(broken(&|m| m.vertices[0].x_mm += 1e-6));
    assert!(broken(&|m| {
        m.faces.pop();
    }));
}
