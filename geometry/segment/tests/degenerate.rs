//! Images that hold little or nothing, settings and values out of limits, cancellation,
//! repeatability.

use range_image::{Lattice, Monitor, RangeImage, Unmonitored};
use segment::{
    Method, SegmentError, SegmentSettings, Segmentation, SettingsError, Window, normals, segment,
    segment_with_report,
};
use std::sync::atomic::{AtomicUsize, Ordering};

fn image(columns: usize, rows: usize, z: impl Fn(usize, usize) -> Option<f64>) -> RangeImage {
    let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, -3, 7, columns, rows);
    for column in 0..columns {
        for row in 0..rows {
            image.set_z_mm(column, row, z(column, row));
        }
    }
    image
}

fn run(image: &RangeImage, method: Method, minimum_nodes: usize) -> Segmentation {
    let settings = SegmentSettings {
        method,
        minimum_nodes,
        ..SegmentSettings::default()
    };
    segment_with_report(image, &settings, &Unmonitored).expect("within limits")
}

/// Number of regions, and of nodes in crumbs, by both methods, which must agree.
fn regions(image: &RangeImage, minimum_nodes: usize) -> (u16, usize) {
    let [a, b] = [Method::Relief, Method::ShimLee].map(|m| run(image, m, minimum_nodes));
    let counts = |s: &Segmentation| (s.regions.regions(), s.report.crumb_nodes);
    assert_eq!(counts(&a), counts(&b));
    counts(&a)
}

#[test]
fn images_without_surface_have_no_regions() {
    assert_eq!(regions(&image(0, 0, |_, _| None), 1), (0, 0));
    assert_eq!(regions(&image(0, 9, |_, _| None), 1), (0, 0));
    assert_eq!(regions(&image(9, 0, |_, _| None), 1), (0, 0));
    assert_eq!(regions(&image(30, 20, |_, _| None), 1), (0, 0));
}

#[test]
fn small_images_are_one_region_or_crumbs() {
    for (columns, rows) in [(1, 1), (2, 1), (1, 40), (40, 1), (2, 2), (3, 3), (5, 4)] {
        let flat = image(columns, rows, |_, _| Some(1.0));
        assert_eq!(regions(&flat, 1), (1, 0), "{columns} x {rows}");
        assert_eq!(regions(&flat, columns * rows), (1, 0), "{columns} x {rows}");
        let crumb = (0, columns * rows);
        assert_eq!(
            regions(&flat, columns * rows + 1),
            crumb,
            "{columns} x {rows}"
        );
    }
}

#[test]
fn level_and_far_planes_are_one_region() {
    for offset in [0.0, -1e6, 1e8] {
        let flat = image(60, 50, |_, _| Some(offset));
        assert_eq!(regions(&flat, 50), (1, 0), "{offset}");
        let slanted = image(60, 50, |c, r| {
            Some(offset + 0.3 * c as f64 - 0.2 * r as f64)
        });
        assert_eq!(regions(&slanted, 50), (1, 0), "{offset}");
    }
}

#[test]
fn lone_nodes_do_not_overflow_labels() {
    // More pieces than labels: every other node, 92 450 in all, at a distance from its like.
    let dust = image(430, 430, |c, r| {
        ((c + r) % 2 == 0).then_some((c * 7 + r) as f64 * 20.0)
    });
    for method in [Method::Relief, Method::ShimLee] {
        let done = run(&dust, method, 1);
        let (regions, report) = (usize::from(done.regions.regions()), done.report);
        assert_eq!(regions + report.crumbs, 92_450, "{method}");
        assert_eq!(regions, usize::from(u16::MAX) - 1, "{method}");
        assert_eq!(report.crumbs, report.crumb_nodes, "{method}");
        assert_eq!(run(&dust, method, 2).regions.regions(), 0, "{method}");
    }
}

#[test]
fn rough_images_do_no_harm() {
    // Salt and pepper of many millimetres: anything but a panic or an endless loop is fine,
    // as long as each node is in a region or a crumb.
    let hash = |c: usize, r: usize| (c * 7919 + r * 104_729 + c * r * 31) % 1009;
    let rough = image(90, 80, |c, r| {
        (hash(c, r) % 7 != 0).then(|| hash(r, c) as f64 * 0.05)
    });
    for method in [Method::Relief, Method::ShimLee] {
        let done = run(&rough, method, 5);
        let labelled: usize = done.regions.node_counts().iter().sum();
        assert_eq!(labelled + done.report.crumb_nodes, rough.valid_nodes());
    }
}

