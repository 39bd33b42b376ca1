//! Sections of bodies by formula: what is held, what is refused, and in which words.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on says where"
)]

use range_image::Unmonitored;
use skin::{Method, Section, Settings, Skin, SkinError, skin};

/// Points around a ring at a height, the `k`-th of them first; squeezed along y.
fn ring(radius_mm: f64, z_mm: f64, count: usize, first: usize) -> Vec<[f64; 3]> {
    let angle = |k: usize| core::f64::consts::TAU * ((k + first) % count) as f64 / count as f64;
    let wave = |t: f64| radius_mm * (1.0 + 0.15 * libm::cos(2.0 * t) + 0.05 * libm::sin(3.0 * t));
    let place = |t: f64| [wave(t) * libm::cos(t), 0.8 * wave(t) * libm::sin(t), z_mm];
    (0..count).map(|k| place(angle(k))).collect()
}

fn closed(k: usize, points: Vec<[f64; 3]>) -> Section {
    Section {
        name: format!("section {k}"),
        points,
        is_closed: true,
        is_directed: false,
    }
}

/// A vase of so many sections; each begins somewhere else.
fn vase(count: usize) -> Vec<Section> {
    let of = |k: usize| {
        let t = k as f64 / (count - 1) as f64;
        let radius = 100.0 + 20.0 * libm::sin(4.0 * t);
        closed(k + 1, ring(radius, 300.0 * t, 90, 17 * k))
    };
    (0..count).map(of).collect()
}

fn skinned(sections: &[Section], settings: &Settings) -> Result<Skin, SkinError> {
    skin(sections, settings, &Unmonitored)
}

/// The surface's largest distance from the data, looked for all over it.
fn farthest_mm(found: &Skin, sections: &[Section]) -> f64 {
    let points = sections.iter().flat_map(|section| &section.points);
    let off = points.map(|place| found.surface.closest(*place).distance);
    off.fold(0.0, f64::max)
}

#[test]
fn every_data_point_is_within_the_tolerance_by_either_method() {
    let sections = vase(7);
    for method in [Method::Relief, Method::Jo] {
        for tolerance_mm in [2.0, 0.2] {
            let settings = Settings {
                method,
                ..Settings::new(tolerance_mm)
            };
            let found = skinned(&sections, &settings).unwrap();
            assert_eq!(found.deviations.len(), 7 * 90);
            assert!(
                found.most_mm() <= tolerance_mm,
                "{method:?} {}",
                found.most_mm()
            );
            let farthest_mm = farthest_mm(&found, &sections);
            assert!(farthest_mm <= tolerance_mm && farthest_mm > 0.2 * found.most_mm());
        }
    }
}

#[test]
fn a_closed_surface_is_smooth_over_its_seam_and_hardly_twisted() {
    let found = skinned(&vase(7), &Settings::new(0.5)).unwrap();
    for k in 0..=20 {
        let v = 0.05 * f64::from(k);
        for order in 0..=2 {
            let [start, end] = [0.0, 1.0].map(|u| found.surface.partial(u, v, order, 0));
            let size = start.iter().map(|c| c * c).sum::<f64>().sqrt();
            for d in 0..3 {
                assert!(
                    (start[d] - end[d]).abs() <= 1e-7 * (1.0 + size),
                    "{order} at {v}"
                );
            }
        }
        // Sections began all around; the seam is one line up the vase.
        let [x, y, _] = found.surface.evaluate(0.0, v);
        let angle = libm::atan2(y, x).to_degrees();
        assert!(angle.abs() < 6.0, "{angle}");
    }
}

#[test]
fn it_takes_fewer_control_points_than_the_published_way() {
    let sections = vase(9);
    for tolerance_mm in [5.0, 1.0, 0.2] {
        let count = |method| {
            let settings = Settings {
                method,
                ..Settings::new(tolerance_mm)
            };
            skinned(&sections, &settings).unwrap().counts.points()
        };
        let (own, published) = (count(Method::Relief), count(Method::Jo));
        assert!(
            100 * own <= 85 * published,
            "{tolerance_mm}: {own} of {published}"
        );
    }
}

