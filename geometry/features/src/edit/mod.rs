//! What the user knows better: type, sizes and direction of a feature, and what follows from them.

mod class;
mod error;
mod follow;
mod size;
mod turn;

use std::collections::{BTreeMap, BTreeSet};

use crate::arrangement::patterns;
use crate::recognise::Recognition;

pub use error::EditError;

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

impl Edit {
    fn is_empty(&self) -> bool {
        self.class.is_none() && self.dimensions_mm.is_empty() && self.direction.is_none()
    }
}

/// Makes changes; outlines, heights, what stands on a feature or goes into it, treated edges and
/// patterns follow. `classes` are those that a feature may be, as the network knows them.
///
/// Sizes are taken about the middle, depths and heights from the face that the feature goes into or
/// stands on; what is given has no uncertainty. What goes into a floor that moves keeps its own depth
/// unless it goes through, a countersink its diameter, and a chamfer that is made wider its slant. Nothing is changed where one change cannot be made.
///
/// # Errors
/// [`EditError`].
pub fn edit(
    recognition: &mut Recognition,
    edits: &[Edit],
    classes: &[String],
) -> Result<(), EditError> {
    let mut changed = recognition.features.clone();
    let mut seen = BTreeSet::new();
    for own in edits {
        let last = changed.iter().map(|f| f.id).max().unwrap_or(0);
        let index = changed.iter().position(|f| f.id == own.id);
        let index = index.ok_or(EditError::NoFeature { id: own.id, last })?;
        if !seen.insert(own.id) {
            return Err(EditError::Twice { id: own.id });
        }
        if own.is_empty() {
            return Err(EditError::Nothing { id: own.id });
        }
        let before = changed[index].clone();
        if let Some(class) = &own.class {
            class::rename(&mut changed, index, class, classes)?;
        }
        if let Some(direction) = own.direction {
            turn::turn(&mut changed[index], direction, &recognition.frame.axes)?;
        }
        for (name, value_mm) in &own.dimensions_mm {
            size::size(&mut changed[index], name, *value_mm)?;
        }
        size::order(&mut changed[index], &recognition.frame);
        changed[index].is_edited = true;
        follow::follow(&mut changed, &before, &recognition.frame);
    }
    follow::through(&recognition.features, &mut changed);
    size::check(&recognition.features, &changed, edits)?;
    recognition.features = changed;
    recognition.patterns = patterns(&recognition.features);
    Ok(())
}
