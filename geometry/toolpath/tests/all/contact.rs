//! Where cutters stand: closed forms, and brute force on random triangles.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on says where")]

use crate::bench;

use bench::{Draw, graph, relief, surface};
use proptest::prelude::*;
use range_image::Unmonitored;
use toolpath::{Cutter, Surface, ToolpathError, drop_cutter};

const CUTTERS: [&str; 5] = ["flat:6", "ball:6", "bull:6:1", "bull:6:2.9", "ball:1"];

fn tip(surface: &Surface, cutter: &str, at: [f64; 2]) -> f64 {
    let cutter: Cutter = cutter.parse().unwrap();
    surface.drop_cutter(&cutter, at).unwrap().z_mm
}

#[test]
fn on_a_tilted_plane_tips_stand_as_the_angle_says() {
    let plane = surface(&graph([40.0, 40.0], 40.0, |x, y| 0.5 * x - 0.25 * y));
    let at = [20.0, 20.0];
    let height = 5.0;
    let slope = (0.25_f64 + 0.0625).sqrt();
    let secant = (1.0 + slope * slope).sqrt();
    // A ball of radius r: r / cos - r above the plane.
    assert!((tip(&plane, "ball:6", at) - (height + 3.0 * secant - 3.0)).abs() < 1e-12);
    // A disc of radius r stands on its rim: r tan above.
    assert!((tip(&plane, "flat:6", at) - (height + 3.0 * slope)).abs() < 1e-12);
    // Disc and corner together.
    let bull = height + 2.0 * slope + secant - 1.0;
    assert!((tip(&plane, "bull:6:1", at) - bull).abs() < 1e-12);
}

#[test]
fn a_ball_rolls_on_a_sphere_as_on_a_larger_one() {
    let (radius, centre) = (20.0_f64, 15.0);
    let sphere = surface(&graph([30.0, 30.0], 0.1, |x, y| {
        let square = (x - centre) * (x - centre) + (y - centre) * (y - centre);
        (radius * radius - square).max(0.0).sqrt()
    }));
    // Chords of 0.1 mm lie 0.1^2 / 8 / 20, over the diagonal twice that, below the sphere, and more
    // along z where it is steep.
    for (dx, dy) in [(0.03, 0.02), (3.0, -4.0), (-7.0, 5.0)] {
        let expected = (23.0_f64 * 23.0 - dx * dx - dy * dy).sqrt() - 3.0;
        let found = tip(&sphere, "ball:6", [centre + dx, centre + dy]);
        assert!((expected - found).abs() < 2.5e-4, "{expected} {found}");
        assert!(found < expected + 1e-6, "{expected} {found}");
    }
}

#[test]
fn above_a_single_corner_and_beside_everything() {
    let spike = Surface::new(
        &[[0.0, 0.0, 5.0], [1.0, 0.0, -50.0], [0.0, 1.0, -50.0]],
        &[[0, 1, 2]],
    )
    .unwrap();
    let off = -2.0;
    assert!((tip(&spike, "ball:6", [off, 0.0]) - (5.0 - 3.0 + 5.0_f64.sqrt())).abs() < 1e-12);
    assert!((tip(&spike, "flat:6", [off, 0.0]) - 5.0).abs() < 1e-12);
    let ball: Cutter = "ball:6".parse().unwrap();
    assert!(spike.drop_cutter(&ball, [-3.001, 0.0]).is_none());
    assert_eq!(spike.height_mm([-0.001, 0.0]), None);
    assert!(spike.height_mm([0.1, 0.1]).unwrap() < -5.0);
}

