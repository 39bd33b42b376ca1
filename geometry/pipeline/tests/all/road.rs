//! The whole road on parts whose shape is known in closed form.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use pipeline::{
    BackgroundPolicy, Basis, Kinds, Method, NodeRole, Observer, Outcome, PipelineError, Settings,
    SmoothJoins, Stage, View, divide, process, process_columns,
};
use range_image::{Column, Lattice, Monitor, RangeImage, Sample, Unmonitored};
use reconstruct::Surface;
use shapes::{Family, Form, Shape};

/// A roof of two planes that meet at x = 0, 24 mm square, columns 0.5 mm apart.
fn roof() -> Vec<Column> {
    (-24..=24)
        .map(|i| {
            let x_mm = f64::from(i) * 0.5;
            let samples = (-24..=24).map(|j| Sample {
                y_mm: f64::from(j) * 0.5,
                z_mm: 20.0 - 0.6 * x_mm.abs() + 0.1 * f64::from(j) * 0.5,
                intensity: 255,
            });
            Column::new(x_mm, samples.collect())
        })
        .collect()
}

/// Keeps what it is told; cancels at the beginning of a stage, if asked to.
#[derive(Default)]
struct Notes {
    stages: Mutex<Vec<Stage>>,
    cancel_at: Option<Stage>,
    cancelled: AtomicBool,
    steps: AtomicUsize,
}

impl Monitor for Notes {
    fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    fn progress(&self, fraction: f64) {
        assert!((0.0..=1.0).contains(&fraction), "{fraction}");
        self.steps.fetch_add(1, Ordering::Relaxed);
    }
}

impl Observer for Notes {
    fn stage(&self, stage: Stage) {
        self.stages
            .lock()
            .expect("nobody panics with the lock")
            .push(stage);
        if self.cancel_at == Some(stage) {
            self.cancelled.store(true, Ordering::Relaxed);
        }
    }
}

#[test]
fn a_roof_becomes_two_faces_that_share_its_ridge() {
    for method in Method::ALL {
        let notes = Notes::default();
        let settings = Settings::new(0.5).with_method(method);
        assert_eq!(settings.method(), method);
        let (image, outcome) = process_columns(&roof(), &settings, &notes).unwrap();
        assert_eq!(
            *notes.stages.lock().unwrap(),
            [Stage::Regrid, Stage::Segment, Stage::Reconstruct]
        );
        assert_eq!(outcome.stages, *notes.stages.lock().unwrap());
        assert!(notes.steps.load(Ordering::Relaxed) > 0);
        assert!(image.valid_nodes() >= 49 * 49, "{}", image.valid_nodes());
        assert_eq!(outcome.regions.regions(), 2, "{method}");
        let model = &outcome.reconstruction.model;
        assert_eq!(model.faces.len(), 2, "{method}");
        for fit in &outcome.reconstruction.regions {
            assert!(fit.rms_mm < 0.05, "{method}: {fit:?}");
        }
    }
}

#[test]
fn a_range_image_alone_is_not_regridded() {
    let settings = Settings {
        kinds: Kinds::FreeForm,
        ..Settings::new(0.5)
    };
    let (image, with_columns) = process_columns(&roof(), &settings, &Unmonitored).unwrap();
    let from_image = process(&image, &settings, &Unmonitored).unwrap();
    assert_eq!(from_image.stages, [Stage::Segment, Stage::Reconstruct]);
    assert_eq!(from_image.regions, with_columns.regions);
    // Samples tell more of the outline, and nothing of the surfaces.
    let fits = |outcome: &Outcome| {
        let each = outcome.reconstruction.regions.iter();
        each.map(|fit| (fit.nodes, fit.rms_mm)).collect::<Vec<_>>()
    };
    assert_eq!(fits(&from_image), fits(&with_columns));
    let basis = |outcome: &Outcome| {
        outcome
            .kinds
            .iter()
            .map(|kind| kind.basis)
            .collect::<Vec<_>>()
    };
    assert_eq!(basis(&from_image), [Basis::Nodes; 2]);
    assert_eq!(basis(&with_columns), [Basis::Samples; 2]);
}