#[test]
fn the_same_sections_give_the_same_surface_whatever_the_threads() {
    let sections = vase(6);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| skinned(&sections, &Settings::new(0.3)).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn senses_and_order_are_put_right_and_told() {
    let mut sections = vase(6);
    sections[2].points.reverse();
    sections.swap(1, 4);
    let found = skinned(&sections, &Settings::new(1.0)).unwrap();
    let told: Vec<String> = found.warnings.iter().map(ToString::to_string).collect();
    assert!(told.iter().any(|own| own.contains("order")), "{told:?}");
    assert!(told.iter().any(|own| own.contains("section 3")), "{told:?}");
    assert_eq!(found.sections[1], "section 2");
    let kept = Settings {
        turn_sections: false,
        ..Settings::new(1.0)
    };
    let error = skinned(&sections, &kept).unwrap_err().to_string();
    assert!(
        error.contains("section 3") || error.contains("section 4"),
        "{error}"
    );
}

#[test]
fn what_cannot_be_skinned_is_refused_by_name() {
    let refused = |sections: &[Section]| skinned(sections, &Settings::new(1.0)).unwrap_err();
    assert_eq!(refused(&vase(5)[..1]), SkinError::TooFewSections(1));

    let mut two = vase(5);
    two[3].points.truncate(2);
    let error = refused(&two).to_string();
    assert!(
        error.contains("section 4") && error.contains("2 distinct points"),
        "{error}"
    );

    let mut open = vase(5);
    open[1].is_closed = false;
    let error = refused(&open).to_string();
    assert!(
        error.contains("section 2 is open, section 1 is closed"),
        "{error}"
    );

    // Two legs at one height.
    let mut branching = vase(5);
    let leg = ring(40.0, 150.0, 60, 0)
        .into_iter()
        .map(|[x, y, z]| [x + 200.0, y, z]);
    branching.insert(3, closed(9, leg.collect()));
    let error = refused(&branching);
    let SkinError::Branching { first, second } = &error else {
        panic!("{error:?}")
    };
    assert_eq!(
        (first.as_str(), second.as_str()),
        ("section 3", "section 9")
    );

    // One leans so far that it passes through the next.
    let mut crossing = vase(5);
    crossing[2]
        .points
        .iter_mut()
        .for_each(|place| place[2] += 0.9 * place[0]);
    let error = refused(&crossing);
    assert!(matches!(error, SkinError::Crossing { .. }), "{error:?}");

    let mut eight = vase(5);
    eight[4].points.iter_mut().for_each(|[x, y, _]| {
        if *x < 10.0 {
            *y = -*y;
        }
    });
    let error = refused(&eight);
    let SkinError::CrossingItself { section, .. } = &error else {
        panic!("{error:?}")
    };
    assert_eq!(section, "section 5");

    let mut infinite = vase(5);
    infinite[0].points[7][1] = f64::INFINITY;
    let error = refused(&infinite).to_string();
    assert!(error.contains("point 8 of section 1"), "{error}");

    for bad in [0.0, -1.0, f64::NAN] {
        assert!(skinned(&vase(5), &Settings::new(bad)).is_err());
    }
    let degree = Settings {
        degree_across: 6,
        ..Settings::new(1.0)
    };
    assert!(skinned(&vase(5), &degree).is_err());
}

#[test]
fn open_sections_give_an_open_surface_from_whichever_end_they_come() {
    let half = |k: usize| {
        let mut points = ring(100.0, 30.0 * k as f64, 90, 0);
        points.truncate(46);
        if k == 2 {
            points.reverse();
        }
        Section::by_its_ends(format!("section {}", k + 1), points)
    };
    let sections: Vec<Section> = (0..5).map(half).collect();
    let found = skinned(&sections, &Settings::new(0.5)).unwrap();
    assert!(!found.is_closed && found.most_mm() <= 0.5);
    assert_eq!(found.warnings.len(), 1);
    let [start, end] = [0.0, 1.0].map(|u| found.surface.evaluate(u, 0.5));
    assert!(start[0] > 90.0 && end[0] < -90.0, "{start:?} {end:?}");
}

#[test]
fn every_degree_across_holds_the_tolerance_with_few_sections_and_many() {
    for count in [2, 3, 7] {
        for degree_across in 1..=5 {
            for method in [Method::Relief, Method::Jo] {
                let settings = Settings {
                    method,
                    degree_across,
                    ..Settings::new(1.0)
                };
                let found = skinned(&vase(count), &settings).unwrap();
                assert!(found.most_mm() <= 1.0, "{count} {degree_across} {method:?}");
                let degree = found.surface.v_knots().degree();
                assert_eq!(degree, degree_across.min(count - 1));
            }
        }
    }
}

#[test]
fn wavy_sections_above_each_other_do_not_cross() {
    let mut sections = vase(6);
    for section in &mut sections {
        for [x, y, z] in &mut section.points {
            *z = 0.1 * *z + 10.0 * libm::cos(2.0 * libm::atan2(*y, *x));
        }
    }
    assert!(skinned(&sections, &Settings::new(1.0)).is_ok());
}

#[test]
fn sections_that_lie_on_each_other_or_too_far_off_are_refused() {
    let line = |z: f64, k: usize| {
        let points = (0..12).map(|j| [f64::from(j), 0.2 * f64::from(j * j), z]);
        Section::by_its_ends(format!("section {k}"), points.collect())
    };
    let twice = [line(0.0, 1), line(5.0, 2), line(5.0, 3), line(9.0, 4)];
    let error = skinned(&twice, &Settings::new(1.0)).unwrap_err();
    let SkinError::Branching { first, second } = &error else {
        panic!("{error:?}")
    };
    assert_eq!(
        (first.as_str(), second.as_str()),
        ("section 2", "section 3")
    );
    let mut far = vase(3);
    far[1].points.iter_mut().for_each(|place| place[2] = 1e308);
    let error = skinned(&far, &Settings::new(1.0)).unwrap_err().to_string();
    assert!(
        error.contains("section 2") && error.contains("10000000 mm"),
        "{error}"
    );
}

/// A cone: its sections are one section in other sizes, and so are their knots but for rounding.
#[test]
fn knots_that_differ_by_rounding_are_removed_by_the_published_way() {
    let of = |k: usize| {
        closed(
            k + 1,
            ring(100.0 / 3.0 * (1.0 + 0.1 * k as f64), 20.0 * k as f64, 90, 0),
        )
    };
    let sections: Vec<Section> = (0..6).map(of).collect();
    let settings = Settings {
        method: Method::Jo,
        ..Settings::new(1.0)
    };
    let counts = skinned(&sections, &settings).unwrap().counts;
    // Larger sections need more knots than smaller ones; those of all are far from all of theirs.
    let most = counts.of_sections.iter().max().unwrap();
    assert!(counts.around <= *most, "{counts:?}");
}

struct Impatient(std::sync::atomic::AtomicUsize);

impl range_image::Monitor for Impatient {
    fn is_cancelled(&self) -> bool {
        // Once it is asked so often, it has lost interest.
        self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed) >= 40
    }

    fn progress(&self, _fraction: f64) {}
}

