//! A plan told to people.

use super::run::Planned;
use crate::output;

/// The plan in lines.
pub(super) fn told(planned: &Planned) -> String {
    let mut lines = vec![output::table(
        &[
            "OPERATION",
            "TOOL",
            "CUTTER",
            "RPM",
            "PASSES",
            "MOVES",
            "ARCS",
            "CUTTING M",
            "TIME",
        ],
        &[1, 3, 4, 5, 6, 7, 8],
        planned.operations.iter().map(|operation| {
            vec![
                operation.name.clone(),
                format!("T{}", operation.tool),
                operation.cutter.clone(),
                format!("{:.0}", operation.spindle_rpm),
                operation.passes.to_string(),
                operation.moves.to_string(),
                operation.arcs.to_string(),
                format!("{:.2}", operation.cutting_mm / 1000.0),
                time(operation.time_s),
            ]
        }),
    )];
    lines.push(String::new());
    lines.push(format!(
        "time         {} in all, tool changes included",
        time(planned.total_s)
    ));
    let simulation = &planned.simulation;
    lines.push(format!(
        "simulation   deepest gouge {:.4} mm, largest leftover {:.4} mm, 95 % within {:.4} mm; {} \
         nodes at {:.3} mm",
        simulation.gouge_mm,
        simulation.leftover_mm,
        simulation.leftover_95_mm,
        simulation.nodes,
        simulation.pitch_mm
    ));
    lines.push(format!("written      {}", planned.output.display()));
    if let Some(picture) = &planned.picture {
        lines.push(format!("picture      {}", picture.display()));
    }
    lines.join("\n")
}

/// Hours, minutes and seconds.
fn time(seconds: f64) -> String {
    let whole = seconds.round().clamp(0.0, 1e9) as u64;
    let (hours, minutes, seconds) = (whole / 3600, whole / 60 % 60, whole % 60);
    if hours > 0 {
        format!("{hours} h {minutes:02} min")
    } else {
        format!("{minutes} min {seconds:02} s")
    }
}
