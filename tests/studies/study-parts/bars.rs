//! What is asked for, and whether it is so.

use std::fmt::Write;

use crate::judge::Judged;
use crate::part::Kind;
use crate::quality::quality;
use crate::tables::Totals;

/// A figure beside what is asked of it.
pub(crate) struct Bar {
    pub(crate) what: String,
    pub(crate) asked: String,
    pub(crate) measured: String,
    pub(crate) holds: bool,
}

pub(crate) fn bar(what: &str, asked: &str, measured: String, holds: bool) -> Bar {
    Bar {
        what: what.to_owned(),
        asked: asked.to_owned(),
        measured,
        holds,
    }
}

fn share(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

/// The bars on faces, numbers, surfaces and trims.
pub(crate) fn of_models(totals: &Totals) -> Vec<Bar> {
    let mut bars = vec![
        bar(
            "faces of 100 nodes and more of the right kind",
            "at least 98 %",
            format!("{:.1} %", totals.right()),
            totals.right() >= 98.0,
        ),
        bar(
            "regions correct after Hoover et al. at 80 %",
            "at least 97 %",
            format!("{:.1} %", totals.correct()),
            totals.correct() >= 97.0,
        ),
    ];
    let numbers = totals.numbers(None).len();
    bars.push(bar(
        "numbers of faces measured",
        "over 300",
        numbers.to_string(),
        numbers > 300,
    ));
    for kind in Kind::ALL {
        let Some(quality) = quality(&totals.numbers(Some(kind))) else {
            continue;
        };
        bars.push(bar(
            &format!("rms error of the numbers of a {kind}, of the bound"),
            "at most 1.3",
            format!("{:.2}", quality.ratio),
            quality.ratio <= 1.3,
        ));
        bars.push(bar(
            &format!("stated 95 % intervals of a {kind} that hold the truth"),
            "90 to 98 %",
            format!("{:.1} %", 100.0 * quality.covered),
            (0.9..=0.98).contains(&quality.covered),
        ));
        bars.push(bar(
            &format!("median width of these intervals of a {kind}, of the bound's"),
            "at most 1.3",
            format!("{:.2}", quality.width),
            quality.width <= 1.3,
        ));
    }
    let analytic = totals.deviation(|kind| kind != Kind::FreeForm, false);
    let free = totals.deviation(|kind| kind == Kind::FreeForm, false);
    for (what, asked, most_mm, deviation) in [
        ("analytic", "at most 0.006 mm", 0.006, &analytic),
        ("free-form", "at most 0.012 mm", 0.012, &free),
    ] {
        if deviation.nodes > 0 {
            bars.push(bar(
                &format!("rms distance of exported surfaces from true {what} faces"),
                asked,
                format!("{:.4} mm", deviation.rms_mm()),
                deviation.rms_mm() <= most_mm,
            ));
        }
    }
    let most_mm = analytic.most_mm.max(free.most_mm);
    bars.push(bar(
        "greatest of these distances, away from edges",
        "at most 0.15 mm",
        format!("{most_mm:.3} mm"),
        most_mm <= 0.15,
    ));
    let covered = share(
        totals.on_grids(|part| part.on_grid.covered),
        totals.on_grids(|part| part.on_grid.seen),
    );
    bars.push(bar(
        "of what the scanner sees, covered within 0.2 mm",
        "at least 99.5 %",
        format!("{covered:.2} %"),
        covered >= 99.5,
    ));
    let wrong = share(
        totals.on_grids(|part| part.on_grid.wrong()),
        totals.on_grids(|part| part.on_grid.nodes),
    );
    bars.push(bar(
        "nodes on the wrong side of a trim",
        "at most 0.3 %",
        format!("{wrong:.2} %"),
        wrong <= 0.3,
    ));
    let (sharp, smooth) = totals.edges();
    let mut all = sharp;
    all.join(&smooth);
    if all.met_mm > 0.0 {
        bars.push(bar(
            "rms distance of intersection edges from true edges",
            "at most 0.02 mm",
            format!("{:.4} mm", all.rms_mm()),
            all.rms_mm() <= 0.02,
        ));
    }
    for (what, edges) in [("true edges", all), ("sharp true edges alone", sharp)] {
        if edges.true_mm <= 0.0 {
            continue;
        }
        let met = 100.0 * edges.met_mm / edges.true_mm;
        bars.push(bar(
            &format!("share of the length of {what} between seen faces that is intersected"),
            "at least 90 %",
            format!("{met:.1} %"),
            met >= 90.0,
        ));
    }
    bars
}

/// The bars on exported files.
pub(crate) fn of_files(judged: &[Judged]) -> Vec<Bar> {
    let mut bars = Vec::new();
    for (ending, name) in [("igs", "IGES"), ("step", "STEP")] {
        let files: Vec<&Judged> = judged.iter().filter(|j| j.file == ending).collect();
        let valid = files.iter().filter(|j| j.is_valid()).count();
        let closed = files.iter().filter(|j| j.is_closed()).count();
        for (what, count) in [
            ("all faces valid", valid),
            ("free edges at silhouettes and steps only", closed),
        ] {
            bars.push(bar(
                &format!("{name} files, by OpenCASCADE: {what}"),
                "100 %",
                format!("{count} of {}", files.len()),
                count == files.len() && count > 0,
            ));
        }
        let meshed: Vec<_> = files.iter().filter_map(|j| j.complaints.as_ref()).collect();
        let count = meshed.iter().filter(|said| said.is_empty()).count();
        if !meshed.is_empty() {
            bars.push(bar(
                &format!("{name} files, by Gmsh: all faces meshed without a complaint"),
                "100 %",
                format!("{count} of {}", files.len()),
                count == files.len(),
            ));
        }
    }
    bars
}

pub(crate) fn table(bars: &[Bar]) -> String {
    let mut out =
        String::from("| figure | asked for | measured | holds |\n| --- | --- | ---: | --- |\n");
    for bar in bars {
        let holds = if bar.holds { "yes" } else { "**no**" };
        let _ = writeln!(
            out,
            "| {} | {} | {} | {holds} |",
            bar.what, bar.asked, bar.measured
        );
    }
    out
}

/// The figures that hold by the table of a page, and by these bars do not, or are not there.
pub(crate) fn lost<'a>(page: &'a str, bars: &[Bar]) -> Vec<&'a str> {
    let rows = page
        .lines()
        .filter_map(|line| line.strip_suffix(" | yes |"));
    let figures = rows.filter_map(|row| row.strip_prefix("| ")?.split(" | ").next());
    let holds = |figure: &str| bars.iter().any(|bar| bar.what == figure && bar.holds);
    figures.filter(|figure| !holds(figure)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_held_on_the_page_must_hold() {
        let at = |what: &str, holds: bool| bar(what, "at most 1", "0.5".into(), holds);
        let page = format!(
            "# Page\n\n{}",
            table(&[at("a", true), at("b", false), at("c", true)])
        );
        assert_eq!(
            lost(&page, &[at("a", true), at("c", true)]),
            Vec::<&str>::new()
        );
        assert_eq!(lost(&page, &[at("a", false), at("b", true)]), ["a", "c"]);
    }

    fn judged(file: &str, invalid: usize, misplaced_mm: f64) -> Judged {
        Judged {
            seed: 1,
            file: file.into(),
            is_read: true,
            faces: 5,
            invalid,
            free_mm: 100.0,
            misplaced_mm,
            complaints: None,
        }
    }

    #[test]
    fn a_file_that_was_not_meshed_is_not_meshed_well() {
        let with = |complaints: Option<&[&str]>| Judged {
            complaints: complaints.map(|said| said.iter().map(|s| (*s).to_owned()).collect()),
            ..judged("igs", 0, 0.0)
        };
        let last = |files: &[Judged]| of_files(files).swap_remove(2);
        let well = last(&[with(Some(&[])), with(Some(&[]))]);
        assert!(well.what.contains("Gmsh") && well.holds);
        assert!(!last(&[with(Some(&[])), with(Some(&["Error"]))]).holds);
        assert!(!last(&[with(Some(&[])), with(None)]).holds);
        assert!(!last(&[with(None)]).what.contains("Gmsh"));
    }

    #[test]
    fn one_bad_file_breaks_its_own_bar_only() {
        let files = [
            judged("igs", 0, 0.0),
            judged("igs", 0, 7.0),
            judged("step", 1, 0.0),
            judged("step", 0, 0.0),
        ];
        let holds: Vec<bool> = of_files(&files).iter().map(|bar| bar.holds).collect();
        assert_eq!(holds, [true, false, false, true]);
        assert!(of_files(&[]).iter().all(|bar| !bar.holds));
        let table = table(&of_files(&files));
        assert!(table.contains("| 1 of 2 | **no** |"), "{table}");
    }
}