#[test]
fn a_search_ends_soon_after_it_is_cancelled() {
    for method in [Method::Relief, Method::Jo] {
        let settings = Settings {
            method,
            ..Settings::new(0.01)
        };
        let monitor = Impatient(0.into());
        let error = skin(&vase(12), &settings, &monitor).unwrap_err();
        assert!(matches!(error, SkinError::Cancelled(_)), "{error:?}");
        let asked = monitor.0.load(std::sync::atomic::Ordering::Relaxed);
        assert!(asked < 60, "{asked}");
    }
}

/// Arcs nearly all around, each farther around than the one before: their ends tell nothing.
#[test]
fn sections_whose_sense_is_known_are_not_turned() {
    let arc = |k: usize, is_directed: bool| {
        let mut points = ring(50.0, 10.0 * k as f64, 90, 30 * k);
        points.truncate(88);
        Section {
            name: format!("section {}", k + 1),
            points,
            is_closed: false,
            is_directed,
        }
    };
    let stack =
        |is_directed: bool| -> Vec<Section> { (0..3).map(|k| arc(k, is_directed)).collect() };
    let refused = skinned(&stack(false), &Settings::new(1.0));
    let is_turned = |found: &Skin| !found.warnings.is_empty();
    assert!(refused.as_ref().map_or(true, is_turned), "{refused:?}");
    let taken = skinned(&stack(true), &Settings::new(1.0)).unwrap();
    assert_eq!(taken.warnings, []);
}
