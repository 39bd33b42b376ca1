//! Codes of sections: those of Table 2 from ideal ones, and the same from what a scanner sees.

use features::code::{Digit, End, Section, code, mirrored, written};

fn coded(points: &[[f64; 2]], noise_mm: f64, ends: [End; 2]) -> String {
    written(&code(&Section {
        points,
        noise_mm,
        pitch_mm: 0.5,
        ends,
    }))
}

fn corners(points: &[[f64; 2]]) -> String {
    written(&code(&Section {
        points,
        noise_mm: 0.0,
        pitch_mm: 0.0,
        ends: [End::Rim; 2],
    }))
}

fn rims(points: &[[f64; 2]]) -> String {
    coded(points, 0.01, [End::Rim; 2])
}

const POCKET: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [10.0, 0.0],
    [10.0, -8.0],
    [30.0, -8.0],
    [30.0, 0.0],
    [40.0, 0.0],
];
const BOSS: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [10.0, 0.0],
    [10.0, 6.0],
    [18.0, 6.0],
    [18.0, 0.0],
    [40.0, 0.0],
];
const STEP: [[f64; 2]; 6] = [
    [-5.0, -20.0],
    [0.0, -20.0],
    [0.0, -8.0],
    [12.0, -8.0],
    [12.0, 0.0],
    [30.0, 0.0],
];

/// Samples of a chain of corners every `pitch`, seen from above: nothing of walls.
fn sampled(corners: &[[f64; 2]], pitch: f64) -> Vec<[f64; 2]> {
    let (first, last) = (corners[0][0], corners[corners.len() - 1][0]);
    let count = ((last - first) / pitch) as usize;
    let height = |s: f64| {
        corners
            .windows(2)
            .filter(|pair| pair[0][0] < pair[1][0] && pair[0][0] <= s && s <= pair[1][0])
            .map(|pair| {
                let share = (s - pair[0][0]) / (pair[1][0] - pair[0][0]);
                pair[0][1] + share * (pair[1][1] - pair[0][1])
            })
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let at = |k: usize| first + 0.3 * pitch + k as f64 * pitch;
    (0..count).map(|k| [at(k), height(at(k))]).collect()
}

#[test]
fn ideal_sections_have_the_codes_of_table_2() {
    assert_eq!(corners(&POCKET), "4543212");
    assert_eq!(corners(&BOSS), "2123454");
    assert_eq!(corners(&STEP), "2123212");
    let without_rims = &POCKET[1..5];
    assert_eq!(corners(without_rims), "4543212");
}

#[test]
fn sections_without_samples_on_walls_have_the_same() {
    for (corners, expected) in [(&POCKET, "4543212"), (&BOSS, "2123454"), (&STEP, "2123212")] {
        assert_eq!(rims(&sampled(corners, 0.5)), expected);
    }
}

#[test]
fn a_wall_whose_shadow_hides_the_floor_is_a_wall() {
    let mut points = sampled(&POCKET, 0.5);
    points.retain(|&[s, z]| !(z < -4.0 && s < 14.5));
    assert_eq!(rims(&points), "4543212");
}

#[test]
fn chamfers_and_fillets_are_bends() {
    let chamfered = [
        [0.0, 0.0],
        [9.0, 0.0],
        [10.0, -1.0],
        [10.0, -7.0],
        [11.0, -8.0],
        [29.0, -8.0],
        [30.0, -7.0],
        [30.0, -1.0],
        [31.0, 0.0],
        [40.0, 0.0],
    ];
    assert_eq!(corners(&chamfered), "4543212");
    assert_eq!(rims(&sampled(&chamfered, 0.5)), "4543212");
}

#[test]
fn cones_that_are_more_than_a_chamfer_are_walls_of_their_own() {
    let countersunk = [
        [0.0, 0.0],
        [6.0, 0.0],
        [10.0, -4.0],
        [10.0, -9.0],
        [18.0, -9.0],
        [18.0, -4.0],
        [22.0, 0.0],
        [30.0, 0.0],
    ];
    assert_eq!(corners(&countersunk), "4444543212222");
    assert_eq!(rims(&sampled(&countersunk, 0.25)), "4444543212222");
}

#[test]
fn stepped_holes_need_fifteen_digits() {
    let stepped = [
        [0.0, 0.0],
        [6.0, 0.0],
        [6.0, -4.0],
        [10.0, -4.0],
        [10.0, -9.0],
        [18.0, -9.0],
        [18.0, -4.0],
        [22.0, -4.0],
        [22.0, 0.0],
        [30.0, 0.0],
    ];
    assert_eq!(rims(&sampled(&stepped, 0.5)), "454345432123212");
}

#[test]
fn slopes_of_floors_are_one_digit() {
    let sloping = [
        [0.0, 0.0],
        [5.0, 0.0],
        [5.0, -4.0],
        [25.0, -12.0],
        [25.0, 0.0],
        [30.0, 0.0],
    ];
    assert_eq!(corners(&sloping), "4544212");
}

#[test]
fn open_ends_count_and_rims_do_not() {
    let step = &STEP[2..];
    let ends = [End::Open, End::Rim];
    assert_eq!(coded(step, 0.01, ends), "3212");
    assert_eq!(coded(step, 0.01, [End::Open; 2]), "32123");
    assert_eq!(rims(step), "212");
    let level = [[0.0, 1.0], [10.0, 1.0]];
    assert_eq!(rims(&level), "");
    assert_eq!(coded(&level, 0.01, [End::Open; 2]), "3");
}

#[test]
fn nothing_much_has_no_code() {
    assert_eq!(rims(&[]), "");
    assert_eq!(rims(&[[1.0, 2.0]]), "");
    assert_eq!(rims(&[[f64::NAN, 0.0], [1.0, f64::INFINITY]]), "");
    assert_eq!(rims(&[[1.0, 2.0], [1.0, 2.0]]), "");
}

#[test]
fn outliers_and_points_between_levels_change_nothing() {
    let mut points = sampled(&POCKET, 0.5);
    for (k, by) in [(5, 9.0), (30, -4.0), (31, 6.0), (50, 3.0)] {
        points[k][1] += by;
    }
    // The spot on the edge saw both levels.
    points.insert(20, [10.0, -3.3]);
    assert_eq!(rims(&points), "4543212");
}

#[test]
fn what_is_less_than_the_noise_is_level() {
    let shallow = POCKET.map(|[s, z]| [s, 0.1 * z]);
    assert_eq!(rims(&shallow), "4543212");
    assert_eq!(coded(&shallow, 0.2, [End::Rim; 2]), "");
}

#[test]
fn from_the_other_side_a_section_reads_backwards() {
    let other = |points: &[[f64; 2]]| -> Vec<[f64; 2]> {
        points.iter().rev().map(|&[s, z]| [-s, z]).collect()
    };
    for corners in [POCKET, BOSS, STEP] {
        let own = code(&Section {
            points: &corners,
            noise_mm: 0.01,
            pitch_mm: 0.5,
            ends: [End::Rim; 2],
        });
        assert_eq!(rims(&other(&corners)), written(&mirrored(&own)));
    }
    assert_eq!(rims(&other(&STEP)), "4543454");
    assert_eq!(Digit::ALL.map(Digit::number), [1, 2, 3, 4, 5]);
}
