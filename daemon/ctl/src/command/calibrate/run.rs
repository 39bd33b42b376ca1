//! The calibration itself.

use std::path::Path;

use deliverables::write_atomically;
use jiff::Timestamp;
use metrology::calibrate::{CalibrateError, FEWEST_PLACES, References, Size};
use metrology::deviations::Unit;
use metrology::{Calibrated, Determined, Deviation, Scan, calibrate};
use range_image::correction::DEVIATIONS;
use reliefd::calibration::{Announced, CalibrationFile, Deviations};
use serde::Serialize;

use super::{Args, reference, summary};
use crate::command::{places, timestamp};
use crate::failure::Failure;
use crate::output;
use crate::raw_scan::{self, RawScan};

/// What `--json` prints.
#[derive(Debug, Serialize)]
pub(super) struct Told {
    /// As it is written into the calibration file.
    pub(super) calibration: CalibrationFile,
    /// Where that was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) written: Option<String>,
    /// What was determined.
    pub(super) determined: Vec<DeterminedTold>,
    /// What does not differ significantly from zero, and stays there.
    pub(super) insignificant: Vec<DeterminedTold>,
    /// What was not determined.
    pub(super) undetermined: Vec<UndeterminedTold>,
    /// Pairs that can hardly be told apart.
    pub(super) correlated: Vec<CorrelatedTold>,
    /// Singular values of the scaled problem, descending.
    pub(super) singular_values: Vec<f64>,
    /// Largest by smallest of what was determined.
    pub(super) condition: f64,
    /// The references that were seen.
    pub(super) references: Vec<ReferenceTold>,
    /// What the user should know.
    pub(super) notes: Vec<String>,
}

#[derive(Debug, Serialize)]
pub(super) struct DeterminedTold {
    pub(super) deviation: &'static str,
    pub(super) value: f64,
    pub(super) uncertainty: f64,
    pub(super) unit: &'static str,
}

impl DeterminedTold {
    fn new(own: &Determined) -> Self {
        Self {
            deviation: own.deviation.name(),
            value: own.value,
            uncertainty: own.uncertainty,
            unit: unit(own.deviation),
        }
    }
}

#[derive(Debug, Serialize)]
pub(super) struct UndeterminedTold {
    pub(super) deviation: &'static str,
    /// Standard uncertainty that it would have; `null` where the scans say nothing.
    pub(super) uncertainty: Option<f64>,
    pub(super) unit: &'static str,
    pub(super) advice: &'static str,
}

#[derive(Debug, Serialize)]
pub(super) struct CorrelatedTold {
    pub(super) deviations: [&'static str; 2],
    pub(super) coefficient: f64,
}

#[derive(Debug, Serialize)]
pub(super) struct ReferenceTold {
    pub(super) scan: String,
    /// `sphere` or `step gauge`.
    pub(super) kind: &'static str,
    pub(super) samples: usize,
    /// Centre of a sphere, once corrected.
    pub(super) centre_mm: Option<[f64; 3]>,
    /// Error of the diameter, or the greatest of a height, without the correction.
    pub(super) error_before_mm: f64,
    /// The same with it.
    pub(super) error_after_mm: f64,
    /// Standard uncertainty of the latter.
    pub(super) uncertainty_mm: Option<f64>,
}

/// Calibrates, tells, and writes the file if asked to.
pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    args.output.as_deref().map_or(Ok(()), places::check_file)?;
    let references = reference::read(&args)?;
    let scans = raw_scan::read_all(&args.scans, &args.endpoint).await?;
    let told = calibrated(&args, &references, &scans)?;
    for note in &told.notes {
        eprintln!("relief: note: {note}");
    }
    output::either(json, &told, summary::told)
}

