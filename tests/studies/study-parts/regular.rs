//! The regularities that shapes were given, and whether they are true.

use std::collections::BTreeMap;
use std::fmt::Write;

use pipeline::{Regularity, RegularityKind};
use shapes::Family;

use crate::measure::Measured;
use crate::surface::TrueSurface;

/// What is as near as this, radians and millimetres, is so in truth.
const EXACT_RAD: f64 = 1e-4;
const EXACT_MM: f64 = 1e-3;

/// How often one kind was accepted and refused.
#[derive(Default)]
struct Tally {
    accepted: usize,
    is_true: usize,
    is_false: usize,
    refused: usize,
}

/// What was accepted and refused, by kind.
pub(crate) fn regularities(parts: &[Measured]) -> String {
    let mut kinds: BTreeMap<&str, Tally> = BTreeMap::new();
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    let mut tied = 0;
    for part in parts {
        let is_adjusted = |kind: &&pipeline::RegionKind| kind.adjusted.is_some();
        tied += part.outcome.kinds.iter().filter(is_adjusted).count();
        let Some(found) = &part.outcome.regularities else {
            continue;
        };
        for own in &found.accepted {
            let tally = kinds.entry(own.kind.as_str()).or_default();
            tally.accepted += 1;
            match is_true(own, &part.true_of_region) {
                Some(true) => tally.is_true += 1,
                Some(false) => tally.is_false += 1,
                None => {}
            }
        }
        for own in &found.refused {
            kinds.entry(own.kind.as_str()).or_default().refused += 1;
            *reasons.entry(own.reason.as_str()).or_default() += 1;
        }
    }
    let mut out = format!(
        "## Regularities\n\n{tied} regions were adjusted. A regularity is true where the faces \
         that the regions share the most nodes with have it.\n\n| kind | accepted | true | false | \
         refused |\n| --- | ---: | ---: | ---: | ---: |\n"
    );
    for (kind, tally) in kinds {
        let _ = writeln!(
            out,
            "| {kind} | {} | {} | {} | {} |",
            tally.accepted, tally.is_true, tally.is_false, tally.refused
        );
    }
    out += "\n| refused because | how many |\n| --- | ---: |\n";
    for (reason, count) in reasons {
        let _ = writeln!(out, "| {reason} | {count} |");
    }
    out
}

/// Whether two true faces have a regularity; `None` where it is not one of two faces that are
/// looked at here, or a region stands for none.
fn is_true(own: &Regularity, faces: &BTreeMap<u16, TrueSurface>) -> Option<bool> {
    let [first, second] = own.labels[..] else {
        return None;
    };
    let (a, b) = (faces.get(&first)?, faces.get(&second)?);
    let along = a.direction.cross(&b.direction).norm() <= EXACT_RAD;
    let square = a.direction.dot(&b.direction).abs() <= EXACT_RAD;
    // A plane lies along an axis that its normal is square to.
    let is_mixed = (a.family == Family::Plane) != (b.family == Family::Plane);
    let apart = b.place_mm - a.place_mm;
    let off_axis = |axis: &TrueSurface| apart.cross(&axis.direction).norm();
    Some(match own.kind {
        RegularityKind::Parallel => (along && !is_mixed) || (square && is_mixed),
        RegularityKind::Perpendicular => (square && !is_mixed) || (along && is_mixed),
        RegularityKind::Coplanar => along && apart.dot(&a.direction).abs() <= EXACT_MM,
        RegularityKind::Coaxial => along && off_axis(a) <= EXACT_MM,
        RegularityKind::OnAxis => off_axis(b) <= EXACT_MM,
        RegularityKind::Concentric => apart.norm() <= EXACT_MM,
        RegularityKind::EqualHalfAngles => (a.half_angle_rad - b.half_angle_rad).abs() <= EXACT_RAD,
        RegularityKind::EqualRadii => {
            let of = |face: &TrueSurface| [face.radius_mm, face.tube_mm];
            let pairs = of(a).into_iter().flat_map(|r| of(b).map(|s| (r, s)));
            pairs
                .into_iter()
                .any(|(r, s)| r > 0.0 && (r - s).abs() <= EXACT_MM)
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::tests::surface;

    fn regularity(kind: RegularityKind) -> Regularity {
        Regularity {
            kind,
            labels: vec![3, 5],
            target: None,
            off_rad: None,
            off_mm: None,
            deviations: 1.0,
            freedom: 1,
            p: 0.3,
            chance: 1e-3,
            turned_rad: 0.0,
            moved_mm: 0.0,
        }
    }

    #[test]
    fn what_faces_have_is_true() {
        let (plane, axis) = (surface(Family::Plane), surface(Family::Cylinder));
        let mut faces = BTreeMap::from([(3, plane), (5, axis)]);
        let told = |kind, faces: &_| is_true(&regularity(kind), faces);
        faces.get_mut(&5).unwrap().direction = plane.direction;
        assert_eq!(told(RegularityKind::Perpendicular, &faces), Some(true));
        assert_eq!(told(RegularityKind::Parallel, &faces), Some(false));
        faces.insert(3, axis);
        faces.get_mut(&3).unwrap().direction = plane.direction;
        assert_eq!(told(RegularityKind::Coaxial, &faces), Some(true));
        assert_eq!(told(RegularityKind::EqualRadii, &faces), Some(true));
        faces.get_mut(&3).unwrap().place_mm += crate::surface::across(&plane.direction)[0];
        assert_eq!(told(RegularityKind::Coaxial, &faces), Some(false));
        assert_eq!(told(RegularityKind::Symmetric, &faces), None);
        faces.remove(&3);
        assert_eq!(told(RegularityKind::Parallel, &faces), None);
    }
}