#[test]
fn scans_without_a_part_say_what_to_do() {
    let settings = Settings::new(0.5);
    let empty = RangeImage::masked(Lattice { pitch_mm: 0.5 }, 0, 0, 20, 20);
    let nothing = process(&empty, &settings, &Unmonitored).unwrap_err();
    assert!(
        matches!(nothing, PipelineError::NothingMeasured),
        "{nothing:?}"
    );
    assert!(nothing.hint().is_some());

    let none = process_columns(&[], &settings, &Unmonitored).unwrap_err();
    assert!(matches!(none, PipelineError::NothingMeasured), "{none:?}");

    let mut speck = empty;
    speck.set_z_mm(3, 3, Some(1.0));
    speck.set_z_mm(12, 9, Some(2.0));
    let too_little = process(&speck, &settings, &Unmonitored).unwrap_err();
    assert!(
        matches!(too_little, PipelineError::NoSurface { nodes: 2, .. }),
        "{too_little:?}"
    );
    assert!(too_little.hint().is_some());
}

#[test]
fn a_cancelled_run_ends_in_whatever_stage_it_is() {
    for stage in [Stage::Regrid, Stage::Segment, Stage::Reconstruct] {
        let notes = Notes {
            cancel_at: Some(stage),
            ..Notes::default()
        };
        let ended = process_columns(&roof(), &Settings::new(0.5), &notes).unwrap_err();
        assert!(
            matches!(ended, PipelineError::Cancelled),
            "{stage}: {ended:?}"
        );
        assert_eq!(notes.stages.lock().unwrap().last(), Some(&stage));
    }
}

#[test]
fn settings_are_refused_with_their_stage() {
    let refused = |change: fn(&mut Settings)| {
        let mut settings = Settings::new(0.5);
        change(&mut settings);
        settings.validate().unwrap_err().to_string()
    };
    assert!(refused(|s| s.regrid.pitch_mm = -1.0).starts_with("regrid: pitch_mm"));
    assert!(refused(|s| s.segment.clusters = 0).starts_with("segment: clusters"));
    assert!(refused(|s| s.reconstruct.tolerance_mm = f64::NAN).starts_with("reconstruct: "));
    assert!("relif".parse::<Method>().is_err());
    assert_eq!("shim-lee".parse::<Method>(), Ok(Method::ShimLee));
}

/// A rough roof of three planes before a smooth plane that fills the rest of the view, or
/// nothing where that is left out.
fn rough_roof(behind: bool) -> RangeImage {
    let (columns, rows) = (120, 100);
    let mut image = RangeImage::masked(Lattice { pitch_mm: 0.5 }, 0, 0, columns, rows);
    let mut state = 7_u64;
    let mut stray_mm = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        0.3 * ((state >> 40) as f64 / f64::from(1 << 24) - 0.5)
    };
    for column in 0..columns {
        for row in 0..rows {
            let (x, y) = (image.x_mm(column) - 30.0, image.y_mm(row) - 25.0);
            let stray_mm = stray_mm();
            let on_roof = x.abs() < 15.0 && y.abs() < 12.0;
            let z_mm = if on_roof {
                Some(40.0 - (0.5 * x).max(-0.3 * x) - (0.2 * y).max(0.0) + stray_mm)
            } else {
                behind.then_some(0.05 * x)
            };
            image.set_z_mm(column, row, z_mm);
        }
    }
    image
}

#[test]
fn a_smooth_plane_behind_has_no_say_in_the_faces_of_a_rough_part() {
    let settings = Settings::new(0.5);
    let noise_mm = |image: &RangeImage| {
        let found = segment::segment_with_report(image, &settings.segment, &Unmonitored);
        found.unwrap().report.noise_mm
    };
    let (alone, before_a_plane) = (rough_roof(false), rough_roof(true));
    assert!(noise_mm(&before_a_plane) < 0.5 * noise_mm(&alone));

    let view = View::default();
    let part = divide(&before_a_plane, &view, &settings, &Unmonitored).unwrap();
    assert_eq!(part.background.regions.len(), 1);
    let left: usize = part.image.as_ref().map_or(0, RangeImage::valid_nodes);
    assert_eq!(left, alone.valid_nodes());
    assert_eq!(
        part.regions,
        divide(&alone, &view, &settings, &Unmonitored)
            .unwrap()
            .regions
    );
    assert!(part.regions.regions() >= 2);
    let of_part = part.roles.iter().filter(|&&role| role == NodeRole::Part);
    let labelled = part
        .regions
        .raw_labels()
        .iter()
        .filter(|&&label| label != 0);
    assert_eq!(of_part.count(), labelled.count());
}

