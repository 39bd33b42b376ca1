//! How it is known where each edge runs.

use nurbs::PatchSurface;
use range_image::{Cancelled, Monitor};

use crate::assemble::{Carrier, Placement, kinds};
use crate::border::map::PlanarMap;
use crate::meeting::{loosen, meet};
use crate::model::{EdgeKind, EdgeOrigin};

/// Rounds in which creases are cut loose from what keeps them from their line.
const LOOSENINGS: usize = 4;

/// Puts creases where their surfaces intersect; gives what each edge is, and how it is known where
/// it runs.
pub(crate) fn met(
    planar: &mut PlanarMap,
    carriers: &[Carrier],
    placement: Placement,
    monitor: &dyn Monitor,
) -> Result<(Vec<EdgeKind>, Vec<EdgeOrigin>), Cancelled> {
    let fitted = carriers
        .iter()
        .map(|carrier| (&carrier.surface, carrier.rms_mm));
    let surfaces: Vec<(&PatchSurface, f64)> = fitted.collect();
    let mut rounds = 0..LOOSENINGS;
    loop {
        let kinds = kinds(planar, carriers, placement);
        let asked = kinds.iter().zip(&planar.edges);
        let is_crease: Vec<bool> = asked
            .map(|(kind, edge)| *kind == EdgeKind::Crease && !edge.is_kept)
            .collect();
        let mut moved = planar.clone();
        let meeting = meet(&mut moved, &surfaces, &is_crease, placement, monitor)?;
        if rounds.next().is_some() && loosen(planar, &surfaces, &is_crease, &meeting, placement) {
            continue;
        }
        *planar = moved;
        let edges = planar.edges.iter().zip(meeting.is_met);
        let origins = edges.map(|(edge, is_met)| match (is_met, edge.is_settled) {
            (true, _) => EdgeOrigin::Intersected,
            (false, true) => EdgeOrigin::Measured,
            (false, false) => EdgeOrigin::Assumed,
        });
        return Ok((kinds, origins.collect()));
    }
}

#[cfg(test)]
mod tests {
    use range_image::Unmonitored;

    use super::*;
    use crate::meeting::testing::{PLACEMENT, crease_and_outline, plane, running_out};

    #[test]
    fn a_crease_that_runs_out_is_intersected_as_far_as_it_goes() {
        let carriers = [running_out(), plane(0.0, 0.0, 0.0)].map(|surface| Carrier {
            region: 1,
            name: "face".into(),
            surface,
            form: None,
            rms_mm: 0.01,
        });
        let mut map = crease_and_outline();
        let (kinds, origins) = met(&mut map, &carriers, PLACEMENT, &Unmonitored).unwrap();
        assert_eq!(
            (kinds.len(), origins.len()),
            (map.edges.len(), map.edges.len())
        );
        let intersected = map.edges.iter().zip(&origins);
        let intersected = intersected.filter(|(_, origin)| **origin == EdgeOrigin::Intersected);
        let pitches: f64 = intersected.map(|(edge, _)| edge.path.arc_length()).sum();
        assert!((30.0..36.0).contains(&pitches), "{pitches}");
        assert_eq!(
            (kinds[1], origins[1]),
            (EdgeKind::Silhouette, EdgeOrigin::Assumed)
        );
    }
}
