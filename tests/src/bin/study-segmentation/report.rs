//! Tables, failures and bars, as text.

use relief_tests::scenes::{Set, View};

use crate::methods::Method;
use crate::tally::{Counts, Finding, TOLERANCES, Tally};

/// Prints the table of a set and lists what failed.
pub(crate) fn print(set: Set, view: View, tallies: &[Tally], findings: &[Vec<Finding>]) {
    let Some(first) = tallies.first() else { return };
    println!(
        "\n{} ({}): {} scenes, {} regions of 100 nodes or more, {} smaller; {:.2} % of the nodes seen have a value",
        set.name(),
        view.name(),
        first.scenes,
        first.bar().regions(),
        first.small,
        percent(first.nodes.1, first.nodes.0),
    );
    print!("{:<12}", "correct at");
    for tolerance in TOLERANCES {
        print!("{:>8}", format!("{:.0} %", tolerance * 100.0));
    }
    println!(
        "{:>8}{:>8}{:>8}{:>10}{:>9}",
        "over", "under", "missed", "noise/sc.", "s/scene"
    );
    for tally in tallies {
        print!("{:<12}", tally.method.name());
        for counts in &tally.at {
            print!("{:>8.2}", counts.correct_share() * 100.0);
        }
        let Counts {
            over,
            under,
            missed,
            ..
        } = tally.bar();
        println!(
            "{over:>8}{under:>8}{missed:>8}{:>10.3}{:>9.3}",
            tally.noise_per_scene(),
            tally.seconds / tally.scenes.max(1) as f64
        );
    }
    let failed = findings
        .iter()
        .flatten()
        .filter(|finding| finding.method == Method::Relief);
    let mut heading = false;
    for finding in failed {
        for failure in &finding.failures {
            if !heading {
                println!("failures of relief at 80 %:");
                heading = true;
            }
            let shares: Vec<String> = failure
                .shares
                .iter()
                .map(|(label, nodes)| format!("{label}: {nodes}"))
                .collect();
            println!(
                "  scene {:>4} ({}) {:<6} region {:>3} at ({}, {}), {} nodes, {} deep, {:.0} % valued; shared with {}",
                finding.seed,
                finding.kind,
                failure.what,
                failure.label,
                failure.at.0,
                failure.at.1,
                failure.nodes,
                failure.depth,
                failure.valued * 100.0,
                if shares.is_empty() {
                    "none".into()
                } else {
                    shares.join(", ")
                },
            );
        }
    }
}

fn percent(part: usize, whole: usize) -> f64 {
    part as f64 * 100.0 / whole.max(1) as f64
}

/// Says of each bar whether it holds; gives whether all do.
pub(crate) fn check(set: Set, view: View, tallies: &[Tally]) -> bool {
    let Some(relief) = tallies.iter().find(|t| t.method == Method::Relief) else {
        return false;
    };
    let bar = relief.bar();
    let least = if view == View::Outliers { 0.92 } else { 0.97 };
    let mut bars = vec![(
        format!(
            "correct at 80 %: {:.2} % of regions, at least {:.0} %",
            bar.correct_share() * 100.0,
            least * 100.0
        ),
        bar.correct_share() >= least,
    )];
    if view == View::Plain {
        bars.push((
            format!(
                "noise: {:.3} a scene, at most 0.05",
                relief.noise_per_scene()
            ),
            relief.noise_per_scene() <= 0.05,
        ));
        if set == Set::Polyhedral {
            bars.push((
                format!("missed: {}, none allowed", bar.missed),
                bar.missed == 0,
            ));
        }
    }
    for (what, holds) in &bars {
        println!("{}  {what}", if *holds { "holds" } else { "FAILS" });
    }
    bars.iter().all(|(_, holds)| *holds)
}