/// A dome between two planes, as a sphere of 30 mm that rises from a tilted plane.
fn dome() -> Vec<Column> {
    (-40..=40)
        .map(|i| {
            let x_mm = f64::from(i) * 0.5;
            let samples = (-40..=40).map(|j| {
                let y_mm = f64::from(j) * 0.5;
                let off2 = x_mm * x_mm + y_mm * y_mm;
                let cap_mm = (30.0_f64 * 30.0 - off2).sqrt() - 26.0;
                Sample {
                    y_mm,
                    z_mm: cap_mm.max(0.05 * x_mm),
                    intensity: 255,
                }
            });
            Column::new(x_mm, samples.collect())
        })
        .collect()
}

#[test]
fn surfaces_that_are_known_are_the_faces_themselves() {
    let (_, outcome) = process_columns(&dome(), &Settings::new(0.5), &Unmonitored).unwrap();
    let faces = &outcome.reconstruction.model.faces;
    let families: Vec<_> = faces
        .iter()
        .map(|face| face.form.as_ref().and_then(Form::shape).map(Shape::family))
        .collect();
    assert!(families.contains(&Some(Family::Sphere)), "{families:?}");
    assert!(families.contains(&Some(Family::Plane)), "{families:?}");
    for face in faces {
        let Surface::Patches(patches) = &face.surface;
        let shape = face.form.as_ref().and_then(Form::shape).unwrap();
        if shape.family() == Family::Plane {
            assert_eq!(patches.patches.len(), 1);
        }
        // Where its border runs as well as within.
        let coedges = || face.outer.coedges.iter();
        assert!(coedges().count() > 0);
        for [x, y, z] in coedges().flat_map(|coedge| coedge.space_curve.sampled(100)) {
            let off = shape.distance_mm(&nalgebra::Vector3::new(x, y, z));
            assert!(off.abs() < 2e-3, "{:?} at {x}, {y}: {off}", shape.family());
        }
    }

    let settings = Settings {
        kinds: Kinds::FreeForm,
        ..Settings::new(0.5)
    };
    let (_, outcome) = process_columns(&dome(), &settings, &Unmonitored).unwrap();
    let faces = &outcome.reconstruction.model.faces;
    assert!(faces.iter().all(|face| face.form.is_none()));
    assert!(outcome.kinds.iter().any(|kind| kind.shape().is_some()));
}

/// What a dent leaves in the sum of squares of a large plane is little; the face must have it.
#[test]
fn a_dented_plane_is_not_made_flat() {
    let dent = |x: f64, y: f64| {
        let off = libm::hypot(x - 4.0, y + 3.0);
        if off < 6.0 {
            0.1 * (1.0 + libm::cos(core::f64::consts::PI * off / 6.0))
        } else {
            0.0
        }
    };
    let columns: Vec<Column> = (-80..=80)
        .map(|i| {
            let x_mm = f64::from(i) * 0.5 + 0.2;
            let samples = (-90..=90).map(|j| {
                let y_mm = f64::from(j) * 0.45;
                // As good as random, evenly up to 0.03 mm either way.
                let phase = f64::from(i) * 12.9898 + f64::from(j) * 78.233;
                let rough = 0.06 * ((libm::sin(phase) * 43_758.545).rem_euclid(1.0) - 0.5);
                Sample {
                    y_mm,
                    z_mm: 0.1 * x_mm - dent(x_mm, y_mm) + rough,
                    intensity: 255,
                }
            });
            Column::new(x_mm, samples.collect())
        })
        .collect();
    for smooth_joins in SmoothJoins::ALL {
        let mut settings = Settings {
            background: BackgroundPolicy::Keep,
            smooth_joins,
            ..Settings::new(0.5)
        };
        // On the whole the plane is nearer than by the usual tolerance, dent and all.
        settings.reconstruct.tolerance_mm = 0.002;
        let (image, outcome) = process_columns(&columns, &settings, &Unmonitored).unwrap();
        let restored = &outcome.reconstruction.restored;
        let place = |count: usize, at: &dyn Fn(usize) -> f64, mm: f64| {
            (0..count).min_by(|&a, &b| (at(a) - mm).abs().total_cmp(&(at(b) - mm).abs()))
        };
        let column = place(image.columns(), &|c| image.x_mm(c), 4.0).unwrap();
        let row = place(image.rows(), &|r| image.y_mm(r), -3.0).unwrap();
        let depth_mm = 0.1 * image.x_mm(column) - restored.z_mm(column, row).unwrap();
        assert!((depth_mm - 0.2).abs() < 0.04, "{depth_mm}");
        assert!(outcome.kinds[0].shape().is_some(), "most of it is a plane");
        if smooth_joins == SmoothJoins::Keep {
            assert!(outcome.reconstruction.model.faces[0].form.is_none());
        }
    }
}
