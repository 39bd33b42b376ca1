//! What follows from a change of a feature: what goes into it or stands on it, and its treated edges.

use crate::candidate::Lie;
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

/// Holes that go through end where the block does, however far that now is from where they begin.
pub(super) fn through(before: &[Feature], features: &mut [Feature]) {
    let Some(bottom_mm) = bottom_mm(features) else {
        return;
    };
    let is_other_block = self::bottom_mm(before) != Some(bottom_mm);
    for (was, own) in before.iter().zip(features) {
        let is_moved = is_other_block || was.heights_mm != own.heights_mm;
        if !(own.through && own.lie == Some(Lie::Hollow) && is_moved) {
            continue;
        }
        own.heights_mm.1 = Some(bottom_mm);
        let depth_mm = own.heights_mm.0 - bottom_mm;
        if let Some(depth) = own.dimensions.iter_mut().find(|d| d.name == "depth") {
            depth.value_mm = depth_mm;
        }
    }
}

/// Height at which the block ends, above the plan, where that is known.
pub(super) fn bottom_mm(features: &[Feature]) -> Option<f64> {
    let block = features.iter().find(|f| f.lie == Some(Lie::Body));
    block.and_then(|block| block.heights_mm.1)
}

/// Whether a treated edge rises from a floor to a wall.
pub(super) fn rises(feature: &Feature) -> bool {
    feature.lie.is_none() && feature.class == Kind::Fillet.as_str()
}
