//! Volumes and faces of parts whose closed form is known.

#![allow(clippy::unwrap_used)]

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use nurbs::{BSplineSurface, KnotVector};
use terraces::{Built, Floor, Operation, Outline, Part, Role, SolidSurface, Treatment, Warning};

fn block() -> Part {
    Part::new(
        Outline::rectangle([50.0, 25.0], 100.0, 50.0, 0.0, 0.0).unwrap(),
        20.0,
        0.0,
    )
}

fn level(z_mm: f64) -> Floor {
    Floor::Level { z_mm }
}

fn rectangle(x: f64, y: f64, length: f64, width: f64, radius: f64) -> Outline {
    Outline::rectangle([x, y], length, width, 0.0, radius).unwrap()
}

fn circle(x: f64, y: f64, r: f64) -> Outline {
    Outline::circle([x, y], r).unwrap()
}

/// Builds without a warning; volume and number of faces are as expected.
fn check(part: &Part, volume_mm3: f64, faces: usize) -> Built {
    let built = part.build().unwrap();
    assert_eq!(built.warnings, []);
    built.solid.check().unwrap();
    let off = built.solid.volume_mm3 / volume_mm3 - 1.0;
    assert!(
        off.abs() < 1e-9,
        "{} instead of {volume_mm3}",
        built.solid.volume_mm3
    );
    let names: Vec<&str> = built.solid.faces.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names.len(), faces, "{names:?}");
    built
}

fn kinds(built: &Built) -> [usize; 6] {
    let mut kinds = [0; 6];
    for face in &built.solid.faces {
        kinds[match face.surface {
            SolidSurface::Plane(_) => 0,
            SolidSurface::Cylinder { .. } => 1,
            SolidSurface::Cone { .. } => 2,
            SolidSurface::Sphere { .. } => 3,
            SolidSurface::Torus { .. } => 4,
            SolidSurface::Spline(_) => 5,
        }] += 1;
    }
    kinds
}

#[test]
fn a_block() {
    let built = check(&block(), 100_000.0, 6);
    assert_eq!(built.solid.vertices.len(), 8);
    assert_eq!(built.solid.edges.len(), 12);
    assert_eq!(
        built.solid.bounding_box_mm(),
        [[0.0; 3], [100.0, 50.0, 20.0]]
    );
}

#[test]
fn a_pocket_with_a_boss_and_a_hole_in_its_floor() {
    let mut part = block();
    let corner = (4.0 - PI) * 9.0;
    part.operations = vec![
        Operation::cut(
            "pocket",
            rectangle(50.0, 25.0, 60.0, 30.0, 3.0),
            level(12.0),
        ),
        Operation::raise("boss", circle(40.0, 25.0, 4.0), level(16.0)),
        Operation::cut("hole", circle(60.0, 25.0, 5.0), Floor::Through),
    ];
    let volume = 100_000.0 - 8.0 * (1800.0 - corner) + 4.0 * PI * 16.0 - 12.0 * PI * 25.0;
    // 6 of the block, 8 walls and a floor, wall and top, wall.
    let built = check(&part, volume, 6 + 9 + 2 + 1);
    assert_eq!(kinds(&built), [12, 6, 0, 0, 0, 0]);
    // A cylinder is one face, cut open along one edge, with one circle at each end.
    let hole = built
        .solid
        .faces
        .iter()
        .find(|f| f.name == "hole wall 1")
        .unwrap();
    assert_eq!((hole.loops.len(), hole.loops[0].len()), (1, 4));
}

#[test]
fn a_slot_through_two_pockets() {
    let mut part = block();
    part.operations = vec![
        Operation::cut("left", rectangle(25.0, 25.0, 30.0, 30.0, 0.0), level(10.0)),
        Operation::cut("right", rectangle(75.0, 25.0, 30.0, 20.0, 0.0), level(5.0)),
        Operation::cut("slot", rectangle(50.0, 25.0, 120.0, 8.0, 0.0), level(7.0)),
    ];
    let volume = 100_000.0 - 9000.0 - 600.0 * 15.0 - 8.0 * (100.0 - 60.0) * 13.0 - 8.0 * 30.0 * 3.0;
    // Block: bottom, 4 sides, top on both sides of the slot. Left: two whole walls, two that the
    // slot parts, a floor that it parts. Right, which is deeper: 4 walls and a floor, all whole.
    // Slot: on each side one wall from the left end to the right pocket, low where it crosses the
    // left one, and one beyond; floors left and right of the right pocket.
    check(&part, volume, 7 + 8 + 5 + 6);
}

