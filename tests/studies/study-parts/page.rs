//! The page about the study.

use std::fmt::Write;
use std::ops::RangeInclusive;

use relief_tests::score::TruthClass;

use crate::Failed;
use crate::bars::{self, Bar, of_files, of_models};
use crate::edges::MEETS_MM;
use crate::judge::{Judged, MISPLACED_MM};
use crate::measure::Measured;
use crate::regular::regularities;
use crate::scan::{DEEP, DROPOUTS, OUTLIERS, SPOT_RADIUS_MM};
use crate::tables::Totals;

const WORST: usize = 8;

/// All bars.
pub(crate) fn bars(parts: &[Measured], judged: Option<&[Judged]>) -> Vec<Bar> {
    let mut all = of_models(&Totals { parts });
    all.extend(judged.map_or_else(Vec::new, of_files));
    all
}

/// The page. With `has_regularities` the shapes were given those that they are likely to have.
pub(crate) fn page(
    seeds: &RangeInclusive<u64>,
    parts: &[Measured],
    failed: &[Failed],
    judged: Option<&[Judged]>,
    has_regularities: bool,
) -> String {
    let totals = Totals { parts };
    let (title, option) = if has_regularities {
        (", with regularities", " --regularize")
    } else {
        ("", "")
    };
    let mut out = format!("# Exact models of parts, measured{title}\n\n");
    let _ = writeln!(
        out,
        "`cargo xtask study parts{option} --gmsh --write` makes this page. Seeds {} to {}, none left \
         out; the code under test was not tuned on them.\n",
        seeds.start(),
        seeds.end()
    );
    out += &about();
    let _ = writeln!(out, "\n## Bars\n\n{}", bars::table(&bars(parts, judged)));
    for (seed, why) in failed {
        let _ = writeln!(out, "Part {seed} gave no model: {why}\n");
    }
    let _ = writeln!(
        out,
        "## Kinds\n\n{} parts, {} faces of 100 nodes and more. At 80 %: {} correct, {} \
         over-segmented, {} under-segmented, {} missed; {} regions of noise.\n\n{}\n{}",
        parts.len(),
        totals.faces().count(),
        totals.of_class(TruthClass::Correct),
        totals.of_class(TruthClass::Over),
        totals.of_class(TruthClass::Under),
        totals.of_class(TruthClass::Missed),
        totals.noise(),
        totals.kinds(),
        totals.joined(),
    );
    let _ = writeln!(
        out,
        "## Numbers\n\nOf faces of the right kind that share four fifths of their nodes with their \
         region. The informed error is that of an estimator that is told which readings are of the \
         face: least squares over these alone. It shows that the bound is right, and can be \
         reached. The inner bound is that of readings deep within the face alone: the {DEEP} \
         nodes beyond the four around them are of it, too.\n\n{}",
        totals.qualities()
    );
    if has_regularities {
        let _ = writeln!(out, "{}", regularities(parts));
    }
    let _ = writeln!(
        out,
        "## Surfaces\n\nDistance of the exported surfaces from the true faces along their normals, \
         at nodes two and more from another face or what is not seen. A face counts as found that \
         is correct at 80 % and of the right kind.\n\n{}",
        totals.deviations()
    );
    let _ = writeln!(out, "## Trims\n\n{}", trims(&totals));
    let _ = writeln!(out, "## Edges\n\n{}", edges(&totals));
    if let Some(judged) = judged {
        let _ = writeln!(out, "## Files\n\n{}", files(judged));
    }
    let _ = writeln!(
        out,
        "## The worst parts\n\nBy faces not correct or of the wrong kind, and then by nodes on the \
         wrong side.\n\n{}",
        totals.worst(WORST)
    );
    while out.ends_with("\n\n") {
        out.pop();
    }
    out
}

fn about() -> String {
    format!(
        "**Parts** are drawn from seeds and built by OpenCASCADE (`tests/judges/parts`): a plate, a \
         prism, a disc, a stepped block, a roof, a lying cylinder or cone, a turned shaft, or a \
         block with a free-form top, about 100 mm wide; with bosses, frusta, domes, dimples, \
         countersunk and blind holes, ring-shaped ridges and grooves, pads, pockets, rods and \
         ramps; with fillets and chamfers. They are turned 2 to 8 degrees off the axes, and up to \
         15 degrees in the plane of the table. Faces that join smoothly are several. The scanner \
         meets the faces where their equations have them, free forms by triangles within \
         0.0015 mm.\n\n\
         **Scans** are of the simulated scanner `paper`: 240 columns of 256 samples, noise of \
         0.05 mm along the normal (its deviation along the beam grows as 1 / cosine of the \
         incidence; 30 % of its variance is frozen to the surface), ranges in counts of 0.1 mm, one \
         in ten samples on a step mixed, no light back beyond 75 degrees; and for this study {:.0} % \
         of the samples anywhere in the range window, {:.0} % dropouts at normal incidence, and a \
         spot of {:.1} mm.\n\n\
         **Truth** comes from the B-rep, node by node on the lattice of the scan: the face first met \
         along z, where laser and sensor see it. A region is a connected part of one face. The kind \
         found is that of the region that shares the most nodes with the face.\n\n\
         **The bound** is that of Cramer and Rao, face by face: every reading of that face with \
         noise alone, each with the deviation of its noise and of the rounding to counts. Which \
         readings these are only the simulator knows.",
        100.0 * OUTLIERS,
        100.0 * DROPOUTS,
        2.0 * SPOT_RADIUS_MM,
    )
}

