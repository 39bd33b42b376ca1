//! Rays of a column: from the camera, or along z where that is not known.

/// A ray's place in its column: the tangent of its angle, or y where rays are parallel.
#[must_use]
pub fn ray(camera_mm: Option<[f64; 2]>, y_mm: f64, z_mm: f64) -> f64 {
    match camera_mm {
        Some([y, z]) => (y_mm - y) / (z - z_mm),
        None => y_mm,
    }
}

/// Where a ray is at a height, y in millimetres.
#[must_use]
pub fn passes(camera_mm: Option<[f64; 2]>, ray: f64, z_mm: f64) -> f64 {
    match camera_mm {
        Some([y, z]) => y + ray * (z - z_mm),
        None => ray,
    }
}