#[test]
fn a_step_and_a_slot_that_runs_out() {
    let mut part = block();
    part.operations = vec![
        Operation::cut("step", rectangle(10.0, 25.0, 20.0, 60.0, 0.0), level(15.0)),
        Operation::cut("slot", rectangle(85.0, 25.0, 40.0, 10.0, 0.0), level(8.0)),
    ];
    let volume = 100_000.0 - 20.0 * 50.0 * 5.0 - 35.0 * 10.0 * 12.0;
    check(&part, volume, 6 + 2 + 4);
}

#[test]
fn a_countersunk_hole_and_one_of_a_drill() {
    let mut part = block();
    let mut sunk = Operation::cut("sunk", circle(20.0, 25.0, 3.0), Floor::Through);
    sunk.upper = Some(Treatment::countersink(6.0, 12.0, FRAC_PI_2));
    let angle_rad = 118.0_f64.to_radians();
    let tip = Floor::Tip {
        rim_mm: 8.0,
        angle_rad,
    };
    part.operations = vec![
        sunk,
        Operation::cut("drilled", circle(70.0, 25.0, 4.0), tip),
    ];
    let frustum = PI * 3.0 / 3.0 * (36.0 + 18.0 + 9.0);
    let depth = 4.0 / libm::tan(0.5 * angle_rad);
    let volume = 100_000.0 - (PI * 9.0 * 17.0 + frustum) - PI * 16.0 * (12.0 + depth / 3.0);
    let built = check(&part, volume, 6 + 2 + 2);
    assert_eq!(kinds(&built), [6, 2, 2, 0, 0, 0]);
}

#[test]
fn fillets_rounds_and_chamfers_of_a_pocket_and_a_boss() {
    let mut part = block();
    part.upper = Some(Treatment::Chamfer {
        width_mm: 1.0,
        height_mm: 1.0,
    });
    let mut pocket = Operation::cut(
        "pocket",
        rectangle(50.0, 25.0, 60.0, 30.0, 4.0),
        level(10.0),
    );
    pocket.lower = Some(Treatment::Round { radius_mm: 2.0 });
    pocket.upper = Some(Treatment::Chamfer {
        width_mm: 0.5,
        height_mm: 1.0,
    });
    let mut boss = Operation::raise("boss", circle(50.0, 25.0, 5.0), level(16.0));
    boss.upper = Some(Treatment::Round { radius_mm: 1.5 });
    boss.lower = Some(Treatment::Round { radius_mm: 1.0 });
    part.operations = vec![pocket, boss];
    // Pappus: the spandrel between a square and a quarter circle, its centroid from the corner.
    let spandrel = |r: f64| {
        let area = (1.0 - PI / 4.0) * r * r;
        let from = (r / 2.0 - PI / 4.0 * (r - 4.0 * r / (3.0 * PI))) / (1.0 - PI / 4.0);
        (area, from)
    };
    let straight = 2.0 * (52.0 + 22.0);
    let (fillet, inward) = spandrel(2.0);
    let fillet = fillet * (straight + 2.0 * PI * (4.0 - inward));
    let (chamfer, outward) = (0.25, 0.5 / 3.0);
    let chamfer = chamfer * (straight + 2.0 * PI * (4.0 + outward));
    let (round, inward) = spandrel(1.5);
    let round = round * 2.0 * PI * (5.0 - inward);
    let (foot, outward) = spandrel(1.0);
    let foot = foot * 2.0 * PI * (5.0 + outward);
    // The block's chamfer: a prism along each side, mitred.
    let border = 0.5 * 300.0 - 4.0 / 3.0;
    let pocket = 10.0 * (1800.0 - (4.0 - PI) * 16.0);
    let volume = 100_000.0 - border - pocket + fillet - chamfer + 6.0 * PI * 25.0 - round + foot;
    let built = check(&part, volume, 10 + 9 + 8 + 8 + 4);
    assert_eq!(kinds(&built), [10 + 5 + 4 + 1, 4 + 4 + 1, 4, 0, 4 + 2, 0]);
}

#[test]
fn a_ball_and_a_dome() {
    let mut part = block();
    let ball = Floor::Sphere {
        center_mm: [20.0, 25.0, 20.0],
        radius_mm: 8.0,
    };
    let dome = Floor::Sphere {
        center_mm: [70.0, 25.0, 14.0],
        radius_mm: 10.0,
    };
    part.operations = vec![
        Operation::cut("ball", circle(20.0, 25.0, 8.0), ball),
        Operation::raise("dome", circle(70.0, 25.0, 8.0), dome),
    ];
    let cap = PI * 16.0 / 3.0 * 26.0;
    check(&part, 100_000.0 - 2.0 / 3.0 * PI * 512.0 + cap, 6 + 1 + 1);
}

