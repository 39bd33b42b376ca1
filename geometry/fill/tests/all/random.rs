//! Random holes in closed surfaces.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use crate::common;

use common::{RING, Shape, compacted, is_watertight};
use fill::{Hole, Settings, TriangleMesh, fill};
use proptest::prelude::*;
use range_image::Unmonitored;

/// A mesh without the triangles around some, grown by rings.
fn holed(mesh: &TriangleMesh, seeds: &[(prop::sample::Index, usize)]) -> TriangleMesh {
    let mut is_out = vec![false; mesh.triangles.len()];
    for (index, rings) in seeds {
        let mut corners: std::collections::HashSet<u32> =
            mesh.triangles[index.index(mesh.triangles.len())].into();
        is_out[index.index(mesh.triangles.len())] = true;
        for _ in 0..*rings {
            let before = corners.clone();
            for (t, own) in mesh.triangles.iter().enumerate() {
                if own.iter().any(|v| before.contains(v)) {
                    is_out[t] = true;
                    corners.extend(own);
                }
            }
        }
    }
    let kept = (0..mesh.triangles.len()).filter(|&t| !is_out[t]);
    compacted(mesh, kept.map(|t| mesh.triangles[t]).collect())
}

/// Whether a hole in the torus has vertices on most of eight parts of the tube's round.
fn is_around_the_tube(mesh: &TriangleMesh, hole: &Hole) -> bool {
    let parts: std::collections::HashSet<i32> = hole
        .vertices
        .iter()
        .map(|&v| {
            let [x, y, z] = mesh.vertices_mm[v as usize];
            (libm::atan2(z, libm::hypot(x, y) - RING) / std::f64::consts::FRAC_PI_4).floor() as i32
        })
        .collect();
    (-4..4).filter(|part| parts.contains(part)).count() > 4
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn all_are_closed(
        seeds in prop::collection::vec((any::<prop::sample::Index>(), 0..5_usize), 1..7),
        torus in any::<bool>(),
    ) {
        let shape = if torus { Shape::Torus } else { Shape::Sphere };
        let (mesh, _) = shape.mesh(5.0);
        let mesh = holed(&mesh, &seeds);
        let own = fill(mesh.clone(), &Settings::default(), &Unmonitored).unwrap();
        // A torus that is cut through, or but for a bridge, is a bent pipe, and its ends may be borders.
        prop_assume!(!torus || !own.holes.iter().any(|hole| is_around_the_tube(&own.mesh, &hole.hole)));
        // Holes may leave islands and touch; what stays open is told.
        prop_assert!(own.open().is_empty(), "{:?}", own.holes);
        prop_assert!(is_watertight(&own.mesh), "{:?}", own.holes);
        for (own, old) in own.mesh.triangles.iter().map(|t| t.map(|v| own.mesh.vertices_mm[v as usize]))
            .zip(mesh.triangles.iter().map(|t| t.map(|v| mesh.vertices_mm[v as usize]))) {
            prop_assert_eq!(own, old);
        }
    }
}
