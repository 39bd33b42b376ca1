//! Hand-made scenes with hand-made labels: only the decision is on trial.

use super::*;
use range_image::Lattice;

const PITCH_MM: f64 = 0.5;

/// An image and its labels from a height and a label over each place, millimetres.
fn scene(
    (columns, rows): (usize, usize),
    at: impl Fn(f64, f64) -> Option<(f64, u16)>,
) -> (RangeImage, RegionMap) {
    let lattice = Lattice { pitch_mm: PITCH_MM };
    let mut image = RangeImage::masked(lattice, 0, 0, columns, rows);
    let mut labels = vec![0; columns * rows];
    for column in 0..columns {
        for row in 0..rows {
            if let Some((z, label)) = at(image.x_mm(column), image.y_mm(row)) {
                image.set_z_mm(column, row, Some(z));
                labels[column * rows + row] = label;
            }
        }
    }
    let map = RegionMap::new(&image, labels);
    (image, map)
}

/// A ball of 15 mm radius around a place, or what lies behind.
fn ball_before(x: f64, y: f64, centre: [f64; 3], behind: Option<(f64, u16)>) -> Option<(f64, u16)> {
    let off = (x - centre[0]).powi(2) + (y - centre[1]).powi(2);
    let label = 9;
    if off < 14.0 * 14.0 {
        Some((centre[2] + (225.0 - off).sqrt(), label))
    } else {
        behind
    }
}

fn kinds(found: &Background) -> Vec<BackgroundKind> {
    found.regions.iter().map(|region| region.kind).collect()
}

#[test]
fn a_plane_behind_a_ball_is_a_back_plane() {
    let (image, map) = scene((160, 120), |x, y| {
        ball_before(x, y, [40.0, 30.0, 30.0], Some((0.1 * x, 1)))
    });
    let found = background(&image, &map, &View::default());
    assert_eq!(kinds(&found), [BackgroundKind::BackPlane]);
    let region = &found.regions[0];
    assert_eq!(map.label(0, 0), region.label);
    let plane = region.plane.expect("it is one");
    assert!(plane.distance_mm(10.0, 3.0, 1.0).abs() < 1e-6);
    assert!(plane.rms_mm < 1e-6 && plane.normal[2] > 0.99);
    assert_eq!(
        region.nodes,
        map.node_counts()[usize::from(region.label) - 1]
    );
}

/// A box with three faces in view on a table that meets a wall; seen from above and before.
fn bench(x: f64, y: f64) -> Option<(f64, u16)> {
    // Table: z = 40 - y; wall: z = y - 40; a box-like roof in front of both.
    let (table, wall) = (40.0 - y, y - 40.0);
    let roof = 30.0 - 1.2 * (x - 40.0).abs() - 0.6 * (y - 35.0).abs();
    let behind = table.max(wall);
    if roof > behind {
        Some((roof, if x < 40.0 { 3 } else { 4 }))
    } else {
        Some((behind, if table > wall { 1 } else { 2 }))
    }
}

#[test]
fn table_and_wall_are_recognised_and_the_part_is_not() {
    let (image, map) = scene((160, 160), bench);
    let found = background(&image, &map, &View::default());
    let labels: Vec<u16> = found.regions.iter().map(|r| r.label).collect();
    let mut expected = [map.label(0, 0), map.label(0, 159)];
    expected.sort_unstable();
    assert_eq!(labels, expected);
    // The roof comes down to both.
    assert!(found.regions.iter().all(|r| r.why.contains("left")));
    assert!(found.notes.is_empty());
}

#[test]
fn what_is_known_of_the_view_decides() {
    // The same picture, but the scanner looked farther: the planes end by themselves.
    let (image, map) = scene((160, 160), bench);
    let beyond = View {
        x_mm: Some((-20.0, 100.0)),
        y_mm: Some((-20.0, 100.0)),
    };
    assert_eq!(background(&image, &map, &beyond), Background::default());
    let exact = View {
        x_mm: Some((-0.3, 80.0)),
        y_mm: None,
    };
    assert_eq!(background(&image, &map, &exact).regions.len(), 2);
    // A region of interest cuts off what goes on beyond it.
    let cut = beyond.within((0.0, 79.5), (0.0, 79.5));
    assert_eq!(background(&image, &map, &cut).regions.len(), 2);
}

