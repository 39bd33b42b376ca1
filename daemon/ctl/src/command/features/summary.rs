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
    if let Some(reduced) = &found.reduced {
        told.push(format!(
            "points       {}: {} of {}, {} after vector sampling; {} sharp and {} smooth edge points",
            reduced.output.display(),
            reduced.left,
            reduced.points,
            reduced.after_vector_sampling,
            reduced.sharp_edge_points,
            reduced.smooth_edge_points,
        ));
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
            let name = name.replace('_', " ");
            // What users gave has none.
            match feature.edited && sigma == 0.0 {
                true => format!("{name} {value:.3} (given)"),
                false => format!("{name} {value:.3} ({sigma:.3})"),
            }
        })
        .collect();
    if let Some(floor) = &feature.floor {
        let of = match feature.parent.is_some() && feature.dimensions_mm.contains_key("height") {
            true => "top",
            false => "floor",
        };
        let (kind, radius, sigma) = (floor.kind, floor.radius_mm, floor.sigma_mm);
        sizes.push(format!("{of} a {kind} of radius {radius:.3} ({sigma:.3})"));
    }
    if feature.through {
        sizes.push("through".to_owned());
    }
    if feature.edited {
        sizes.push("edited".to_owned());
    }
    if let Some(thread) = feature.thread_guess {
        sizes.push(format!("tapped {thread}? (a guess)"));
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