#[test]
fn settings_out_of_limits_are_named() {
    let set = |change: &dyn Fn(&mut SegmentSettings)| {
        let mut settings = SegmentSettings::default();
        change(&mut settings);
        segment(&image(3, 3, |_, _| Some(0.0)), &settings, &Unmonitored).map(|_| ())
    };
    let bad = |e: SettingsError| Err(SegmentError::Settings(e));
    assert_eq!(set(&|_| ()), Ok(()));
    assert_eq!(set(&|s| s.clusters = 0), bad(SettingsError::Clusters(0)));
    assert_eq!(
        set(&|s| s.clusters = 1001),
        bad(SettingsError::Clusters(1001))
    );
    assert_eq!(
        set(&|s| s.crease_angle_rad = 2.0),
        bad(SettingsError::CreaseAngle(2.0))
    );
    assert_eq!(
        set(&|s| s.step_factor = 0.0),
        bad(SettingsError::StepFactor(0.0))
    );
    assert_eq!(
        set(&|s| s.minimum_nodes = 0),
        bad(SettingsError::MinimumNodes)
    );
    assert!(set(&|s| s.crease_angle_rad = f64::NAN).is_err());
    assert!(set(&|s| s.step_factor = f64::INFINITY).is_err());
    let message = SettingsError::Clusters(0).to_string();
    assert_eq!(message, "clusters is 0, but must be 1 to 1000");
}

#[test]
fn values_out_of_limits_are_placed() {
    for z in [1e10, f64::NEG_INFINITY] {
        let far = image(4, 5, |c, r| Some(if (c, r) == (2, 3) { z } else { 0.0 }));
        let (column, row, z_mm) = (2, 3, z);
        assert_eq!(
            segment(&far, &SegmentSettings::default(), &Unmonitored),
            Err(SegmentError::OutOfRange { column, row, z_mm })
        );
    }
    let odd = RangeImage::masked(Lattice { pitch_mm: 0.0 }, 0, 0, 2, 2);
    assert_eq!(
        segment(&odd, &SegmentSettings::default(), &Unmonitored),
        Err(SegmentError::Pitch(0.0))
    );
}

/// Cancels when asked for the n-th time; notes whether progress ever went back.
struct Impatient {
    asked: AtomicUsize,
    patience: usize,
    permille: AtomicUsize,
}

impl Impatient {
    fn new(patience: usize) -> Self {
        Self {
            asked: AtomicUsize::new(0),
            patience,
            permille: AtomicUsize::new(0),
        }
    }
}

impl Monitor for Impatient {
    fn is_cancelled(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) >= self.patience
    }

    fn progress(&self, fraction: f64) {
        let now = (fraction * 1000.0) as usize;
        let before = self.permille.swap(now, Ordering::Relaxed);
        assert!(before <= now && now <= 1000, "{before} then {now}");
    }
}

fn roof() -> RangeImage {
    image(80, 70, |c, r| {
        let (x, y) = (c as f64 - 41.0, r as f64);
        let noise = ((c * 37 + r * 101) % 17) as f64 * 0.002;
        Some(noise - 0.3 * x.abs() + 0.05 * y)
    })
}

#[test]
fn cancelling_stops_it_anywhere() {
    let roof = roof();
    let settings = SegmentSettings::default();
    let whole = Impatient::new(usize::MAX);
    let map = segment(&roof, &settings, &whole).expect("nobody cancels");
    assert_eq!(map.regions(), 2);
    assert_eq!(whole.permille.load(Ordering::Relaxed), 1000);
    let questions = whole.asked.load(Ordering::Relaxed);
    assert!(questions > 10, "{questions}");
    for patience in 0..questions {
        let result = segment(&roof, &settings, &Impatient::new(patience));
        assert!(
            matches!(result, Err(SegmentError::Cancelled(_))),
            "{patience}"
        );
    }
}

#[test]
fn the_same_image_gives_the_same_regions() {
    let roof = roof();
    for method in [Method::Relief, Method::ShimLee] {
        assert_eq!(run(&roof, method, 50), run(&roof, method, 50));
    }
}

#[test]
fn regions_are_numbered_by_position() {
    let map = run(&roof(), Method::Relief, 50).regions;
    assert_eq!((map.label(0, 0), map.label(79, 69)), (1, 2));
}

#[test]
fn normals_are_those_of_planes_and_end_at_steps() {
    let stairs = image(20, 20, |c, _| {
        Some(if c < 10 { 0.0 } else { 5.0 + 0.25 * c as f64 })
    });
    let plain = normals(&stairs, Window::Plain);
    let kept = normals(&stairs, Window::WithinSteps { step_mm: 0.5 });
    let slanted = [-1.0 / 5.0_f64.sqrt() * 1.0, 0.0, 2.0 / 5.0_f64.sqrt()];
    for column in 0..20 {
        let expected = if column < 10 {
            [0.0, 0.0, 1.0]
        } else {
            slanted
        };
        for (k, e) in expected.iter().enumerate() {
            let n = kept.at(column, 4).expect("a plane")[k];
            assert!((n - e).abs() < 1e-12, "column {column}: {n} for {e}");
        }
    }
    assert!(plain.at(9, 4).expect("a plane")[0] < -0.8);
    assert_eq!(plain.at(20, 0), None);
    let line = normals(&image(1, 9, |_, _| Some(0.0)), Window::Plain);
    assert_eq!(line.at(0, 4), None);
}
