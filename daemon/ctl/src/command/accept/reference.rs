//! The file that says what the scans show, and the limits.

use std::path::Path;

use serde::Deserialize;

use crate::command::calibrate::{check_diameter, heights_mm, toml_of};
use crate::failure::Failure;

/// What the scans show, and the maximum permissible errors.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Reference {
    /// What it is called, with its certificate.
    pub(super) name: String,
    /// Diameter of each sphere, millimetres.
    pub(super) sphere_diameter_mm: Option<f64>,
    /// Distance of two spheres' centres, millimetres.
    pub(super) sphere_spacing_mm: Option<f64>,
    /// Heights of a step gauge, ascending towards the camera, millimetres.
    pub(super) step_heights_mm: Option<Vec<f64>>,
    /// Whether scans may show a flat plate.
    #[serde(default)]
    pub(super) plate: bool,
    /// The limits.
    #[serde(default)]
    pub(super) limits: Limits,
}

/// Maximum permissible errors, each without sign.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Limits {
    pub(super) probing_form_mm: Option<f64>,
    pub(super) probing_size_mm: Option<f64>,
    pub(super) sphere_spacing_mm: Option<f64>,
    pub(super) flatness_mm: Option<f64>,
    pub(super) step_mm: Option<f64>,
    pub(super) repeatability_mm: Option<f64>,
    pub(super) drift_mm_per_h: Option<f64>,
}

/// Reads the file, and refuses what makes no sense.
pub(super) fn read(path: &Path) -> Result<Reference, Failure> {
    let mut file: Reference = toml_of(path)?;
    let wrong = |what: String| Failure::Failed(format!("{}: {what}", path.display()));
    if let Some(heights) = file.step_heights_mm.take() {
        let heights =
            heights_mm(heights).map_err(|what| wrong(format!("step_heights_mm {what}")))?;
        file.step_heights_mm = Some(heights);
    }
    check(&file).map_err(wrong)?;
    Ok(file)
}

fn check(file: &Reference) -> Result<(), String> {
    if file.sphere_diameter_mm.is_none() && file.step_heights_mm.is_none() && !file.plate {
        return Err(
            "it names no reference: give sphere_diameter_mm, step_heights_mm or plate = true"
                .into(),
        );
    }
    if let Some(diameter_mm) = file.sphere_diameter_mm {
        check_diameter(diameter_mm, "sphere_diameter_mm =")?;
    }
    if let Some(spacing_mm) = file.sphere_spacing_mm {
        let Some(diameter_mm) = file.sphere_diameter_mm else {
            return Err("sphere_spacing_mm needs sphere_diameter_mm".into());
        };
        if !(spacing_mm > diameter_mm && spacing_mm.is_finite()) {
            return Err(format!(
                "sphere_spacing_mm = {spacing_mm}: the spheres would touch"
            ));
        }
    }
    let limits = &file.limits;
    let of_spheres = file.sphere_diameter_mm.is_some();
    for (key, limit, is_measured) in [
        ("probing_form_mm", limits.probing_form_mm, of_spheres),
        ("probing_size_mm", limits.probing_size_mm, of_spheres),
        (
            "sphere_spacing_mm",
            limits.sphere_spacing_mm,
            file.sphere_spacing_mm.is_some(),
        ),
        ("flatness_mm", limits.flatness_mm, file.plate),
        ("step_mm", limits.step_mm, file.step_heights_mm.is_some()),
        ("repeatability_mm", limits.repeatability_mm, true),
        ("drift_mm_per_h", limits.drift_mm_per_h, true),
    ] {
        let Some(limit) = limit else { continue };
        if !(limit > 0.0 && limit.is_finite()) {
            return Err(format!("limits.{key} = {limit}: must be above 0"));
        }
        if !is_measured {
            return Err(format!(
                "limits.{key} is given, but nothing that it is measured on"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> Result<(), String> {
        let file: Reference = toml::from_str(text).map_err(|e| e.message().to_owned())?;
        check(&file)
    }

    #[test]
    fn a_file_that_makes_no_sense_is_refused() {
        let bar = "name = 'bar'\nsphere_diameter_mm = 25.4\nsphere_spacing_mm = 80.0\n";
        assert_eq!(told(bar), Ok(()));
        let limits = "[limits]\nsphere_spacing_mm = 0.05\nrepeatability_mm = 0.01";
        assert_eq!(told(&format!("{bar}{limits}")), Ok(()));
        for (text, why) in [
            ("name = 'x'", "names no reference"),
            ("name = 'x'\nplate = true\nplates = 2", "unknown field"),
            ("name = 'x'\nsphere_diameter_mm = -1.0", "must lie between"),
            (
                "name = 'x'\nsphere_diameter_mm = 25.4\nsphere_spacing_mm = 20.0",
                "touch",
            ),
            (
                "name = 'x'\nplate = true\n[limits]\nflatness_mm = 0.0",
                "above 0",
            ),
            (
                "name = 'x'\nplate = true\n[limits]\nstep_mm = 0.1",
                "nothing that it is measured on",
            ),
        ] {
            let error = told(text).unwrap_err();
            assert!(error.contains(why), "{text}: {error}");
        }
    }
}
