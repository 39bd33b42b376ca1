//! Every face, number and surface that is not as it should be, for who looks for the cause.

use std::fmt::Write;

use relief_tests::score::TruthClass;

use crate::measure::Measured;
use crate::part::Kind;

/// All of them, part by part.
pub(crate) fn list(parts: &[Measured]) -> String {
    let mut out = String::new();
    for part in parts {
        let _ = writeln!(out, "part {}: {}", part.seed, part.name);
        for face in &part.faces {
            let found = face.found.as_ref();
            let kind = found.and_then(|found| found.kind);
            let told = kind.map_or_else(|| "nothing".to_owned(), |kind| kind.to_string());
            if !face.is_right() || face.class != TruthClass::Correct {
                let shares: Vec<String> = face
                    .shares
                    .iter()
                    .map(|(region, nodes)| format!("{region}: {nodes}"))
                    .collect();
                let _ = writeln!(
                    out,
                    "  face {}, {} nodes: {} is {told}, {:?}; nodes by region {}",
                    face.face,
                    face.nodes,
                    face.kind,
                    face.class,
                    shares.join(", "),
                );
            }
            for number in found.iter().flat_map(|found| &found.numbers) {
                if number.error.abs() > 3.0 * number.bound {
                    let _ = writeln!(
                        out,
                        "  face {}, {} nodes: {} {} off by {:.5}; bound {:.5}, stated {:.5}",
                        face.face,
                        face.nodes,
                        face.kind,
                        number.name,
                        number.error,
                        number.bound,
                        number.stated,
                    );
                }
            }
        }
        for (face, deviation) in &part.on_grid.deviations {
            if deviation.rms_mm() > 0.012 || deviation.most_mm > 0.15 {
                let _ = writeln!(
                    out,
                    "  face {face}: {} off by {:.4} mm rms, at most {:.3} mm, at {} nodes",
                    part.kinds
                        .get(*face)
                        .map_or_else(String::new, Kind::to_string),
                    deviation.rms_mm(),
                    deviation.most_mm,
                    deviation.nodes,
                );
            }
        }
        for (what, edges) in [("sharp", part.sharp_edges), ("smooth", part.smooth_edges)] {
            let _ = writeln!(
                out,
                "  {what} edges: {:.0} mm, near a crease {:.0} mm, intersected {:.0} mm and {:.4} mm \
                 rms off",
                edges.true_mm,
                edges.near_mm,
                edges.met_mm,
                edges.rms_mm(),
            );
        }
        let grid = &part.on_grid;
        let _ = writeln!(
            out,
            "  of {} nodes {} lost, {} invented, {} of another face ({} of faces found); {} of {} \
             not covered",
            grid.nodes,
            grid.lost,
            grid.invented,
            grid.other,
            grid.other_of_found,
            grid.seen - grid.covered,
            grid.seen,
        );
    }
    out
}