fn calibrated(args: &Args, references: &References, scans: &[RawScan]) -> Result<Told, Failure> {
    let Some(first) = scans.first() else {
        return Err(Failure::Usage("name scans to calibrate with".into()));
    };
    if let Some(wanted) = &args.scanner
        && let Some(other) = scans.iter().find(|scan| scan.scanner != *wanted)
    {
        return Err(Failure::Failed(format!(
            "{} was not taken by the scanner {wanted}, but by {}",
            other.name,
            if other.scanner.is_empty() {
                "one without a name"
            } else {
                &other.scanner
            }
        )));
    }
    let raw: Vec<Scan> = scans.iter().map(|own| own.scan.clone()).collect();
    let told = calibrate(&raw, references).map_err(|error| refused(&error, scans, references))?;
    let latest = scans.iter().filter_map(|own| own.started_at).max();
    let date = timestamp::of(args.date, latest, Path::new(&first.name))?;
    let file = calibration_file(&told, references, first, scans, date);
    if let Some(path) = &args.output {
        write_atomically::<std::io::Error>(path, |sink| sink.write_all(file.to_toml().as_bytes()))
            .map_err(|error| Failure::at(format!("cannot write {}", path.display()), &error))?;
    }
    Ok(Told {
        written: args.output.as_ref().map(|path| path.display().to_string()),
        determined: told.determined.iter().map(DeterminedTold::new).collect(),
        insignificant: told.insignificant.iter().map(DeterminedTold::new).collect(),
        undetermined: told
            .undetermined
            .iter()
            .map(|own| UndeterminedTold {
                deviation: own.deviation.name(),
                uncertainty: own.uncertainty,
                unit: unit(own.deviation),
                advice: own.deviation.advice(),
            })
            .collect(),
        correlated: told
            .correlated
            .iter()
            .map(|(a, b, coefficient)| CorrelatedTold {
                deviations: [a.name(), b.name()],
                coefficient: *coefficient,
            })
            .collect(),
        singular_values: told.singular_values.clone(),
        condition: told.condition,
        references: seen(&told, scans),
        notes: notes(&told, scans),
        calibration: file,
    })
}

fn unit(deviation: Deviation) -> &'static str {
    match deviation.unit() {
        Unit::Radians => "rad",
        Unit::Millimetres => "mm",
        Unit::Share => "1",
    }
}

fn seen(told: &Calibrated, scans: &[RawScan]) -> Vec<ReferenceTold> {
    let name = |scan: usize| {
        scans
            .get(scan)
            .map_or_else(String::new, |own| own.name.clone())
    };
    told.seen
        .iter()
        .map(|own| {
            let (kind, centre_mm, [error_before_mm, error_after_mm], uncertainty_mm) =
                match &own.size {
                    Size::Sphere {
                        centre_mm,
                        error_mm,
                        uncertainty_mm,
                    } => ("sphere", Some(*centre_mm), *error_mm, Some(*uncertainty_mm)),
                    Size::Steps { error_mm, .. } => ("step gauge", None, *error_mm, None),
                };
            ReferenceTold {
                scan: name(own.scan),
                kind,
                samples: own.samples,
                centre_mm,
                error_before_mm,
                error_after_mm,
                uncertainty_mm,
            }
        })
        .collect()
}

fn notes(told: &Calibrated, scans: &[RawScan]) -> Vec<String> {
    let mut notes: Vec<String> = scans.iter().flat_map(|own| own.notes.clone()).collect();
    for scan in &told.cut_off {
        let name = scans.get(*scan).map_or("", |own| own.name.as_str());
        notes.push(format!(
            "{name}: a sphere is not seen on all sides and was left out"
        ));
    }
    let corrected = scans
        .iter()
        .filter(|own| own.scan.calibration.correction.is_some());
    match corrected.count() {
        0 => {}
        count => notes.push(format!(
            "{} taken with a correction, which was set aside: the new one replaces it",
            if count == 1 {
                "1 scan was".to_owned()
            } else {
                format!("{count} scans were")
            }
        )),
    }
    notes
}

