//! What follows from a change of a feature: what goes into it or stands on it, and its treated edges.

use crate::feature::Feature;
use crate::frame::Frame;
use crate::treatment::Kind;

/// Heights that differ by less are one, millimetres.
const SAME_MM: f64 = 1e-6;

/// Moves what depends on a feature that was `before`.
pub(super) fn follow(features: &mut [Feature], before: &Feature, frame: &Frame) {
    let Some(after) = features.iter().find(|f| f.id == before.id).cloned() else {
        return;
    };
    let moves = [
        (before.heights_mm.0, after.heights_mm.0),
        (
            before.heights_mm.1.unwrap_or(f64::NAN),
            after.heights_mm.1.unwrap_or(f64::NAN),
        ),
    ];
    let dependants: Vec<usize> = (0..features.len())
        .filter(|&k| features[k].parent == Some(before.id))
        .collect();
    for index in dependants {
        let was = features[index].clone();
        let own = &mut features[index];
        if own.lie.is_none() {
            own.outline = after.outline;
            own.direction = after.direction;
        }
        let on = moves
            .iter()
            .filter(|(from, to)| !from.is_nan() && !to.is_nan())
            .min_by(|a, b| {
                let off = |level: f64| (level - own.heights_mm.0).abs();
                off(a.0).total_cmp(&off(b.0))
            });
        let way = on.map_or(0.0, |(from, to)| to - from);
        if way.abs() > SAME_MM {
            own.heights_mm.0 += way;
            own.heights_mm.1 = own.heights_mm.1.map(|end| end + way);
            own.centre_mm += frame.axes[2] * way;
        }
        if own.lie.is_some() && was != *own {
            follow(features, &was, frame);
        }
    }
}

/// Whether a treated edge rises from a floor to a wall.
pub(super) fn rises(feature: &Feature) -> bool {
    feature.lie.is_none() && feature.class == Kind::Fillet.as_str()
}
