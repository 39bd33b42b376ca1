//! A calibration told to people.

use super::run::Told;
use crate::output;

const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// A value in the unit that people read, with decimals for that.
fn shown(value: f64, uncertainty: f64, unit: &str) -> (String, String) {
    let (factor, name) = match unit {
        "rad" => (DEGREES, "deg"),
        "1" => (100.0, "%"),
        other => (1.0, other),
    };
    let decimals = (1.0 - (uncertainty * factor).log10().floor()).clamp(0.0, 6.0) as usize;
    (
        format!("{:+.decimals$} {name}", value * factor),
        format!("{:.decimals$} {name}", uncertainty * factor),
    )
}

/// The calibration in lines.
pub(super) fn told(told: &Told) -> String {
    let file = &told.calibration;
    let mut lines = vec![
        output::table(
            &["DEVIATION", "VALUE", "UNCERTAINTY"],
            &[1, 2],
            told.determined.iter().map(|own| {
                let (value, uncertainty) = shown(own.value, own.uncertainty, own.unit);
                vec![own.deviation.to_owned(), value, uncertainty]
            }),
        ),
        String::new(),
    ];
    for own in &told.insignificant {
        let (value, uncertainty) = shown(own.value, own.uncertainty, own.unit);
        lines.push(format!(
            "zero         {}: {value} +- {uncertainty} is not significant",
            own.deviation
        ));
    }
    let mut by_advice: Vec<(&str, Vec<String>)> = Vec::new();
    for own in &told.undetermined {
        let name = match own.uncertainty {
            Some(uncertainty) => {
                let (_, known) = shown(0.0, uncertainty, own.unit);
                format!("{} (to {known})", own.deviation)
            }
            None => own.deviation.to_owned(),
        };
        match by_advice
            .iter_mut()
            .find(|(advice, _)| *advice == own.advice)
        {
            Some((_, names)) => names.push(name),
            None => by_advice.push((own.advice, vec![name])),
        }
    }
    for (advice, names) in by_advice {
        lines.push(format!("not told     {}:", names.join(", ")));
        lines.push(format!("             {advice}"));
    }
    for pair in &told.correlated {
        let [a, b] = pair.deviations;
        lines.push(format!(
            "correlated   {a} and {b}, {:+.3}: hardly told apart, but well together",
            pair.coefficient
        ));
    }
    lines.push(String::new());
    lines.push(output::table(
        &[
            "SCAN",
            "REFERENCE",
            "X MM",
            "Y MM",
            "Z MM",
            "SAMPLES",
            "BEFORE MM",
            "AFTER MM",
            "+- MM",
        ],
        &[2, 3, 4, 5, 6, 7, 8],
        told.references.iter().map(|own| {
            let at = |axis: usize| {
                own.centre_mm
                    .and_then(|centre| centre.get(axis).copied())
                    .map_or_else(|| "-".into(), |mm| format!("{mm:.1}"))
            };
            vec![
                own.scan.clone(),
                own.kind.to_owned(),
                at(0),
                at(1),
                at(2),
                own.samples.to_string(),
                format!("{:+.4}", own.error_before_mm),
                format!("{:+.4}", own.error_after_mm),
                own.uncertainty_mm
                    .map_or_else(|| "-".into(), |mm| format!("{mm:.4}")),
            ]
        }),
    ));
    lines.push(String::new());
    lines.push(format!(
        "residual     {:.4} mm rms without the correction, {:.4} mm with it, of {} samples",
        file.residual_before_mm, file.residual_after_mm, file.samples
    ));
    lines.push(format!("condition    {:.1}", told.condition));
    lines.push(format!(
        "scanner      {}, serial number {}",
        file.scanner_model, file.scanner_serial
    ));
    lines.push(match &told.written {
        Some(path) => format!(
            "written      {path}: name it as `calibration` in the scanner's section of the \
             configuration"
        ),
        None => "written      nothing: give -o FILE.toml for a file".to_owned(),
    });
    lines.join("\n")
}
