//! Types that a feature may be given.

use super::EditError;
use crate::candidate::Lie;
use crate::class::Class;
use crate::feature::{Dimension, Feature};
use crate::treatment::Kind;

/// Gives a feature another type: one of the classes that goes into the part, or stands on it, as it
/// does; of a treated edge, chamfer for round and the other way round.
pub(super) fn rename(
    features: &mut [Feature],
    index: usize,
    wanted: &str,
    classes: &[String],
) -> Result<(), EditError> {
    let feature = &mut features[index];
    let refused = |why: String| EditError::Class {
        class: feature.class.clone(),
        id: feature.id,
        wanted: wanted.to_owned(),
        why,
    };
    let Some(lie) = feature.lie else {
        let kinds = [Kind::Chamfer, Kind::Round].map(Kind::as_str);
        let is_one = |name: &str| kinds.contains(&name);
        return match (is_one(&feature.class), is_one(wanted)) {
            _ if feature.class == wanted => Ok(()),
            (true, true) => {
                reshape(feature, wanted);
                Ok(())
            }
            (true, false) => Err(refused(format!("an edge is one of {}", kinds.join(", ")))),
            (false, _) => Err(refused("there is no other such edge".to_owned())),
        };
    };
    if lie == Lie::Body {
        return match wanted == Class::Block.as_str() {
            true => Ok(()),
            false => Err(refused(
                "it is the block that the others are cut into and stand on".to_owned(),
            )),
        };
    }
    let can: Vec<&str> = classes
        .iter()
        .map(String::as_str)
        .filter(|name| suits(name, lie))
        .collect();
    if !can.contains(&wanted) {
        let lies = match lie {
            Lie::Hollow => "goes into the part",
            Lie::Raised | Lie::Body => "stands on it",
        };
        return Err(refused(format!("what {lies} is one of {}", can.join(", "))));
    }
    wanted.clone_into(&mut feature.class);
    feature.score = 1.0;
    Ok(())
}

/// Whether what lies so can be of a class; of those that users have taught, nobody knows better.
fn suits(name: &str, lie: Lie) -> bool {
    match Class::named(name) {
        None => true,
        // The body alone; and rings and cones are features of their own.
        Some(Class::Block | Class::SteppedHole | Class::CountersunkHole) => false,
        Some(Class::Boss) => lie == Lie::Raised,
        Some(Class::Pocket | Class::Step | Class::Slot | Class::Hole) => lie == Lie::Hollow,
    }
}

/// A chamfer as wide as a round, or a round as wide as a chamfer.
fn reshape(feature: &mut Feature, wanted: &str) {
    let is_round = wanted == Kind::Round.as_str();
    let Some(width) = feature.dimensions.first().copied() else {
        return;
    };
    feature.dimensions = vec![Dimension {
        name: if is_round { "radius" } else { "width" },
        ..width
    }];
    let (level_mm, _) = feature.heights_mm;
    feature.heights_mm.1 = Some(level_mm - width.value_mm);
    wanted.clone_into(&mut feature.class);
    feature.score = 1.0;
}
