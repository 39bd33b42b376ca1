//! A scanner that is mounted askew, calibrated and judged by the program: from the simulator to
//! journals, and from these on as a user would do it. What the simulator knows never gets there.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    reason = "a test that cannot go on says where"
)]

use crate::common;

use std::fs;
use std::path::Path;
use std::process::Output;

use common::relief;
use common::schema::check;
use range_image::Calibration;
use range_image::calibration::Head;
use scan_record::{EndCause, Header, JournalWriter, RawColumn, RawSample};
use serde_json::{Value, json};
use sim_scanner::Vec3;
use sim_scanner::config::{Object, SimConfig};
use sim_scanner::preset::Overrides;
use sim_scanner::scene::artefacts::{Artefact, STEP_HEIGHTS_MM};
use sim_scanner::source::Source;

/// Offsets, a wrong scale, and a head and a table that lean.
const MOUNT: &str = "angle-offset-deg=0.5,angle-scale=0.005,camera-y-mm=2,camera-z-mm=-2,\
                     plane-about-y-deg=0.4,plane-about-z-deg=-0.3,table-y-deg=0.2";

/// A scan to be taken.
#[derive(Clone)]
struct Taken<'a> {
    object: &'a str,
    at_mm: Vec<[f64; 3]>,
    diameter_mm: f64,
    tilt_deg: (f64, f64),
    mount: &'a str,
    seed: u64,
    serial: &'a str,
    minute: u32,
    dense: bool,
    outliers: f64,
}

impl Default for Taken<'_> {
    fn default() -> Self {
        Self {
            object: "sphere",
            at_mm: Vec::new(),
            diameter_mm: 25.4,
            tilt_deg: (0.0, 0.0),
            mount: MOUNT,
            seed: 1,
            serial: "SIM-0001",
            minute: 0,
            dense: false,
            outliers: 0.0,
        }
    }
}

