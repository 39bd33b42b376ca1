//! Light lost to gloss and to stains: where, how much of it, and that all else stays as it was.

#![allow(clippy::panic)] // A test that panics has failed.

use sim_scanner::Vec3;
use sim_scanner::preset::{Overrides, Preset};
use sim_scanner::scanner::{Column, Scanner};
use sim_scanner::scene::{Body, ConvexSolid, Material, Scene, Stain, Surface};
use sim_scanner::truth::SampleTruth;

const BALL_MM: Vec3 = Vec3::new(0.0, 0.0, -90.0);
const RADIUS_MM: f64 = 100.0;
/// The cap of it above z = 0 fits in a box this far to each side.
const HALF_MM: f64 = 44.0;

fn within(what: &str, value: f64, range: core::ops::RangeInclusive<f64>) {
    assert!(
        range.contains(&value),
        "{what}: {value} is not in {range:?}"
    );
}

/// A ball's readings, column by column, with a scanner's settings and stains.
fn ball(overrides: Overrides, stains: Vec<Stain>) -> (Scanner, Vec<(Column, Vec<SampleTruth>)>) {
    let sphere = Surface::Sphere {
        centre_mm: BALL_MM,
        radius_mm: RADIUS_MM,
    };
    let floor = Surface::Plane {
        normal: Vec3::NEG_Z,
        offset_mm: 0.0,
    };
    let solid = ConvexSolid::new(vec![sphere, floor]).with_extent_mm(
        Vec3::new(-HALF_MM, -HALF_MM, 0.0),
        Vec3::new(HALF_MM, HALF_MM, BALL_MM.z + RADIUS_MM),
    );
    let scene = Scene::new(vec![Body::Solid(solid)], Material::PAPER).with_stains(stains);
    let (scanner, sweep) = Preset::Paper
        .set_up(scene, &overrides, 7)
        .expect("settings in range");
    let columns = (0..sweep.columns)
        .map(|column| scanner.column_with_truth(&sweep, 0, column))
        .collect();
    (scanner, columns)
}

/// Of the samples on the ball: where, whether it came back without the loss, and with it.
fn lost(
    plain: &[(Column, Vec<SampleTruth>)],
    lossy: &[(Column, Vec<SampleTruth>)],
) -> Vec<(Vec3, bool)> {
    let mut found = Vec::new();
    for ((column, truths), (other, _)) in plain.iter().zip(lossy) {
        for ((sample, truth), left) in column.samples.iter().zip(truths).zip(&other.samples) {
            let Some(place) = truth.point_mm.filter(|_| !sample.no_return) else {
                continue;
            };
            assert!(left.no_return || left == sample, "other draws stay");
            found.push((place, left.no_return));
        }
    }
    found
}

#[test]
fn gloss_blinds_where_the_ball_mirrors_the_laser_at_the_sensor() {
    let overrides = Overrides {
        glare: Some(0.8),
        glare_width_deg: Some(3.0),
        ..Overrides::default()
    };
    let (scanner, plain) = ball(Overrides::default(), Vec::new());
    let (_, glossy) = ball(overrides, Vec::new());
    // On the ball's normal halfway between the ways to laser and sensor, and as that turns.
    let laser = Vec3::new(0.0, scanner.optics.camera_y_mm, scanner.optics.camera_z_mm);
    let off_rad = |place: Vec3| {
        let normal = (place - BALL_MM) / RADIUS_MM;
        let laser = laser + Vec3::X * place.x;
        let sensor = laser + Vec3::new(0.0, scanner.optics.baseline_mm.1, 0.0);
        let halfway = (laser - place).normalize() + (sensor - place).normalize();
        // The mirrored beam strays by twice as much as the normal, as long as that is little.
        2.0 * normal.angle_between(halfway)
    };
    let samples = lost(&plain, &glossy);
    for (least, most) in [(0.0, 0.7), (0.7, 1.2), (1.2, 1.8), (1.8, 2.5), (2.5, 3.5)] {
        let widths = |place: Vec3| off_rad(place) / 3.0_f64.to_radians();
        let ring: Vec<_> = samples
            .iter()
            .filter(|(place, _)| (least..most).contains(&widths(*place)))
            .collect();
        let share = |of: &dyn Fn(&(Vec3, bool)) -> f64| {
            ring.iter().map(|sample| of(sample)).sum::<f64>() / ring.len() as f64
        };
        let expected = share(&|(place, _)| 0.8 * (-widths(*place).powi(2) / 2.0).exp());
        let got = share(&|(_, is_lost)| f64::from(u8::from(*is_lost)));
        let spread = (expected * (1.0 - expected) / ring.len() as f64).sqrt();
        assert!(ring.len() > 20, "{least}: {}", ring.len());
        within(
            "lost",
            got,
            expected - 4.0 * spread - 0.005..=expected + 4.0 * spread + 0.005,
        );
    }
    assert!(
        samples
            .iter()
            .all(|(place, lost)| !lost || off_rad(*place) < 0.3)
    );
}

#[test]
fn a_stain_swallows_its_share_and_no_more() {
    let stain = Stain {
        centre_mm: (4.0, -6.0),
        radius_mm: 8.0,
        rim_mm: 2.0,
        loss: 0.7,
    };
    let (_, plain) = ball(Overrides::default(), Vec::new());
    let (_, stained) = ball(Overrides::default(), vec![stain]);
    let samples = lost(&plain, &stained);
    let away = |place: Vec3| (place.x - 4.0).hypot(place.y + 6.0);
    let share = |low: f64, high: f64| {
        let ring = samples
            .iter()
            .filter(|(p, _)| (low..high).contains(&away(*p)));
        let (all, lost) = ring.fold((0.0, 0.0), |(all, lost), (_, is_lost)| {
            (all + 1.0, lost + f64::from(u8::from(*is_lost)))
        });
        lost / all
    };
    within("within", share(0.0, 7.0), 0.65..=0.75);
    within("on the rim", share(7.0, 9.0), 0.25..=0.45);
    within("beyond", share(9.0, 100.0), 0.0..=0.0);
}
