//! Directions that a feature may be given.

use nalgebra::Vector3;

use super::EditError;
use super::size::length_is_first;
use crate::feature::Feature;
use crate::outline::Shape;

/// Sine of the angle to the axis below which a direction is none: the axis is as exact as measured.
const ALONG_AXIS: f64 = 0.02;

/// Turns a feature about its middle.
pub(super) fn turn(
    feature: &mut Feature,
    direction: [f64; 3],
    axes: &[Vector3<f64>; 3],
) -> Result<(), EditError> {
    let (class, id) = (feature.class.clone(), feature.id);
    if feature.lie.is_none() {
        let of = feature.parent.unwrap_or_default();
        return Err(EditError::OfEdge { class, id, of });
    }
    let wanted = Vector3::from(direction);
    let (u, v) = (axes[0].dot(&wanted), axes[1].dot(&wanted));
    let is_first = length_is_first(feature);
    let Shape::Rectangle(own) = &mut feature.outline else {
        return Err(EditError::Round { class, id });
    };
    let length = (u * u + v * v).sqrt();
    if !(length > ALONG_AXIS * wanted.norm() && length.is_finite()) {
        return Err(EditError::Direction { class, id });
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