impl Taken<'_> {
    /// Takes the scan that the device proposes, and keeps it as the service would.
    fn keep(&self, folder: &Path, name: &str) -> String {
        let config = SimConfig {
            object: Object::BuiltIn(self.object.into()),
            artefact: Artefact {
                diameter_mm: self.diameter_mm,
                at_mm: self.at_mm.iter().map(|&at| Vec3::from_array(at)).collect(),
                tilt_deg: self.tilt_deg,
            },
            overrides: Overrides {
                mount: self.mount.parse().unwrap(),
                columns: self.dense.then_some(480),
                samples: self.dense.then_some(512),
                outliers: Some(self.outliers),
                ..Overrides::default()
            },
            seed: self.seed,
            ..SimConfig::default()
        };
        let source = config.source().unwrap();
        let header = self.header(&source);
        let Source::Simulated { scanner, proposed } = source else {
            panic!("it is no recording");
        };
        let path = folder.join(name);
        let mut journal = JournalWriter::new(Vec::new(), &header).unwrap();
        for index in 0..proposed.columns {
            let column = scanner.column(&proposed, self.seed, index);
            let seen = column.samples.iter().filter(|sample| !sample.no_return);
            let samples: Vec<RawSample> = seen
                .map(|sample| RawSample {
                    lateral_counts: sample.lateral_counts,
                    range_counts: sample.range_counts,
                    intensity: sample.intensity,
                    saturated: sample.saturated,
                })
                .collect();
            let raw = RawColumn {
                index,
                table_counts: column.table_counts,
                dropouts: 0,
                samples,
            };
            journal.append(&raw).unwrap();
        }
        fs::write(path, journal.finish(&EndCause::Complete).unwrap()).unwrap();
        name.to_owned()
    }

    fn header(&self, source: &Source) -> Header {
        let wire = source.calibration();
        let scanner_protocol::Head::Polar {
            camera_y_nm,
            camera_z_nm,
            angle_count_prad,
            range_count_pm,
        } = wire.head
        else {
            panic!("it has a polar head");
        };
        let time = format!("2026-11-29T10:{:02}:00Z", self.minute);
        let scan = json!({
            "id": "x", "name": "x", "scanner": "left", "state": "complete", "started_at": time,
        });
        Header {
            calibration: Calibration {
                table_origin_mm: wire.table_origin_nm as f64 / 1e6,
                table_count_mm: f64::from(wire.table_count_pm) / 1e9,
                head: Head::Polar {
                    camera_y_mm: camera_y_nm as f64 / 1e6,
                    camera_z_mm: camera_z_nm as f64 / 1e6,
                    angle_count_rad: f64::from(angle_count_prad) / 1e12,
                    range_count_mm: f64::from(range_count_pm) / 1e9,
                },
                correction: None,
            },
            column_pitch_mm: 0.0,
            sample_spacing_mm: 0.0,
            identity: json!({"model": "SIM", "serial": self.serial, "firmware": "1"})
                .to_string()
                .into_bytes(),
            plan: Vec::new(),
            settings: Vec::new(),
            metadata: scan.to_string().into_bytes(),
            correction: Vec::new(),
        }
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn document(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", stderr(output)))
}

/// Ten places across the measuring volume.
const PLACES: [[f64; 3]; 10] = [
    [0.0, 0.0, 20.0],
    [-45.0, -40.0, 25.0],
    [45.0, -40.0, -25.0],
    [-45.0, 40.0, -25.0],
    [45.0, 40.0, 25.0],
    [0.0, 0.0, -25.0],
    [-45.0, 0.0, 0.0],
    [45.0, 0.0, 0.0],
    [0.0, -45.0, 0.0],
    [0.0, 45.0, 0.0],
];

/// Errors of dimensions: diameters of spheres of another size, distances of all pairs of them, and
/// steps, measured on scans of seeds and at places that were not calibrated with.
fn dimension_errors_mm(folder: &Path, mount: &str, seed: u64, calibration: bool) -> Vec<Vec<f64>> {
    fs::write(
        folder.join("balls.toml"),
        "name = 'balls'\nsphere_diameter_mm = 20.0\n",
    )
    .unwrap();
    fs::write(
        folder.join("gauge.toml"),
        format!("name = 'gauge'\nstep_heights_mm = {STEP_HEIGHTS_MM:?}\n"),
    )
    .unwrap();
    let balls = [
        [-38.0, -33.0, -12.0],
        [5.0, -36.0, 18.0],
        [41.0, -12.0, 3.0],
        [-31.0, 22.0, 21.0],
        [28.0, 37.0, -17.0],
    ];
    let of = |object, seed, tilt_deg, at_mm: &[[f64; 3]]| Taken {
        object,
        at_mm: at_mm.to_vec(),
        diameter_mm: 20.0,
        tilt_deg,
        mount,
        seed,
        ..Taken::default()
    };
    of("spheres", seed, (0.0, 0.0), &balls).keep(folder, "balls.scan");
    of("step-gauge", seed + 1, (8.0, -6.0), &[[4.0, -7.0, 3.0]]).keep(folder, "gauge.scan");
    let judged = |what: &str| {
        let (scan, reference) = (format!("{what}.scan"), format!("{what}.toml"));
        let mut arguments = vec!["accept", &scan, "--reference", &reference, "--json"];
        if calibration {
            arguments.extend(["--calibration", "calibration.toml"]);
        }
        let told = relief(folder, &arguments);
        assert!(told.status.success(), "{}", stderr(&told));
        document(&told)["scans"][0].clone()
    };
    let spheres = judged("balls")["spheres"].clone();
    let spheres = spheres.as_array().unwrap();
    assert_eq!(spheres.len(), balls.len());
    let centre = |sphere: &Value| -> [f64; 3] {
        core::array::from_fn(|axis| sphere["centre_mm"][axis].as_f64().unwrap())
    };
    let distance = |a: [f64; 3], b: [f64; 3]| {
        let squares: f64 = (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum();
        squares.sqrt()
    };
    let sizes = spheres
        .iter()
        .map(|own| own["size_error_mm"].as_f64().unwrap());
    let mut sorted = balls;
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut spacings = Vec::new();
    for (k, a) in spheres.iter().enumerate() {
        for (l, b) in spheres.iter().enumerate().take(k) {
            spacings.push(distance(centre(a), centre(b)) - distance(sorted[k], sorted[l]));
        }
    }
    let steps = judged("gauge")["step_errors_mm"].clone();
    let steps = steps.as_array().unwrap().iter().skip(1);
    vec![
        sizes.collect(),
        spacings,
        steps.map(|error| error.as_f64().unwrap()).collect(),
    ]
}

fn rms<'a>(errors: impl IntoIterator<Item = &'a f64>) -> f64 {
    let (sum, count) = errors
        .into_iter()
        .fold((0.0, 0), |(sum, count), e| (sum + e * e, count + 1));
    (sum / f64::from(count)).sqrt()
}

#[test]
fn a_calibrated_scanner_measures_nearly_as_one_that_is_mounted_as_it_says() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let scans: Vec<String> = (0..)
        .zip(PLACES)
        .map(|(k, place)| {
            let taken = Taken {
                at_mm: vec![place],
                seed: 7000 + k,
                dense: true,
                outliers: 0.01,
                ..Taken::default()
            };
            taken.keep(at, &format!("sphere-{k}.scan"))
        })
        .collect();
    let mut arguments = vec!["calibrate"];
    arguments.extend(scans.iter().map(String::as_str));
    let options = [
        "--sphere-diameter-mm",
        "25.4",
        "-o",
        "calibration.toml",
        "--json",
    ];
    arguments.extend(options);
    let told = relief(at, &arguments);
    assert!(told.status.success(), "{}", stderr(&told));
    let told = document(&told);
    println!("{:#}", told["determined"]);
    let kinds = ["diameters", "distances", "steps"];
    let mut ratios = Vec::new();
    let mut all = [Vec::new(), Vec::new(), Vec::new()];
    for seed in [9100, 9200, 9300, 9400] {
        let askew = dimension_errors_mm(at, MOUNT, seed, false);
        let calibrated = dimension_errors_mm(at, MOUNT, seed, true);
        let perfect = dimension_errors_mm(at, "", seed, false);
        for (own, errors) in all.iter_mut().zip([askew, calibrated, perfect]) {
            own.push(errors);
        }
    }
    for (kind, name) in kinds.into_iter().enumerate() {
        let of = |which: &[Vec<Vec<f64>>]| rms(which.iter().flat_map(|run| &run[kind]));
        let [askew, calibrated, perfect] = [of(&all[0]), of(&all[1]), of(&all[2])];
        println!("{name:10} askew {askew:.4} calibrated {calibrated:.4} perfect {perfect:.4}");
        ratios.push(calibrated / perfect);
    }
    let of = |which: &[Vec<Vec<f64>>]| rms(which.iter().flatten().flatten());
    let [askew, calibrated, perfect] = [of(&all[0]), of(&all[1]), of(&all[2])];
    println!("all        askew {askew:.4} calibrated {calibrated:.4} perfect {perfect:.4}");
    assert!(calibrated < 1.5 * perfect, "{ratios:?}");
    assert!(ratios.iter().all(|ratio| *ratio < 1.5), "{ratios:?}");
    assert!(askew > 10.0 * calibrated, "{askew} {calibrated}");
}

