//! A B-spline surface skinned over stacked cross-sections, with as few control points as a tolerance
//! allows.
//!
//! Jo, Kwon & Han, "A NURBS approximation surface representing human body by using knot removal",
//! fit each section by least squares with as many control points as its tolerance takes, bring all
//! sections to common knots, and remove those again that are not needed: [`Method::Jo`].
//! [`Method::Relief`] asks for the common knots at once: it looks for the places of as few of them as
//! hold all data of all sections within the tolerance, closes sections smoothly over their seam, and
//! takes fewer rows of control points than there are sections where these tell the same.

mod around;
mod basis;
mod crossing;
mod cut;
mod error;
mod jo;
mod measure;
mod minimal;
mod section;
mod settings;
mod space;
mod spread;
mod stack;
mod surface;
#[cfg(test)]
mod testing;

use range_image::Monitor;

pub use cut::{Cut, cut};
pub use error::SkinError;
pub use jo::SectionCurves;
pub use measure::Deviation;
pub use section::Section;
pub use settings::{Method, Settings, SettingsError};
pub use surface::{Counts, Skin, Warning};

/// Skins sections, in the order of their stack.
///
/// # Errors
/// [`SkinError`], which names the section that is at fault.
pub fn skin(
    sections: &[Section],
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Skin, SkinError> {
    settings.check()?;
    let stack = stack::Stack::of(sections, settings)?;
    monitor.check()?;
    match settings.method {
        Method::Jo => jo::skin(stack, settings, monitor),
        Method::Relief => surface::skin(stack, settings, monitor),
    }
}

/// The curves that [`Method::Jo`] has of each section before it makes a surface of them, in the
/// order of their stack.
///
/// # Errors
/// [`SkinError`], which names the section that is at fault.
pub fn section_curves(
    sections: &[Section],
    tolerance_mm: f64,
    monitor: &dyn Monitor,
) -> Result<Vec<SectionCurves>, SkinError> {
    let settings = Settings {
        method: Method::Jo,
        ..Settings::new(tolerance_mm)
    };
    settings.check()?;
    jo::curves(
        stack::Stack::of(sections, &settings)?,
        tolerance_mm,
        monitor,
    )
}
