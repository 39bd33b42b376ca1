//! Files that say what is known of references.

use std::fs;
use std::path::Path;

use metrology::calibrate::{Place, References};
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::Args;
use crate::failure::Failure;

/// Standard uncertainty of known places, unless their file says otherwise, millimetres.
const USUAL_UNCERTAINTY_MM: f64 = 0.01;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GaugeFile {
    heights_mm: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlacesFile {
    places_mm: Vec<[f64; 3]>,
    #[serde(default = "usual_uncertainty_mm")]
    uncertainty_mm: f64,
}

fn usual_uncertainty_mm() -> f64 {
    USUAL_UNCERTAINTY_MM
}

/// What the scans show.
pub(super) fn read(args: &Args) -> Result<References, Failure> {
    if let Some(diameter_mm) = args.sphere_diameter_mm {
        check_diameter(diameter_mm, "--sphere-diameter-mm").map_err(Failure::Usage)?;
    }
    Ok(References {
        sphere_diameter_mm: args.sphere_diameter_mm,
        places: args.places.as_deref().map_or(Ok(Vec::new()), places)?,
        step_heights_mm: args.step_gauge.as_deref().map(gauge).transpose()?,
    })
}

/// Refuses what is no diameter of a sphere.
pub(crate) fn check_diameter(diameter_mm: f64, name: &str) -> Result<(), String> {
    if (0.5..=1000.0).contains(&diameter_mm) {
        Ok(())
    } else {
        Err(format!(
            "{name} {diameter_mm}: must lie between 0.5 and 1000"
        ))
    }
}

fn gauge(path: &Path) -> Result<Vec<f64>, Failure> {
    let file: GaugeFile = toml_of(path)?;
    heights_mm(file.heights_mm)
        .map_err(|what| Failure::Failed(format!("{}: heights_mm {what}", path.display())))
}

/// Refuses what are no heights of a step gauge.
pub(crate) fn heights_mm(heights_mm: Vec<f64>) -> Result<Vec<f64>, String> {
    if heights_mm.len() < 2 || heights_mm.iter().any(|height| !height.is_finite()) {
        return Err("must be two heights or more".into());
    }
    if heights_mm.windows(2).any(|pair| pair[1] - pair[0] < 0.5) {
        return Err("must ascend towards the camera, by 0.5 mm at least".into());
    }
    Ok(heights_mm)
}

fn places(path: &Path) -> Result<Vec<Place>, Failure> {
    let file: PlacesFile = toml_of(path)?;
    let uncertainty_mm = file.uncertainty_mm;
    let wrong = |what: &str| Failure::Failed(format!("{}: {what}", path.display()));
    if !(1e-5..=10.0).contains(&uncertainty_mm) {
        return Err(wrong("uncertainty_mm must lie between 0.00001 and 10"));
    }
    if file.places_mm.is_empty() || file.places_mm.iter().flatten().any(|mm| !mm.is_finite()) {
        return Err(wrong("places_mm must be places of three coordinates each"));
    }
    let place = |at_mm| Place {
        at_mm,
        uncertainty_mm,
    };
    Ok(file.places_mm.into_iter().map(place).collect())
}

/// A TOML file of a known form.
pub(crate) fn toml_of<T: DeserializeOwned>(path: &Path) -> Result<T, Failure> {
    let text = fs::read_to_string(path)
        .map_err(|error| Failure::at(format!("cannot read {}", path.display()), &error))?;
    toml::from_str(&text).map_err(|error| {
        let line = error.span().map_or(1, |span| {
            text[..span.start.min(text.len())].lines().count().max(1)
        });
        let file = path.display();
        Failure::Failed(format!("{file}, line {line}: {}", error.message()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_that_are_no_steps_are_refused() {
        assert_eq!(heights_mm(vec![0.0, 10.0]), Ok(vec![0.0, 10.0]));
        for wrong in [vec![], vec![1.0], vec![0.0, f64::NAN], vec![0.0, 5.0, 5.2]] {
            assert!(heights_mm(wrong).is_err());
        }
    }
}