#[test]
fn what_cannot_be_calibrated_with_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let keep = |name: &str, place: [f64; 3], serial: &'static str| {
        let taken = Taken {
            at_mm: vec![place],
            serial,
            ..Taken::default()
        };
        taken.keep(at, name)
    };
    keep("a.scan", PLACES[0], "SIM-0001");
    keep("b.scan", PLACES[1], "SIM-0001");
    keep("c.scan", PLACES[2], "SIM-0002");
    let plate = Taken {
        object: "plate",
        ..Taken::default()
    };
    plate.keep(at, "plate.scan");
    fs::write(at.join("cloud.xyz"), "1 2 3\n").unwrap();
    fs::write(at.join("gauge.toml"), "heights_mm = [0, 10, 5]\n").unwrap();
    let diameter = ["--sphere-diameter-mm", "25.4"];
    for (scans, options, code, words) in [
        (
            &["a.scan", "b.scan"][..],
            &diameter[..],
            1,
            "at 2 places only",
        ),
        (
            &["a.scan", "c.scan"][..],
            &diameter[..],
            1,
            "a.scan was taken by SIM, serial number SIM-0001, but c.scan by SIM, serial number \
             SIM-0002",
        ),
        (
            &["a.scan", "plate.scan"][..],
            &diameter[..],
            1,
            "plate.scan: no sphere of 25.4 mm is seen",
        ),
        (
            &["cloud.xyz"][..],
            &diameter[..],
            1,
            "cloud.xyz is no scan journal",
        ),
        (
            &["a.scan"][..],
            &["--sphere-diameter-mm", "50"][..],
            1,
            "no sphere of 50 mm is seen",
        ),
        (
            &["a.scan"][..],
            &["--sphere-diameter-mm", "25.4", "--scanner", "right"][..],
            1,
            "not taken by the scanner right, but by left",
        ),
        (
            &["a.scan"][..],
            &["--sphere-diameter-mm", "0"][..],
            2,
            "must lie between",
        ),
        (&["a.scan"][..], &[][..], 2, "--sphere-diameter-mm"),
        (
            &["a.scan"][..],
            &["--step-gauge", "gauge.toml"][..],
            1,
            "must ascend",
        ),
        (
            &["none.scan"][..],
            &diameter[..],
            1,
            "cannot read none.scan",
        ),
    ] {
        let told = relief(at, &[&["calibrate"][..], scans, options].concat());
        let error = stderr(&told);
        assert!(error.contains(words), "{words}: {error}");
        assert_eq!(told.status.code(), Some(code), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn scans_that_were_corrected_are_calibrated_with_as_the_scanner_sent_them() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let scans = ["a.scan", "b.scan", "c.scan"];
    for (k, name) in scans.into_iter().enumerate() {
        let taken = Taken {
            at_mm: vec![PLACES[k + 1]],
            seed: 40 + k as u64,
            ..Taken::default()
        };
        taken.keep(at, name);
    }
    let run = |names: &[&str]| {
        let arguments = [
            &["calibrate"][..],
            names,
            &["--sphere-diameter-mm", "25.4", "--json"],
        ];
        let told = relief(at, &arguments.concat());
        assert!(told.status.success(), "{}", stderr(&told));
        (document(&told), stderr(&told))
    };
    let (plain, error) = run(&scans);
    assert_eq!(error, "");
    check("commands.schema.json#/$defs/calibrate", &plain);
    // The same counts, in journals that say that they were corrected.
    for name in scans {
        let bytes = fs::read(at.join(name)).unwrap();
        let mut journal = scan_record::JournalReader::new(bytes.as_slice()).unwrap();
        let mut header = journal.header().clone();
        header.calibration.correction = Some(range_image::Correction {
            angle_scale: 0.03,
            ..range_image::Correction::default()
        });
        let mut writer = JournalWriter::new(Vec::new(), &header).unwrap();
        while let Some(column) = journal.next_column().unwrap() {
            writer.append(&column).unwrap();
        }
        fs::write(at.join(name), writer.finish(&EndCause::Complete).unwrap()).unwrap();
    }
    let (corrected, error) = run(&scans);
    assert!(
        error.contains("3 scans were taken with a correction"),
        "{error}"
    );
    assert_eq!(corrected["determined"], plain["determined"]);
    assert_eq!(corrected["references"], plain["references"]);
}

#[test]
fn a_scanner_is_accepted_or_not() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut scans = Vec::new();
    for k in 0..5 {
        let taken = Taken {
            object: "ball-bar",
            at_mm: vec![[-20.0, -30.0, 5.0], [25.0, 35.0, -10.0]],
            mount: "",
            seed: 60 + u64::from(k),
            minute: 10 * k,
            ..Taken::default()
        };
        scans.push(taken.keep(at, &format!("bar-{k}.scan")));
    }
    let limits = |spacing_mm: f64| {
        format!(
            "name = 'bar 17'\nsphere_diameter_mm = 25.4\nsphere_spacing_mm = {spacing_mm}\n\
             [limits]\nprobing_form_mm = 0.5\nprobing_size_mm = 0.05\nsphere_spacing_mm = 0.03\n\
             repeatability_mm = 0.03\ndrift_mm_per_h = 0.1\n"
        )
    };
    let known_mm = (45.0_f64 * 45.0 + 65.0 * 65.0 + 15.0 * 15.0).sqrt();
    fs::write(at.join("bar.toml"), limits(known_mm)).unwrap();
    fs::write(at.join("longer.toml"), limits(known_mm + 0.2)).unwrap();
    let run = |reference: &str, more: &[&str]| {
        let mut arguments = vec!["accept", "--reference", reference];
        arguments.extend(scans.iter().map(String::as_str));
        arguments.extend(more);
        relief(at, &arguments)
    };
    let more = [
        "--json", "--report", "r.json", "--page", "r.html", "--page", "r.pdf",
    ];
    let passed = run("bar.toml", &more);
    assert!(passed.status.success(), "{}", stderr(&passed));
    let told = document(&passed);
    check("acceptance.schema.json", &told);
    let written: Value = serde_json::from_slice(&fs::read(at.join("r.json")).unwrap()).unwrap();
    assert_eq!(told, written);
    assert_eq!(told["passed"], true);
    let figure = |key: &str| {
        let figures = told["figures"].as_array().unwrap();
        figures
            .iter()
            .find(|own| own["key"] == key)
            .unwrap()
            .clone()
    };
    assert_eq!(figure("sphere_spacing_mm")["count"], 5);
    assert_eq!(figure("probing_size_mm")["count"], 10);
    let repeats = told["repeatability"].as_array().unwrap();
    let spacing = repeats
        .iter()
        .find(|own| own["figure"] == "distance of spheres 1 and 2");
    let deviation_mm = spacing.unwrap()["standard_deviation_mm"].as_f64().unwrap();
    assert!((0.0003..0.012).contains(&deviation_mm), "{deviation_mm}");
    assert_eq!(told["drift"].as_array().unwrap().len(), repeats.len());
    let page = fs::read_to_string(at.join("r.html")).unwrap();
    assert!(page.contains("Passed") && page.contains("VDI/VDE 2634"));
    assert!(fs::read(at.join("r.pdf")).unwrap().starts_with(b"%PDF"));

    let failed = run("longer.toml", &[]);
    assert_eq!(failed.status.code(), Some(1));
    let error = stderr(&failed);
    assert!(error.contains("sphere-spacing error SD"), "{error}");
    let table = String::from_utf8_lossy(&failed.stdout).into_owned();
    assert!(
        table.contains("beyond") && table.contains("within"),
        "{table}"
    );
}
