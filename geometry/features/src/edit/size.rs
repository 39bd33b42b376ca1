//! Sizes that a feature may be given.

use super::follow::{bottom_mm, rises};
use super::{Edit, EditError};
use crate::candidate::Lie;
use crate::class::Class;
use crate::feature::{Bottom, Dimension, Feature};
use crate::frame::Frame;
use crate::measure::length_axis;
use crate::outline::Shape;

/// Dimensions that features have.
const NAMES: [&str; 7] = [
    "corner_radius",
    "depth",
    "diameter",
    "height",
    "length",
    "radius",
    "width",
];

/// Gives a feature a dimension, and its outline and heights what follows from it.
pub(super) fn size(feature: &mut Feature, name: &str, value_mm: f64) -> Result<(), EditError> {
    if !(value_mm > 0.0 && value_mm.is_finite()) {
        let must = "it must be above 0 and finite".to_owned();
        return Err(length(feature, name, value_mm, must));
    }
    // Of the outline as it was.
    let along = length_is_first(feature);
    let before_mm = feature.dimension(name).map(|own| own.value_mm);
    set(feature, name, value_mm)?;
    if feature.lie.is_none() {
        edge(feature, name, value_mm, before_mm.unwrap_or(value_mm));
        return Ok(());
    }
    match (&mut feature.outline, name) {
        (Shape::Circle(circle), "diameter") => circle.radius_mm = 0.5 * value_mm,
        (Shape::Rectangle(own), "length" | "width") => {
            let sides = if (name == "length") == along {
                &mut own.first_mm
            } else {
                &mut own.second_mm
            };
            let middle = 0.5 * (sides[0] + sides[1]);
            *sides = [middle - 0.5 * value_mm, middle + 0.5 * value_mm];
            let [a, b] = own.sizes_mm();
            own.corner_mm = own.corner_mm.min(0.5 * a.min(b));
        }
        (Shape::Rectangle(own), "corner_radius") => {
            let [a, b] = own.sizes_mm();
            let most = 0.5 * a.min(b);
            if value_mm > most {
                let must = format!("half of the lesser side, {most:.3} mm, is the most");
                return Err(length(feature, name, value_mm, must));
            }
            own.corner_mm = value_mm;
        }
        (_, "depth" | "height") => {
            let upwards = matches!(feature.lie, Some(Lie::Raised));
            let base = feature.heights_mm.0;
            feature.heights_mm.1 = Some(base + if upwards { value_mm } else { -value_mm });
            feature.through = false;
            if feature.bottom == Bottom::Unseen {
                feature.bottom = Bottom::Level;
            }
            // That is known now.
            let missing = format!("{name} not measured");
            feature.warnings.retain(|told| !told.starts_with(&missing));
        }
        _ => {}
    }
    Ok(())
}

/// Writes down a dimension: one that it has, or one that was not seen.
fn set(feature: &mut Feature, name: &str, value_mm: f64) -> Result<(), EditError> {
    let unseen = match feature.lie {
        Some(Lie::Hollow) => "depth",
        Some(Lie::Body) => "height",
        Some(Lie::Raised) | None => "",
    };
    let known = feature.dimensions.iter_mut().find(|d| d.name == name);
    match (known, NAMES.iter().find(|own| **own == name)) {
        (Some(dimension), _) => {
            dimension.value_mm = value_mm;
            dimension.sigma_mm = 0.0;
        }
        (None, Some(name)) if *name == unseen => feature.dimensions.push(Dimension {
            name,
            value_mm,
            sigma_mm: 0.0,
        }),
        _ => {
            let has: Vec<&str> = feature.dimensions.iter().map(|d| d.name).collect();
            return Err(EditError::NoDimension {
                class: feature.class.clone(),
                id: feature.id,
                name: name.to_owned(),
                has: has.join(", "),
            });
        }
    }
    Ok(())
}

/// Of a treated edge, how far it reaches off its face. A chamfer that is made wider slants as before.
fn edge(feature: &mut Feature, name: &str, value_mm: f64, before_mm: f64) {
    let (level_mm, Some(end_mm)) = feature.heights_mm else {
        return;
    };
    let rise_mm = match name {
        "radius" | "depth" => value_mm,
        "width" => (level_mm - end_mm).abs() * value_mm / before_mm,
        _ => return,
    };
    let way = if rises(feature) { rise_mm } else { -rise_mm };
    feature.heights_mm.1 = Some(level_mm + way);
}

