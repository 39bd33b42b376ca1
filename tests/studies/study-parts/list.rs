//! Every face, number and surface that is not as it should be, for who looks for the cause.

use std::fmt::Write;

use relief_tests::score::TruthClass;
use shapes::Family;

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
                if let Some(real) = part.true_of_face.get(face.face).copied().flatten() {
                    let _ = writeln!(out, "    truly {real:.4?}");
                }
            }
            for number in found.iter().flat_map(|found| &found.numbers) {
                if number.error.abs() > 3.0 * number.bound || !number.is_covered() {
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
                let ([x, y], region) = deviation.worst;
                let _ = writeln!(
                    out,
                    "  face {face}: {} off by {:.4} mm rms, at most {:.3} mm about ({x:.1}, {y:.1}) in \
                     region {region}, at {} nodes",
                    part.kinds
                        .get(*face)
                        .map_or_else(String::new, Kind::to_string),
                    deviation.rms_mm(),
                    deviation.most_mm,
                    deviation.nodes,
                );
            }
        }
        let sharp = part.sharp_edges;
        let bound = format!("; bound {:.4} mm", sharp.bound_mm());
        for (what, edges, bound) in [
            ("sharp", sharp, bound.as_str()),
            ("smooth", part.smooth_edges, ""),
        ] {
            let _ = writeln!(
                out,
                "  {what} edges: {:.0} mm, near a crease {:.0} mm, intersected {:.0} mm and {:.4} mm \
                 rms off{bound}",
                edges.true_mm,
                edges.near_mm,
                edges.met_mm,
                edges.rms_mm(),
            );
        }
        for own in &part.outcome.tangent.accepted {
            let _ = writeln!(out, "  regions {:?} touch", own.labels);
        }
        for own in &part.outcome.tangent.refused {
            let (labels, why) = (&own.labels, own.reason);
            let _ = writeln!(out, "  regions {labels:?} seem to touch: {why:?}");
        }
        for kind in &part.outcome.kinds {
            let _ = writeln!(out, "  {}", told_of(part, kind.label.get()));
        }
        for apart in crate::edges::apart(&part.outcome.reconstruction.model) {
            let _ = writeln!(out, "  {apart}");
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
        for ((face, taken_for, is_seen), nodes) in &grid.taken {
            let name = |face: usize| {
                let kind = part
                    .kinds
                    .get(face)
                    .map_or_else(String::new, Kind::to_string);
                format!("{face} ({kind})")
            };
            let _ = writeln!(
                out,
                "    {nodes} {} of face {} in the trim of {}",
                if *is_seen { "seen" } else { "not seen" },
                name(*face),
                taken_for.map_or_else(|| "no face".to_owned(), name),
            );
        }
    }
    out
}

/// What the samples of a region speak for, and how much more loudly than for anything else.
fn told_of(part: &Measured, region: u16) -> String {
    let mut kinds = part.outcome.kinds.iter();
    let Some(own) = kinds.find(|kind| kind.label.get() == region) else {
        return format!("region {region} is not of the part");
    };
    let name = |family: Option<Family>| family.map_or("polynomial", Family::as_str);
    let candidates = &own.evidence.candidates;
    let best = candidates.first().map_or(0.0, |candidate| candidate.score);
    let scores = candidates.iter().map(|candidate| {
        let (family, freedom) = (name(candidate.family), candidate.freedom);
        format!("{family} of {freedom} {:.1}", candidate.score - best)
    });
    let scores: Vec<String> = scores.collect();
    let shape = own.evidence.fit().map(|fit| {
        let (shape, rms_mm, held) = (fit.shape, fit.rms_mm, fit.held);
        format!("; {held} samples {rms_mm:.4} mm about {shape:.4?}")
    });
    let shares = part.faces.iter().flat_map(|face| {
        let own = face.shares.iter().filter(|(other, _)| *other == region);
        own.map(|(_, nodes)| format!("{} of face {}", nodes, face.face))
    });
    let shares: Vec<String> = shares.collect();
    format!(
        "region {region}, {}: {}{}",
        shares.join(" and "),
        scores.join(", "),
        shape.unwrap_or_default()
    )
}
