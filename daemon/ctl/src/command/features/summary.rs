//! Features told to people.

use deliverables::features::FeatureEntry;

use super::run::Recognised;
use crate::output;

pub(super) fn told(found: &Recognised) -> String {
    let lines = found.file.features.iter().map(line);
    let heading = [
        "ID",
        "ON",
        "TYPE",
        "SCORE",
        "CENTER X",
        "Y",
        "Z",
        "DIMENSIONS, MM (STANDARD UNCERTAINTY)",
    ];
    let mut told = vec![output::table(&heading, &[0, 1, 3, 4, 5, 6], lines)];
    told.push(String::new());
    for feature in &found.file.features {
        for warning in &feature.warnings {
            told.push(format!("{} {}: {warning}", feature.class, feature.id));
        }
    }
    told.push(format!("written to   {}", found.output.display()));
    if let Some(step) = &found.step {
        told.push(format!("solid        {}", step.display()));
    }
    if let Some(picture) = &found.picture {
        told.push(format!("picture      {}", picture.display()));
    }
    told.push(format!("time         {:.2} s", found.seconds));
    told.join("\n")
}

fn line(feature: &FeatureEntry) -> Vec<String> {
    let mut sizes: Vec<String> = feature
        .dimensions_mm
        .iter()
        .map(|(name, value)| {
            let sigma = feature
                .sigma_mm
                .dimensions
                .get(name)
                .copied()
                .unwrap_or_default();
            format!("{} {value:.3} ({sigma:.3})", name.replace('_', " "))
        })
        .collect();
    if feature.through {
        sizes.push("through".to_owned());
    }
    let [x, y, z] = feature.center_mm.map(|value| format!("{value:.3}"));
    vec![
        feature.id.to_string(),
        feature.parent.map(|p| p.to_string()).unwrap_or_default(),
        feature.class.replace('_', " "),
        format!("{:.2}", feature.score),
        x,
        y,
        z,
        sizes.join(", "),
    ]
}
