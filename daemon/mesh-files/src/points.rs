//! Points as they come.

use std::io;

use crate::error::MeshFileError;

/// A measured point, part frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Millimetres.
    pub place_mm: [f64; 3],
    /// Strength of the returned light, 0 to 255; 255 where the source gives none.
    pub intensity: u8,
}

/// A source of points that can be gone through more than once.
pub trait Points {
    /// Hands over every point, in the same order each time.
    ///
    /// # Errors
    /// What the source reports, or `take` does.
    fn visit(&self, take: &mut dyn FnMut(Point) -> io::Result<()>) -> io::Result<()>;
}

impl Points for [Point] {
    fn visit(&self, take: &mut dyn FnMut(Point) -> io::Result<()>) -> io::Result<()> {
        self.iter().try_for_each(|point| take(*point))
    }
}

/// What must be known before the first point is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Census {
    pub(crate) count: usize,
    /// The source gives intensities.
    pub(crate) has_intensity: bool,
}

impl Census {
    pub(crate) fn of(points: &(impl Points + ?Sized)) -> Result<Self, MeshFileError> {
        let mut census = Self {
            count: 0,
            has_intensity: false,
        };
        let counted = points.visit(&mut |point| {
            census.count += 1;
            census.has_intensity |= point.intensity != u8::MAX;
            Ok(())
        });
        counted.map_err(MeshFileError::Points)?;
        Ok(census)
    }
}