fn calibration_file(
    told: &Calibrated,
    references: &References,
    first: &RawScan,
    scans: &[RawScan],
    date: Timestamp,
) -> CalibrationFile {
    let spheres = told
        .seen
        .iter()
        .filter(|own| matches!(own.size, Size::Sphere { .. }));
    let (spheres, all) = (spheres.count(), told.seen.len());
    let mut reference = Vec::new();
    if let Some(diameter_mm) = references.sphere_diameter_mm.filter(|_| spheres > 0) {
        let known = if references.places.is_empty() {
            ""
        } else {
            " at known places"
        };
        reference.push(format!(
            "sphere of {diameter_mm} mm, seen {spheres} times{known}"
        ));
    }
    if let Some(heights) = references
        .step_heights_mm
        .as_ref()
        .filter(|_| all > spheres)
    {
        let count = heights.len();
        reference.push(format!(
            "step gauge of {count} heights, seen {} times",
            all - spheres
        ));
    }
    let mut uncertainty = [0.0; DEVIATIONS];
    for own in told.determined.iter().chain(&told.insignificant) {
        let place = Deviation::ALL.iter().position(|all| *all == own.deviation);
        if let Some(slot) = place.and_then(|place| uncertainty.get_mut(place)) {
            *slot = own.uncertainty;
        }
    }
    CalibrationFile {
        scanner_model: first.model.clone(),
        scanner_serial: first.serial.clone(),
        date: date.to_string(),
        method: "least squares over raw samples, Tukey's weights".into(),
        reference: reference.join("; "),
        scans: scans.iter().map(|own| own.name.clone()).collect(),
        program: concat!("relief ", env!("CARGO_PKG_VERSION")).into(),
        samples: told.samples as u64,
        residual_before_mm: told.rms_mm[0],
        residual_after_mm: told.rms_mm[1],
        undetermined: told
            .undetermined
            .iter()
            .map(|own| own.deviation.name().to_owned())
            .collect(),
        announced: Announced::of(&first.scan.calibration),
        correction: deviations(told.deviations.correction().to_array()),
        uncertainty: deviations(uncertainty),
    }
}

fn deviations(numbers: [f64; DEVIATIONS]) -> Deviations {
    let correction = range_image::Correction::from_array(numbers);
    let [camera_x_mm, camera_y_mm, camera_z_mm] = correction.camera_mm;
    Deviations {
        angle_offset_rad: correction.angle_offset_rad,
        angle_scale: correction.angle_scale,
        range_offset_mm: correction.range_offset_mm,
        range_scale: correction.range_scale,
        camera_x_mm,
        camera_y_mm,
        camera_z_mm,
        table_y_rad: correction.table_y_rad,
        table_z_rad: correction.table_z_rad,
        table_scale: correction.table_scale,
    }
}

/// Why not, with the scans' names and what to do.
fn refused(error: &CalibrateError, scans: &[RawScan], references: &References) -> Failure {
    let name = |scan: &usize| scans.get(*scan).map_or("a scan", |own| own.name.as_str());
    let sphere = references
        .sphere_diameter_mm
        .map_or_else(String::new, |mm| format!("sphere of {mm} mm"));
    let gauge = references.step_heights_mm.as_ref().map(|_| "step gauge");
    let sought = match (sphere.as_str(), gauge) {
        ("", gauge) => gauge.unwrap_or("reference").to_owned(),
        (sphere, None) => sphere.to_owned(),
        (sphere, Some(gauge)) => format!("{sphere} and no {gauge}"),
    };
    Failure::Failed(match error {
        CalibrateError::NothingSeen { scan } => format!(
            "{}: no {sought} is seen; check the size that is given, and that the scan shows the \
             whole of it, in front of all else, with 60 samples on it at least",
            name(scan)
        ),
        CalibrateError::CutOff { scan } => format!(
            "{}: the sphere is not seen on all sides; scan wider around it, and keep what hides it \
             away",
            name(scan)
        ),
        CalibrateError::OtherCalibration { scan } => format!(
            "{} was taken while the scanner announced other counts or another place of its camera \
             than with {}; take all scans anew",
            name(scan),
            name(&0)
        ),
        CalibrateError::NoPlace {
            scan,
            at_mm: [x, y, z],
        } => format!(
            "{}: the sphere at ({x:.1}, {y:.1}, {z:.1}) mm is near none, or several, of the known \
             places; they must be told in the part frame, x along the table, y up, z towards the \
             camera, and lie far apart",
            name(scan)
        ),
        CalibrateError::TooFew { places } => format!(
            "spheres are seen at {} only, and at least {FEWEST_PLACES} are needed, better five: in \
             the middle and towards the corners of the measuring volume, near and far. A sphere at \
             one place cannot tell a wrong scale from a wrong place",
            output::counted(*places, "place")
        ),
        CalibrateError::NothingDetermined | CalibrateError::NothingGiven => {
            format!("{error}; scan the sphere with more samples on it, and at more places")
        }
    })
}
