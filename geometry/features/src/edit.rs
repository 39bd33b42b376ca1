//! What the user knows better: type, sizes and direction of a feature, and what follows from them.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::arrangement::patterns;
use crate::candidate::Lie;
use crate::feature::{Bottom, Dimension, Feature};
use crate::outline::Shape;
use crate::recognise::Recognition;

/// One change.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Edit {
    /// Number of the feature.
    pub id: u32,
    /// Its type, if that is another.
    pub class: Option<String>,
    /// Its dimensions that are others, millimetres.
    pub dimensions_mm: BTreeMap<String, f64>,
    /// Its direction, if that is another; along its length, in the scan's frame.
    pub direction: Option<[f64; 3]>,
}

/// A change that cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EditError {
    /// There is no such feature.
    #[error("there is no feature {id}; there are 0 to {last}")]
    NoFeature {
        /// The number asked for.
        id: u32,
        /// The last there is.
        last: u32,
    },
    /// It has no such dimension.
    #[error("{class} {id} has no {name}; it has {has}")]
    NoDimension {
        /// Its type.
        class: String,
        /// Its number.
        id: u32,
        /// The dimension asked for.
        name: String,
        /// Those that it has.
        has: String,
    },
    /// A length that is none.
    #[error("{class} {id}: {name} is {value_mm} mm; it must be above 0 and finite")]
    Length {
        /// Its type.
        class: String,
        /// Its number.
        id: u32,
        /// The dimension.
        name: String,
        /// As given.
        value_mm: f64,
    },
    /// A direction that is none in the plan.
    #[error(
        "{class} {id}: a direction must be a vector of three numbers that is not along the axis"
    )]
    Direction {
        /// Its type.
        class: String,
        /// Its number.
        id: u32,
    },
}

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

/// Makes changes; outlines, heights and patterns follow. Sizes are taken about the middle, depths
/// and heights from the face that the feature goes into or stands on; what is given has no
/// uncertainty. Nothing is changed where one change cannot be made.
///
/// # Errors
/// [`EditError`].
pub fn edit(recognition: &mut Recognition, edits: &[Edit]) -> Result<(), EditError> {
    let mut changed = recognition.features.clone();
    for own in edits {
        let last = changed.iter().map(|f| f.id).max().unwrap_or(0);
        let feature = changed.iter_mut().find(|f| f.id == own.id);
        let feature = feature.ok_or(EditError::NoFeature { id: own.id, last })?;
        if let Some(direction) = own.direction {
            turn(feature, direction, &recognition.frame.axes)?;
        }
        for (name, value_mm) in &own.dimensions_mm {
            size(feature, name, *value_mm)?;
        }
        if let Some(class) = &own.class {
            feature.class.clone_from(class);
            feature.score = 1.0;
        }
        feature.warnings.push("edited by the user".to_owned());
    }
    recognition.features = changed;
    recognition.patterns = patterns(&recognition.features);
    Ok(())
}

fn size(feature: &mut Feature, name: &str, value_mm: f64) -> Result<(), EditError> {
    let (class, id) = (feature.class.clone(), feature.id);
    if !(value_mm > 0.0 && value_mm.is_finite()) {
        return Err(EditError::Length {
            class,
            id,
            name: name.to_owned(),
            value_mm,
        });
    }
    // What was not seen has no dimension yet.
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
                class,
                id,
                name: name.to_owned(),
                has: has.join(", "),
            });
        }
    }
    let along = length_is_first(feature);
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
            own.corner_mm = value_mm.min(0.5 * a.min(b));
        }
        (_, "depth" | "height") => {
            let upwards = matches!(feature.lie, Some(Lie::Raised));
            let base = feature.heights_mm.0;
            feature.heights_mm.1 = Some(base + if upwards { value_mm } else { -value_mm });
            feature.through = false;
            if feature.bottom == Bottom::Unseen {
                feature.bottom = Bottom::Level;
            }
        }
        _ => {}
    }
    Ok(())
}

/// Whether the length runs along a rectangle's first axis.
fn length_is_first(feature: &Feature) -> bool {
    let Shape::Rectangle(own) = feature.outline else {
        return true;
    };
    let length = feature.dimension("length").map_or(0.0, |d| d.value_mm);
    let [first, second] = own.sizes_mm();
    (first - length).abs() <= (second - length).abs()
}

/// Turns a feature about its middle.
fn turn(
    feature: &mut Feature,
    direction: [f64; 3],
    axes: &[Vector3<f64>; 3],
) -> Result<(), EditError> {
    let wanted = Vector3::from(direction);
    let (u, v) = (axes[0].dot(&wanted), axes[1].dot(&wanted));
    let is_first = length_is_first(feature);
    let Shape::Rectangle(own) = &mut feature.outline else {
        return Ok(());
    };
    let length = (u * u + v * v).sqrt();
    if !(length > 1e-9 && length.is_finite()) {
        return Err(EditError::Direction {
            class: feature.class.clone(),
            id: feature.id,
        });
    }
    let middle = own.middle_mm();
    let sizes = own.sizes_mm();
    let quarter = if is_first {
        0.0
    } else {
        core::f64::consts::FRAC_PI_2
    };
    own.angle_rad = libm::atan2(v, u) - quarter;
    let [a, b] = own.along(middle);
    own.first_mm = [a - 0.5 * sizes[0], a + 0.5 * sizes[0]];
    own.second_mm = [b - 0.5 * sizes[1], b + 0.5 * sizes[1]];
    feature.direction = Some((axes[0] * u + axes[1] * v) / length);
    Ok(())
}
