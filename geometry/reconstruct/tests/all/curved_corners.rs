//! Outlines keep the corners at which two curved stretches meet.

use crate::common;

use common::{Part, Point, hausdorff, outline, part_of, ragged_scene, run};
use reconstruct::Method;

const PITCH_MM: f64 = 0.5;
const RADIUS_MM: f64 = 30.0;

/// Half of a lens between two arcs, from the cut through its middle around its tip.
fn half_lens(turn_at_tip: f64, heading: f64) -> Vec<Point> {
    let half = (core::f64::consts::PI - turn_at_tip) / 2.0;
    let (sin, cos) = libm::sincos(heading);
    let at = |k: i32, side: f64| {
        let (across, along) = libm::sincos(half * f64::from(k) / 200.0);
        let (x, y) = (
            RADIUS_MM * across,
            side * RADIUS_MM * (along - libm::cos(half)),
        );
        [x * cos - y * sin, x * sin + y * cos]
    };
    let there = (0..=200).map(|k| at(k, -1.0));
    there.chain((0..200).rev().map(|k| at(k, 1.0))).collect()
}

/// Greatest distance of the outlines of both halves from the truth, either way, in pitches.
fn farthest(turn_at_tip: f64, heading: f64, jitter: f64) -> f64 {
    // A ridge runs along the cut.
    let parts = [heading, heading + core::f64::consts::PI].map(|heading| {
        let (sin, cos) = libm::sincos(heading);
        Part::new(&half_lens(turn_at_tip, heading), move |x, y| {
            10.0 - 0.5 * (x * cos + y * sin)
        })
    });
    let (image, map) = ragged_scene(&parts, PITCH_MM, (136, 136), 0.02, jitter * PITCH_MM);
    let done = run(&image, &map, Method::Relief);
    assert_eq!(done.model.faces.len(), 2);
    let off = done.model.faces.iter().map(|face| {
        let part = part_of(face, &parts, &image, &map);
        hausdorff(&outline(face), &part.outline) / PITCH_MM
    });
    off.fold(0.0, f64::max)
}

#[test]
fn tips_of_a_lens_are_drawn_within_a_pitch() {
    for turn_degrees in [65.0_f64, 115.0] {
        for k in 0..8 {
            let heading = 0.05 + core::f64::consts::PI * f64::from(k) / 8.0;
            let off = farthest(turn_degrees.to_radians(), heading, 0.0);
            assert!(
                off < 1.0,
                "{turn_degrees} degrees, heading {heading}: {off}"
            );
        }
    }
}

#[test]
fn ragged_labels_do_not_round_the_tips() {
    // Each node is classified where it is displaced to, by a fifth of a pitch in each
    // direction.
    for turn_degrees in [40.0_f64, 65.0, 90.0] {
        for k in 0..8 {
            let heading = 0.05 + core::f64::consts::PI * f64::from(k) / 8.0;
            let off = farthest(turn_degrees.to_radians(), heading, 0.2);
            assert!(
                off < 1.0,
                "{turn_degrees} degrees, heading {heading}: {off}"
            );
        }
    }
}
