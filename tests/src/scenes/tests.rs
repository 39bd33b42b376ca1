//! The scenes hold what they promise, by other means than those that drew them.

use std::collections::BTreeSet;

use super::*;
use sim_scanner::scene::{Body, Surface};

#[test]
fn the_lists_of_seeds_do_not_meet() {
    for set in Set::ALL {
        let seeds: Vec<u64> = Purpose::ALL.iter().flat_map(|p| set.seeds(*p)).collect();
        let different: BTreeSet<u64> = seeds.iter().copied().collect();
        assert_eq!(different.len(), seeds.len());
        assert_eq!(seeds.len() as u64, 3 * set.scenes());
    }
}

#[test]
fn a_scene_is_the_same_whenever_it_is_drawn() {
    let (one, other) = (draw(Set::Polyhedral, 3), draw(Set::Polyhedral, 3));
    let (one, other) = (one.expect("drawn"), other.expect("drawn"));
    assert_eq!(one.truth, other.truth);
    assert_eq!(one.refused, other.refused);
}

#[test]
fn labelled_nodes_lie_on_their_face_and_counts_are_right() {
    let drawn = draw(Set::Polyhedral, 1).expect("drawn");
    let truth = &drawn.truth;
    let (least, most) = drawn.set.faces();
    let counted = truth.regions.iter().filter(|r| r.counts()).count();
    assert!((least..=most).contains(&counted), "{counted}");
    for region in &truth.regions {
        let nodes = truth.labels.iter().filter(|l| **l == region.label).count();
        assert_eq!(nodes, region.nodes);
        assert_eq!(truth.counts(region.label), nodes >= LEAST_NODES);
    }
    // The range image of a scan without mistakes lies on the plane of each node's face.
    let image = scan::range_image(&drawn, View::Plain).expect("scanned");
    let z_mm = truth.gather(&image, image.raw_z_mm(), View::Plain.factor(), f64::NAN);
    let (mut near, mut all) = (0, 0);
    for (node, label) in truth.labels.iter().enumerate().filter(|(_, l)| **l != 0) {
        let face = truth.regions[usize::from(*label) - 1].face;
        let Some((Body::Solid(solid), _)) = drawn.scene.bodies.get(face.body) else {
            panic!("polyhedra are solids");
        };
        let Surface::Plane { normal, offset_mm } = solid.faces()[face.face] else {
            panic!("polyhedra have planes only");
        };
        if z_mm[node].is_nan() {
            continue;
        }
        let x = truth
            .lattice
            .line_mm(truth.i_first + (node / truth.rows) as i64);
        let y = truth
            .lattice
            .line_mm(truth.j_first + (node % truth.rows) as i64);
        let off = normal.x * x + normal.y * y + normal.z * z_mm[node] - offset_mm;
        all += 1;
        near += usize::from(off.abs() < 0.25);
    }
    assert!(all > 5000);
    assert!(near as f64 >= 0.99 * f64::from(all), "{near} of {all}");
}

#[test]
fn a_mirrored_scan_has_the_same_nodes_on_the_other_side() {
    let drawn = draw(Set::Polyhedral, 2).expect("drawn");
    let valued = |view: View| {
        let image = scan::range_image(&drawn, view).expect("scanned");
        drawn
            .truth
            .gather(&image, image.raw_z_mm(), view.factor(), f64::NAN)
    };
    let (plain, mirrored) = (valued(View::Plain), valued(View::Mirrored));
    let pairs = plain.iter().zip(&mirrored);
    let both: Vec<f64> = pairs
        .filter(|(a, b)| !a.is_nan() && !b.is_nan())
        .map(|(a, b)| (a - b).abs())
        .collect();
    let plain_nodes = plain.iter().filter(|z| !z.is_nan()).count();
    assert!(both.len() as f64 > 0.99 * plain_nodes as f64);
    let near = both.iter().filter(|d| **d < 0.1).count();
    assert!(near as f64 > 0.98 * both.len() as f64);
}
