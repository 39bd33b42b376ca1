//! How well the samples bear out a node's value.

/// What the value at a node rests on. As small as it can be, since every node has one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NodeQuality {
    /// Samples that agree with the surface taken for the node's.
    pub inliers: u16,
    /// Samples that were weighed: those of the node's window. 0 where nothing is known.
    pub samples: u16,
    /// Standard deviation of the inliers about their surface, millimetres.
    pub scale_mm: f32,
    /// Distance in x and y to the nearest inlier, millimetres.
    pub nearest_mm: f32,
}

impl NodeQuality {
    /// Share of the samples weighed that are inliers, 0 to 1; 0 where nothing is known.
    #[must_use]
    pub fn inlier_share(&self) -> f64 {
        if self.samples == 0 {
            return 0.0;
        }
        f64::from(self.inliers) / f64::from(self.samples)
    }
}