/// The highest tip over many points of all triangles.
fn by_force(triangles: &[[[f64; 3]; 3]], cutter: &Cutter, at: [f64; 2]) -> Option<f64> {
    let parts = 120;
    let mut best: Option<f64> = None;
    for [a, b, c] in triangles {
        for i in 0..=parts {
            for j in 0..=parts - i {
                let (u, v) = (
                    f64::from(i) / f64::from(parts),
                    f64::from(j) / f64::from(parts),
                );
                let p: [f64; 3] =
                    std::array::from_fn(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]));
                let distance = libm::hypot(p[0] - at[0], p[1] - at[1]);
                if let Some(height) = cutter.height_mm(distance) {
                    best = Some(best.map_or(p[2] - height, |z| z.max(p[2] - height)));
                }
            }
        }
    }
    best
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    /// No point of any triangle is inside the cutter, and some point nearly touches it.
    #[test]
    fn cutters_touch_random_triangles_and_enter_none(seed in 0_u64..1_000_000) {
        let mut draw = Draw::new(seed);
        let mut vertices = Vec::new();
        for _ in 0..9 {
            vertices.push([draw.between(-4.0, 4.0), draw.between(-4.0, 4.0), draw.between(-1.5, 1.5)]);
        }
        // The first two share an edge, and most of them overlap as seen from above.
        let indices = [[0, 1, 2], [2, 1, 3], [4, 5, 6], [6, 7, 8]];
        let surface = Surface::new(&vertices, &indices).unwrap();
        let triangles = indices.map(|triangle| triangle.map(|k| vertices[k]));
        let at = [draw.between(-2.0, 2.0), draw.between(-2.0, 2.0)];
        for cutter in CUTTERS {
            let cutter: Cutter = cutter.parse().unwrap();
            let exact = surface.drop_cutter(&cutter, at).map(|c| c.z_mm);
            let forced = by_force(&triangles, &cutter, at);
            if let Some(forced) = forced {
                let exact = exact.unwrap();
                prop_assert!(exact >= forced - 1e-9, "{cutter}: {exact} < {forced}");
                // A step of the points, 0.07 mm, at the steepest slopes that are drawn.
                let loose = if cutter.corner_mm() == 0.0 { 0.6 } else { 0.3 };
                prop_assert!(exact <= forced + loose, "{cutter}: {exact} > {forced}");
            }
        }
    }
}

#[test]
fn a_tree_finds_what_a_look_at_everything_finds() {
    let facets = relief(7, [20.0, 15.0], 0.5);
    let whole = surface(&facets);
    let mut draw = Draw::new(3);
    // Each triangle by itself, without neighbours that own its edges and corners.
    let single: Vec<Surface> = facets
        .1
        .iter()
        .map(|triangle| Surface::new(&facets.0, &[*triangle]).unwrap())
        .collect();
    for _ in 0..60 {
        let at = [draw.between(-3.0, 23.0), draw.between(-3.0, 18.0)];
        for cutter in CUTTERS {
            let cutter: Cutter = cutter.parse().unwrap();
            let tips = single.iter().filter_map(|s| s.drop_cutter(&cutter, at));
            let highest = tips.map(|c| c.z_mm).fold(f64::NEG_INFINITY, f64::max);
            let found = whole
                .drop_cutter(&cutter, at)
                .map_or(f64::NEG_INFINITY, |c| c.z_mm);
            assert!(
                found == highest || (found - highest).abs() < 1e-9,
                "{cutter} at {at:?}: {found} {highest}"
            );
        }
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let surface = surface(&relief(5, [30.0, 20.0], 0.4));
    let mut draw = Draw::new(9);
    let places: Vec<[f64; 2]> = (0..5000)
        .map(|_| [draw.between(-1.0, 31.0), draw.between(-1.0, 21.0)])
        .collect();
    let cutter: Cutter = "bull:6:1".parse().unwrap();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let tips = pool.install(|| drop_cutter(&surface, &cutter, &places, &Unmonitored));
        let bits = |c: toolpath::Contact| c.z_mm.to_bits();
        tips.unwrap()
            .into_iter()
            .map(|c| c.map(bits))
            .collect::<Vec<_>>()
    };
    let one = with(1);
    assert!(one.iter().filter(|tip| tip.is_some()).count() > 4500);
    assert_eq!(one, with(3));
}

#[test]
fn damaged_models_are_told() {
    let told = |vertices: &[[f64; 3]], triangles: &[[usize; 3]]| {
        Surface::new(vertices, triangles).unwrap_err()
    };
    let corner = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, f64::NAN, 0.0]];
    assert_eq!(
        told(&corner, &[[0, 1, 2]]),
        ToolpathError::NotFinite { vertex: 2 }
    );
    assert_eq!(told(&[], &[]), ToolpathError::Empty);
    assert_eq!(told(&[[0.0; 3]; 3], &[[0, 1, 2]]), ToolpathError::Empty);
    assert!(
        told(&corner[..2], &[[0, 1, 7]])
            .to_string()
            .contains("triangle 0 of the model names vertex 7, of 2")
    );
}
