//! The part's own frame: the plan in which outlines are measured, and the axis square to it.

use nalgebra::Vector3;

/// A right-handed frame whose third axis points out of the faces that features open into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Its origin in the scan's frame, millimetres.
    pub origin_mm: Vector3<f64>,
    /// Unit vectors of u, v and w in the scan's frame.
    pub axes: [Vector3<f64>; 3],
}

impl Frame {
    /// A frame at this origin whose w is this unit normal (of positive z), and whose u has no y.
    #[must_use]
    pub fn upon(origin_mm: Vector3<f64>, normal: Vector3<f64>) -> Self {
        let u = Vector3::new(normal.z, 0.0, -normal.x).normalize();
        Self {
            origin_mm,
            axes: [u, normal.cross(&u), normal],
        }
    }

    /// A point of the scan's frame in this one, millimetres.
    #[must_use]
    pub fn local(&self, point_mm: Vector3<f64>) -> [f64; 3] {
        let off = point_mm - self.origin_mm;
        self.axes.map(|axis| axis.dot(&off))
    }

    /// A point of this frame in the scan's, millimetres.
    #[must_use]
    pub fn world(&self, [u, v, w]: [f64; 3]) -> Vector3<f64> {
        self.origin_mm + self.axes[0] * u + self.axes[1] * v + self.axes[2] * w
    }

    /// A direction of the plan, by its angle from u towards v, in the scan's frame.
    #[must_use]
    pub fn direction(&self, angle_rad: f64) -> Vector3<f64> {
        let (sin, cos) = libm::sincos(angle_rad);
        self.axes[0] * cos + self.axes[1] * sin
    }
}