#[test]
fn a_sloping_floor_that_runs_out_at_the_top() {
    let mut part = block();
    // From 10 at x = 20 up to 25 at x = 80: it leaves the block's top at x = 60.
    let floor = Floor::Plane {
        z_mm: 5.0,
        slope: [0.25, 0.0],
    };
    part.operations = vec![Operation::cut(
        "ramp",
        rectangle(50.0, 25.0, 60.0, 10.0, 0.0),
        floor,
    )];
    check(&part, 100_000.0 - 0.5 * 40.0 * 10.0 * 10.0, 6 + 4);
    // The same across an outline that is round.
    let floor = Floor::Plane {
        z_mm: 0.0,
        slope: [0.2, 0.1],
    };
    part.operations = vec![Operation::cut("disc", circle(50.0, 25.0, 10.0), floor)];
    check(&part, 100_000.0 - PI * 100.0 * 7.5, 6 + 2);
}

#[test]
fn floors_that_reach_below_the_bottom_leave_holes() {
    let mut part = block();
    // From -5 at x = 20 up to 10 at x = 80: a hole up to x = 40.
    let floor = Floor::Plane {
        z_mm: -10.0,
        slope: [0.25, 0.0],
    };
    part.operations = vec![Operation::cut(
        "ramp",
        rectangle(50.0, 25.0, 60.0, 10.0, 0.0),
        floor,
    )];
    check(&part, 100_000.0 - 10.0 * (400.0 + 600.0), 6 + 5);
    // A drill whose tip comes out: the rest of its cone around a round hole.
    let angle_rad = 118.0_f64.to_radians();
    let tip = Floor::Tip {
        rim_mm: 1.0,
        angle_rad,
    };
    part.operations = vec![Operation::cut("drilled", circle(50.0, 25.0, 4.0), tip)];
    let narrow = 4.0 - libm::tan(0.5 * angle_rad);
    let frustum = PI / 3.0 * (16.0 + 4.0 * narrow + narrow * narrow);
    check(&part, 100_000.0 - PI * 16.0 * 19.0 - frustum, 6 + 2);
}

#[test]
fn a_free_form_floor_with_a_hole_through_it() {
    let knots = |last: f64| KnotVector::uniform(3, 5, 0.0, last).unwrap();
    let (u, v) = (knots(100.0), knots(50.0));
    let mut points = Vec::new();
    for i in 0..u.control_count() {
        for j in 0..v.control_count() {
            points.push([10.0 + libm::sin(i as f64) + 0.5 * libm::cos(j as f64)]);
        }
    }
    let spline = Arc::new(BSplineSurface::new(u, v, points).unwrap());
    let mut part = block();
    part.operations = vec![
        Operation::cut(
            "form",
            rectangle(50.0, 25.0, 60.0, 30.0, 5.0),
            Floor::FreeForm(spline.clone()),
        ),
        Operation::cut("hole", circle(45.0, 25.0, 4.0), Floor::Through),
    ];
    let built = part.build().unwrap();
    assert_eq!(built.warnings, []);
    assert_eq!(kinds(&built), [6 + 4, 5, 0, 0, 0, 1]);
    // By a fine grid over the outline.
    let (mut sum, n) = (0.0, 600);
    for i in 0..n {
        for j in 0..n {
            let place = |k: i32, width: f64| width * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
            let (x, y) = (place(i, 60.0), place(j, 30.0));
            let (a, b) = ((x.abs() - 25.0).max(0.0), (y.abs() - 10.0).max(0.0));
            if a * a + b * b < 25.0 {
                let z = spline.evaluate(50.0 + x, 25.0 + y)[0];
                let in_hole = libm::hypot(x + 5.0, y) < 4.0;
                sum += (if in_hole { 20.0 } else { 20.0 - z }) * 1800.0 / f64::from(n * n);
            }
        }
    }
    let volume = 100_000.0 - sum;
    let off = built.solid.volume_mm3 / volume - 1.0;
    assert!(off.abs() < 1e-5, "{off:e}");
}

#[test]
fn walls_nearly_in_line_are_one() {
    let mut part = block();
    part.operations = vec![
        Operation::cut(
            "pocket",
            rectangle(30.0, 25.0, 40.0, 20.0, 0.0),
            level(10.0),
        ),
        Operation::cut(
            "slot",
            rectangle(75.0, 25.005, 60.0, 20.01, 0.0),
            level(10.0),
        ),
    ];
    // One trough, which runs out.
    check(&part, 100_000.0 - 90.0 * 20.0 * 10.0, 6 + 4);
}