/// Lets the length be that along the walls of what runs out, else the longer side, as it is measured.
pub(super) fn order(feature: &mut Feature, frame: &Frame) {
    let Shape::Rectangle(own) = feature.outline else {
        return;
    };
    let long = length_axis(&own, Class::named(&feature.class));
    if length_is_first(feature) != (long == 0) {
        for own in &mut feature.dimensions {
            own.name = match own.name {
                "length" => "width",
                "width" => "length",
                other => other,
            };
        }
        feature.dimensions.sort_by_key(|own| own.name);
    }
    let angle_rad = own.angle_rad + long as f64 * core::f64::consts::FRAC_PI_2;
    feature.direction = feature.direction.map(|_| frame.direction(angle_rad));
}

/// Whether the told length is that along a rectangle's first axis.
pub(super) fn length_is_first(feature: &Feature) -> bool {
    let Shape::Rectangle(own) = feature.outline else {
        return true;
    };
    let length = feature.dimension("length").map_or(0.0, |d| d.value_mm);
    let [first, second] = own.sizes_mm();
    (first - length).abs() <= (second - length).abs()
}

/// Whether the part has room for what was given, and for what follows from it.
pub(super) fn check(
    before: &[Feature],
    features: &[Feature],
    edits: &[Edit],
) -> Result<(), EditError> {
    let block = features.iter().find(|f| f.lie == Some(Lie::Body));
    let across_mm = block.map_or(f64::INFINITY, |block| {
        let (low, high) = block.outline.extent();
        let [a, b] = [high[0] - low[0], high[1] - low[1]];
        (a * a + b * b).sqrt()
    });
    for own in edits {
        let Some(feature) = features.iter().find(|f| f.id == own.id) else {
            continue;
        };
        let is_across = |name: &str| !matches!(name, "depth" | "height");
        for (name, value_mm) in own.dimensions_mm.iter().filter(|(name, _)| is_across(name)) {
            if *value_mm > across_mm && feature.lie != Some(Lie::Body) {
                let must = format!("the block is {across_mm:.3} mm across");
                return Err(length(feature, name, *value_mm, must));
            }
        }
        countersink(features, feature)?;
    }
    let end_mm = bottom_mm(features);
    let is_other_block = bottom_mm(before) != end_mm;
    let hollows = before.iter().zip(features).filter(|(was, is)| {
        is.lie == Some(Lie::Hollow)
            && !is.through
            && (is_other_block || was.heights_mm != is.heights_mm)
    });
    for (_, feature) in hollows {
        if let Some((end_mm, floor_mm)) = end_mm.zip(feature.heights_mm.1)
            && floor_mm < end_mm
        {
            let (base_mm, depth_mm) = (feature.heights_mm.0, feature.heights_mm.0 - floor_mm);
            let left_mm = base_mm - end_mm;
            let must = format!("the block ends {left_mm:.3} mm below the face that it goes into");
            return Err(length(feature, "depth", depth_mm, must));
        }
    }
    Ok(())
}

/// A countersink is wider than its hole.
fn countersink(features: &[Feature], feature: &Feature) -> Result<(), EditError> {
    let own = features
        .iter()
        .filter(|f| f.lie.is_none() && (f.id == feature.id || f.parent == Some(feature.id)));
    for cone in own {
        let (Some(diameter), Shape::Circle(hole)) = (cone.dimension("diameter"), cone.outline)
        else {
            continue;
        };
        if diameter.value_mm <= 2.0 * hole.radius_mm {
            let must = format!("its hole is {:.3} mm wide", 2.0 * hole.radius_mm);
            return Err(length(cone, "diameter", diameter.value_mm, must));
        }
    }
    Ok(())
}

fn length(feature: &Feature, name: &str, value_mm: f64, must: String) -> EditError {
    EditError::Length {
        class: feature.class.clone(),
        id: feature.id,
        name: name.to_owned(),
        value_mm,
        must,
    }
}
