use metrology::{figures, find, steps};

use crate::bench::Taken;

#[test]
fn the_figures_of_a_ball_bar_are_those_of_its_noise() {
    let mut taken = Taken::of("ball-bar", "", 5).at(&[[-20.0, -30.0, 5.0], [25.0, 35.0, -10.0]]);
    taken.overrides.outliers = Some(0.0);
    let placed = taken.scan().placed();
    let found = find::spheres(&placed, 25.4);
    assert_eq!(found.len(), 2);
    let told: Vec<_> = found
        .iter()
        .map(|own| figures::sphere(&placed, &own.fit).unwrap())
        .collect();
    for own in &told {
        let error = own.diameter_mm - 25.4;
        assert!(error.abs() < 4.0 * own.diameter_uncertainty_mm, "{own:?}");
        // Noise of 0.05 mm and counts of 0.1 mm: 99.7 % lie within three deviations.
        assert!((own.deviation_mm - 0.055).abs() < 0.006, "{own:?}");
        assert!((0.25..0.40).contains(&own.form_mm), "{own:?}");
        assert_eq!(own.left_out, (0.003 * own.samples as f64) as usize);
    }
    let [a, b] = [told[0].centre_mm, told[1].centre_mm];
    let apart = libm::sqrt((0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>());
    let known = libm::sqrt(45.0 * 45.0 + 65.0 * 65.0 + 15.0 * 15.0);
    assert!((apart - known).abs() < 0.02, "{apart} {known}");
}

#[test]
fn more_strays_than_may_be_left_out_show_in_the_form() {
    let mut taken = Taken::of("sphere", "", 5);
    taken.overrides.outliers = Some(0.01);
    let placed = taken.scan().placed();
    let found = find::spheres(&placed, 25.4);
    let told = figures::sphere(&placed, &found[0].fit).unwrap();
    assert!(told.form_mm > 5.0, "{told:?}");
    assert!(told.deviation_mm < 0.06, "{told:?}");
}

#[test]
fn a_plate_and_a_gauge_are_measured_wherever_they_lean() {
    let mut plate = Taken::of("plate", "", 8).at(&[[3.0, -5.0, 4.0]]);
    plate.artefact.tilt_deg = (15.0, -10.0);
    plate.overrides.outliers = Some(0.0);
    let placed = plate.scan().placed();
    let found = steps::find(&placed, &[0.0]).unwrap();
    let told = figures::plate(&placed, &found).unwrap();
    assert!((0.25..0.45).contains(&told.flatness_mm), "{told:?}");
    assert!(told.samples > 10_000, "{told:?}");
    let mut gauge = Taken::of("step-gauge", "", 8);
    gauge.artefact.tilt_deg = (-5.0, 8.0);
    let heights = sim_scanner::scene::artefacts::STEP_HEIGHTS_MM;
    let found = steps::find(&gauge.scan().placed(), &heights).unwrap();
    let told = figures::step_gauge(&found, &heights).unwrap();
    for error in &told.errors_mm {
        assert!(error.unwrap().abs() < 0.012, "{told:?}");
    }
}