#[test]
fn a_boss_that_touches_the_wall_is_moved_and_told() {
    let mut part = block();
    part.operations = vec![
        Operation::cut(
            "pocket",
            rectangle(50.0, 25.0, 60.0, 30.0, 0.0),
            level(10.0),
        ),
        Operation::raise("boss", circle(50.0, 35.0, 5.0), level(15.0)),
    ];
    let built = part.build().unwrap();
    assert!(
        matches!(&built.warnings[..], [Warning::Moved { operation, .. }] if operation == "boss"),
        "{:?}",
        built.warnings
    );
    let volume = 100_000.0 - 18_000.0 + 5.0 * PI * 25.0;
    assert!((built.solid.volume_mm3 / volume - 1.0).abs() < 1e-4);
}

#[test]
fn pockets_that_touch_at_a_corner() {
    let mut part = block();
    part.operations = vec![
        Operation::cut("one", rectangle(30.0, 15.0, 20.0, 10.0, 0.0), level(10.0)),
        Operation::cut("two", rectangle(50.0, 25.0, 20.0, 10.0, 0.0), level(12.0)),
    ];
    let built = part.build().unwrap();
    built.solid.check().unwrap();
    assert!(
        matches!(&built.warnings[..], [Warning::Moved { .. }]),
        "{:?}",
        built.warnings
    );
}

#[test]
fn what_cannot_be_is_left_out_and_told() {
    let mut part = block();
    let mut pocket = Operation::cut(
        "pocket",
        rectangle(50.0, 25.0, 60.0, 30.0, 1.0),
        level(18.0),
    );
    pocket.lower = Some(Treatment::Round { radius_mm: 1.5 });
    pocket.upper = Some(Treatment::Chamfer {
        width_mm: 3.0,
        height_mm: 3.0,
    });
    part.operations = vec![pocket];
    let built = part.build().unwrap();
    assert_eq!(built.warnings.len(), 2, "{:?}", built.warnings);
    assert!(
        built
            .solid
            .faces
            .iter()
            .all(|face| face.role != Role::UpperEdge)
    );
    part.operations = vec![Operation::cut(
        "cut",
        rectangle(40.0, 25.0, 10.0, 80.0, 0.0),
        Floor::Through,
    )];
    let built = part.build().unwrap();
    assert_eq!(built.warnings, [Warning::Parted { parts: 2 }]);
    assert!((built.solid.volume_mm3 - 55_000.0).abs() < 1e-6);
}

#[test]
fn a_level_and_a_sloping_slot_across_the_tip_of_a_hole() {
    let mut part = block();
    let tip = Floor::Tip {
        rim_mm: 15.0,
        angle_rad: 2.06,
    };
    let floors = [
        level(14.0),
        Floor::Plane {
            z_mm: 5.0,
            slope: [0.2, 0.0],
        },
    ];
    for (floor, spans) in floors.into_iter().zip([1, 1]) {
        part.operations = vec![
            Operation::cut("tip", circle(40.0, 25.0, 5.0), tip.clone()),
            Operation::cut("slot", rectangle(44.0, 25.0, 10.0, 4.0, 0.0), floor.clone()),
        ];
        let built = part.build().unwrap();
        assert_eq!(built.warnings, []);
        // The cone goes on below the slot's floor, which is one face around it.
        let floors = built
            .solid
            .faces
            .iter()
            .filter(|f| f.name.starts_with("slot floor"));
        assert_eq!(floors.count(), spans);
        let (mut sum, n) = (0.0, 500);
        for i in 0..n {
            for j in 0..n {
                let place = |k: i32, from: f64| from + 20.0 * (f64::from(k) + 0.5) / f64::from(n);
                let (x, y) = (place(i, 30.0), place(j, 15.0));
                let rho = libm::hypot(x - 40.0, y - 25.0);
                let mut z: f64 = if rho < 5.0 {
                    15.0 - (5.0 - rho) / libm::tan(1.03)
                } else {
                    20.0
                };
                if (x - 44.0).abs() < 5.0 && (y - 25.0).abs() < 2.0 {
                    z = z.min(if let Floor::Plane { z_mm, slope } = floor {
                        z_mm + slope[0] * x
                    } else {
                        14.0
                    });
                }
                sum += (20.0 - z) * 400.0 / f64::from(n * n);
            }
        }
        let cut = 100_000.0 - built.solid.volume_mm3;
        assert!((cut / sum - 1.0).abs() < 2e-3, "{cut} {sum}");
    }
}
