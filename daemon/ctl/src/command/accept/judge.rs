//! Figures against limits; series of the same figure.

use deliverables::acceptance::{AcceptedScan, DriftReport, FigureReport, RepeatabilityReport};
use jiff::Timestamp;
use metrology::series::{self, FEWEST_FOR_DRIFT};

use super::measure::distance_mm;
use super::reference::{Limits, Reference};

/// The same figure of several scans, with the hours since the first of these.
struct Series {
    name: String,
    values: Vec<(Option<f64>, f64)>,
}

/// A figure's key, name, unit, limit and values.
type Row = (
    &'static str,
    &'static str,
    &'static str,
    Option<f64>,
    Vec<f64>,
);

/// How figures repeat and drift.
pub(super) fn series(
    scans: &[AcceptedScan],
    reference: &Reference,
) -> (Vec<RepeatabilityReport>, Vec<DriftReport>) {
    let mut repeatability = Vec::new();
    let mut drift = Vec::new();
    for own in gathered(scans, reference) {
        let values: Vec<f64> = own.values.iter().map(|(_, value)| *value).collect();
        if let Some(told) = series::repeatability(&values) {
            repeatability.push(RepeatabilityReport {
                figure: own.name.clone(),
                mean_mm: told.mean,
                standard_deviation_mm: told.standard_deviation,
                range_mm: told.range,
                count: told.count,
            });
        }
        let timed: Vec<(f64, f64)> = own
            .values
            .iter()
            .filter_map(|&(hours, value)| Some((hours?, value)))
            .collect();
        if timed.len() == values.len()
            && let Some(told) = series::drift(&timed)
        {
            drift.push(DriftReport {
                figure: own.name,
                slope_mm_per_h: told.slope_per_h,
                uncertainty_mm_per_h: told.uncertainty_per_h,
                change_mm: told.change,
                settled_after_h: told.settled_after_h,
            });
        }
    }
    (repeatability, drift)
}

/// The values of each figure of what stands still from scan to scan.
fn gathered(scans: &[AcceptedScan], reference: &Reference) -> Vec<Series> {
    let times: Vec<Option<Timestamp>> = scans
        .iter()
        .map(|scan| scan.started_at.as_ref()?.parse().ok())
        .collect();
    let first = times.iter().flatten().min().copied();
    let mut all: Vec<Series> = Vec::new();
    let mut places: Vec<[f64; 3]> = Vec::new();
    let one_place_mm = reference.sphere_diameter_mm.unwrap_or(0.0) / 2.0;
    for (scan, time) in scans.iter().zip(&times) {
        let hours = time
            .zip(first)
            .map(|(time, first)| time.duration_since(first).as_secs_f64() / 3600.0);
        let mut add = |name: String, value: f64| match all.iter_mut().find(|own| own.name == name) {
            Some(own) => own.values.push((hours, value)),
            None => all.push(Series {
                name,
                values: vec![(hours, value)],
            }),
        };
        let mut seen = Vec::new();
        for sphere in &scan.spheres {
            let known = places
                .iter()
                .position(|place| distance_mm(*place, sphere.centre_mm) < one_place_mm);
            let number = known.unwrap_or_else(|| {
                places.push(sphere.centre_mm);
                places.len() - 1
            }) + 1;
            seen.push(number);
            add(format!("size of sphere {number}"), sphere.size_error_mm);
            for (axis, at_mm) in ["x", "y", "z"].into_iter().zip(sphere.centre_mm) {
                add(format!("{axis} of sphere {number}"), at_mm);
            }
        }
        if let (Some(error_mm), [a, b]) = (scan.sphere_spacing_error_mm, seen.as_slice()) {
            add(format!("distance of spheres {a} and {b}"), error_mm);
        }
        if let Some(flatness_mm) = scan.flatness_mm {
            add("flatness".into(), flatness_mm);
        }
        for (step, error_mm) in (1..).zip(&scan.step_errors_mm) {
            if let Some(error_mm) = error_mm {
                add(format!("step {step}"), *error_mm);
            }
        }
    }
    all
}