#[test]
fn planes_alone_are_a_part() {
    let (image, map) = scene((100, 100), |x, y| Some((0.2 * x - 0.1 * y, 1)));
    let found = background(&image, &map, &View::default());
    assert!(found.regions.is_empty());
    assert!(found.notes[0].contains("taken for the part"), "{found:?}");
    let (image, map) = scene((100, 100), |x, y| {
        let (low, high) = (20.0 - y, y - 20.0);
        Some((low.max(high) + 0.0 * x, if low > high { 1 } else { 2 }))
    });
    let found = background(&image, &map, &View::default());
    assert_eq!(found, Background::default(), "an angle of two faces");
}

#[test]
fn welds_and_letters_on_a_plate_stay() {
    // A bead 4 mm high and 50 mm long.
    let (image, map) = scene((160, 120), |x, y| {
        let bead = 4.0 - (y - 30.0).powi(2) / 4.0;
        if (15.0..65.0).contains(&x) && bead > 0.0 {
            Some((bead, 2))
        } else {
            Some((0.0, 1))
        }
    });
    let found = background(&image, &map, &View::default());
    assert!(found.regions.is_empty());
    assert!(found.notes[0].contains("rises 4"), "{:?}", found.notes);
}

#[test]
fn a_convex_part_alone_and_a_groove_stay() {
    let (image, map) = scene((120, 120), |x, y| {
        let roof = 40.0 - (x - 30.0).abs() - 0.2 * y;
        (roof > 15.0).then_some((roof, if x < 30.0 { 1 } else { 2 }))
    });
    let found = background(&image, &map, &View::default());
    assert_eq!(found, Background::default(), "a roof");
    // The bottom of a groove lies behind all else, but reaches two sides only.
    let (image, map) = scene((120, 120), |_, y| {
        let flank = (y - 30.0).abs() - 8.0;
        Some(if flank > 10.0 {
            (10.0, if y < 30.0 { 4 } else { 5 })
        } else if flank > 0.0 {
            (flank, if y < 30.0 { 2 } else { 3 })
        } else {
            (0.0, 1)
        })
    });
    let found = background(&image, &map, &View::default());
    assert_eq!(found, Background::default(), "a groove");
    // A disc under a block touches each side of the picture at a point.
    let (image, map) = scene((120, 120), |x, y| {
        let inside = (x - 30.0).powi(2) + (y - 30.0).powi(2) < 880.0;
        let block = (x - 30.0).abs() < 10.0 && (y - 30.0).abs() < 10.0;
        inside.then_some(if block { (20.0, 2) } else { (0.0, 1) })
    });
    let found = background(&image, &map, &View::default());
    assert_eq!(found, Background::default(), "a disc");
}

#[test]
fn a_clamp_from_outside_is_a_fixture_and_a_second_part_is_not() {
    let (image, map) = scene((240, 120), |x, y| {
        let clamp = x > 105.0 && (y - 30.0).abs() < 5.0;
        let second = (x - 80.0).abs() < 6.0 && (y - 10.0).abs() < 6.0;
        let behind = Some(if clamp {
            (25.0, 3)
        } else if second {
            (20.0, 4)
        } else {
            (0.0, 1)
        });
        ball_before(x, y, [35.0, 30.0, 20.0], behind)
    });
    let found = background(&image, &map, &View::default());
    let clamp = map.label(230, 60);
    assert_eq!(
        found.region(clamp).map(|r| r.kind),
        Some(BackgroundKind::Fixture)
    );
    assert_eq!(found.regions.len(), 2, "{found:?}");
    assert!(found.region(map.label(160, 20)).is_none());
}

#[test]
fn nothing_at_all_is_no_background() {
    let (image, map) = scene((3, 3), |_, _| None);
    assert_eq!(
        background(&image, &map, &View::default()),
        Background::default()
    );
}