fn trims(totals: &Totals) -> String {
    let nodes = totals.on_grids(|part| part.on_grid.nodes);
    let row = |what: &str, count: usize| {
        let share = 100.0 * count as f64 / nodes.max(1) as f64;
        format!("| {what} | {count} | {share:.3} |\n")
    };
    let mut out = format!(
        "On a grid of 240 x 256 nodes over each part, {nodes} nodes over a part or within a trim.\n\n\
         | nodes | how many | % |\n| --- | ---: | ---: |\n"
    );
    out += &row(
        "seen, but outside of all trims",
        totals.on_grids(|p| p.on_grid.lost),
    );
    out += &row(
        "within a trim, but not over the part",
        totals.on_grids(|p| p.on_grid.invented),
    );
    out += &row(
        "within the trim of another face",
        totals.on_grids(|p| p.on_grid.other),
    );
    out += &row(
        "of those within the trim of another, between faces that were both found",
        totals.on_grids(|p| p.on_grid.other_of_found),
    );
    out += &row(
        "of those within the trim of another, not seen by the scanner",
        totals.on_grids(|p| p.on_grid.other_unseen()),
    );
    out += &row(
        "seen, and farther than 0.2 mm from all trimmed faces",
        totals.on_grids(|p| p.on_grid.seen - p.on_grid.covered),
    );
    out
}

fn edges(totals: &Totals) -> String {
    let (sharp, smooth) = totals.edges();
    let mut out = format!(
        "True edges of two faces that are both seen beside them, against those of the STEP file. An \
         edge is intersected where one that the two faces' regions share lies within half a \
         millimetre, beside it and not beyond its end, and their surfaces are no more than \
         {MEETS_MM} mm off it together; smooth ones are those where the faces have one tangent \
         plane. Bound: two surfaces of which nothing is known but the readings of either meet no \
         nearer to the true edge, by the bounds of their numbers and the angle at which they meet; a \
         free-form face is taken to be known, and to meet others at a right angle. For smooth edges, \
         which that angle does not tell, there is none.\n\n\
         | edges | length, mm | with a shared one near, % | intersected, % | rms distance of these, mm \
         | bound of that, mm |\n| --- | ---: | ---: | ---: | ---: | ---: |\n"
    );
    for (what, edges, has_bound) in [("sharp", sharp, true), ("smooth", smooth, false)] {
        let percent = |part_mm: f64| 100.0 * part_mm / edges.true_mm.max(f64::MIN_POSITIVE);
        let told = |is_there: bool, mm: f64| match is_there {
            true => format!("{mm:.4}"),
            false => "-".to_owned(),
        };
        let is_met = edges.met_mm > 0.0;
        let _ = writeln!(
            out,
            "| {what} | {:.0} | {:.1} | {:.1} | {} | {} |",
            edges.true_mm,
            percent(edges.near_mm),
            percent(edges.met_mm),
            told(is_met, edges.rms_mm()),
            told(is_met && has_bound, edges.bound_mm()),
        );
    }
    out
}

fn files(judged: &[Judged]) -> String {
    let mut out = format!(
        "As OpenCASCADE reads them. Faces are sewn at 0.01 mm; an edge of one face belongs within \
         two nodes of what is not seen and of steps (0.5 mm; 0.05 mm, the noise, where the two \
         faces share no edge in the part within half a millimetre), and a file may have \
         {MISPLACED_MM} mm of them elsewhere.\n\n\
         | files | faces | not valid | free edges, mm | where none belong, mm | files with more than \
         that |\n| --- | ---: | ---: | ---: | ---: | --- |\n"
    );
    for (ending, name) in [("igs", "IGES"), ("step", "STEP")] {
        let own = || judged.iter().filter(|j| j.file == ending);
        let bad: Vec<String> = own()
            .filter(|j| !j.is_closed())
            .map(|j| j.seed.to_string())
            .collect();
        let _ = writeln!(
            out,
            "| {name} | {} | {} | {:.0} | {:.0} | {} |",
            own().map(|j| j.faces).sum::<usize>(),
            own().map(|j| j.invalid).sum::<usize>(),
            own().map(|j| j.free_mm).sum::<f64>(),
            own().map(|j| j.misplaced_mm).sum::<f64>(),
            if bad.is_empty() {
                "none".to_owned()
            } else {
                bad.join(", ")
            },
        );
    }
    for j in judged.iter().filter(|j| !j.is_valid()) {
        let _ = writeln!(
            out,
            "\n{}.{}: {} of {} faces not valid{}.",
            j.seed,
            j.file,
            j.invalid,
            j.faces,
            if j.is_read { "" } else { ", and not read" }
        );
    }
    let complained = judged
        .iter()
        .filter_map(|j| Some((j, j.complaints.as_ref()?)));
    for (j, said) in complained.filter(|(_, said)| !said.is_empty()) {
        let _ = writeln!(
            out,
            "\n{}.{}, by Gmsh: {}.",
            j.seed,
            j.file,
            said.join("; ")
        );
    }
    out
}