/// The worst value of each figure against its limit; what has a limit but no value is named in
/// the error.
pub(super) fn figures(
    scans: &[AcceptedScan],
    repeatability: &[RepeatabilityReport],
    drift: &[DriftReport],
    limits: &Limits,
) -> Result<Vec<FigureReport>, String> {
    let spheres = || scans.iter().flat_map(|scan| &scan.spheres);
    let steps = scans
        .iter()
        .flat_map(|scan| scan.step_errors_mm.iter().skip(1).flatten());
    let rows: [Row; 7] = [
        (
            "probing_form_mm",
            "probing error, form PF",
            "mm",
            limits.probing_form_mm,
            spheres().map(|own| own.form_mm).collect(),
        ),
        (
            "probing_size_mm",
            "probing error, size PS",
            "mm",
            limits.probing_size_mm,
            spheres().map(|own| own.size_error_mm).collect(),
        ),
        (
            "sphere_spacing_mm",
            "sphere-spacing error SD",
            "mm",
            limits.sphere_spacing_mm,
            scans
                .iter()
                .filter_map(|scan| scan.sphere_spacing_error_mm)
                .collect(),
        ),
        (
            "flatness_mm",
            "flatness error F",
            "mm",
            limits.flatness_mm,
            scans.iter().filter_map(|scan| scan.flatness_mm).collect(),
        ),
        (
            "step_mm",
            "step error",
            "mm",
            limits.step_mm,
            steps.copied().collect(),
        ),
        (
            "repeatability_mm",
            "repeatability, standard deviation",
            "mm",
            limits.repeatability_mm,
            repeatability
                .iter()
                .map(|own| own.standard_deviation_mm)
                .collect(),
        ),
        (
            "drift_mm_per_h",
            "drift",
            "mm/h",
            limits.drift_mm_per_h,
            drift.iter().map(|own| own.slope_mm_per_h).collect(),
        ),
    ];
    let mut figures = Vec::new();
    for (key, name, unit, limit, values) in rows {
        let worst = values
            .iter()
            .copied()
            .max_by(|a, b| a.abs().total_cmp(&b.abs()));
        let Some(worst) = worst else {
            if limit.is_some() {
                return Err(missing(key));
            }
            continue;
        };
        figures.push(FigureReport {
            key: key.to_owned(),
            name: name.to_owned(),
            worst,
            unit: unit.to_owned(),
            limit,
            passed: limit.map(|limit| worst.abs() <= limit),
            count: values.len(),
        });
    }
    Ok(figures)
}

fn missing(key: &str) -> String {
    let what = match key {
        "probing_form_mm" | "probing_size_mm" => "no scan shows a sphere",
        "sphere_spacing_mm" => "no scan shows two spheres",
        "flatness_mm" => "no scan shows a plate",
        "step_mm" => "no scan shows a step gauge",
        "repeatability_mm" => "no two scans show the same",
        _ => {
            return format!(
                "limits.{key} is given, but fewer than {FEWEST_FOR_DRIFT} scans show the same, or \
                 the scans' times are not known"
            );
        }
    };
    format!("limits.{key} is given, but {what}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use deliverables::acceptance::SphereReport;

    fn scan(minute: u32, x_mm: f64, size_error_mm: f64) -> AcceptedScan {
        AcceptedScan {
            scan: minute.to_string(),
            started_at: Some(format!("2026-01-01T10:{minute:02}:00Z")),
            spheres: vec![SphereReport {
                centre_mm: [x_mm, 0.0, 0.0],
                size_error_mm,
                size_uncertainty_mm: 0.001,
                form_mm: 0.3,
                deviation_mm: 0.05,
                samples: 1000,
                left_out: 3,
            }],
            sphere_spacing_error_mm: None,
            flatness_mm: None,
            step_errors_mm: Vec::new(),
        }
    }

    fn reference() -> Reference {
        toml::from_str("name = 'ball'\nsphere_diameter_mm = 25.4").unwrap()
    }

    #[test]
    fn scans_of_the_same_place_make_a_series() {
        let scans: Vec<_> = (0..6)
            .map(|k| scan(10 * k, 0.001 * f64::from(k), 0.002 * f64::from(k)))
            .chain([scan(59, 50.0, 0.0)])
            .collect();
        let (repeatability, drift) = series(&scans, &reference());
        let size = &repeatability[0];
        assert_eq!((size.figure.as_str(), size.count), ("size of sphere 1", 6));
        assert!((size.range_mm - 0.01).abs() < 1e-12);
        assert_eq!(drift.len(), 4, "of one sphere: size, x, y and z");
        assert!((drift[0].slope_mm_per_h - 0.012).abs() < 1e-9, "{drift:?}");
    }

    #[test]
    fn limits_are_held_against_the_worst_whatever_its_sign() {
        let scans = [scan(0, 0.0, 0.01), scan(1, 50.0, -0.02)];
        let told = |limit: f64| {
            let limits = Limits {
                probing_size_mm: Some(limit),
                ..Limits::default()
            };
            figures(&scans, &[], &[], &limits).unwrap()[1].clone()
        };
        assert_eq!(
            (told(0.015).worst, told(0.015).passed),
            (-0.02, Some(false))
        );
        assert_eq!(told(0.02).passed, Some(true));
        let limits = Limits {
            flatness_mm: Some(1.0),
            ..Limits::default()
        };
        let error = figures(&scans, &[], &[], &limits).unwrap_err();
        assert!(error.contains("no scan shows a plate"), "{error}");
    }
}
