//! Tables, failures and bars, as Markdown.

use std::fmt::Write;

use relief_tests::scenes::{Set, View};

use crate::agree::{Agreed, Cluttered, LEAST_INDEX};
use crate::methods::Method;
use crate::tally::{Finding, TOLERANCES, Tally};

/// What was asked for, and whether it is so.
#[derive(Debug)]
pub(crate) struct Bar {
    pub(crate) set: Set,
    pub(crate) what: String,
    pub(crate) holds: bool,
}

/// The figures of a set, one row a method.
pub(crate) fn table(set: Set, view: View, tallies: &[Tally]) -> String {
    let mut out = String::new();
    let Some(first) = tallies.first() else {
        return out;
    };
    let _ = writeln!(
        out,
        "\n### {}, {}\n\n{} scenes, {} regions that count, {} smaller ones; {:.2} % of the nodes \
         that the scanner sees have a value.\n",
        set.name(),
        view.name(),
        first.scenes,
        first.bar().regions(),
        first.small,
        first.nodes.1 as f64 * 100.0 / first.nodes.0.max(1) as f64,
    );
    let _ = write!(out, "| method   |");
    for tolerance in TOLERANCES {
        let _ = write!(out, " {:>4.0} % |", tolerance * 100.0);
    }
    let _ = writeln!(out, " over | under | missed | noise a scene | s a scene |");
    let _ = writeln!(out, "| --- |{}", " ---: |".repeat(TOLERANCES.len() + 5));
    for tally in tallies {
        let _ = write!(out, "| {:<8} |", tally.method.name());
        for counts in &tally.at {
            let _ = write!(out, " {:>6.2} |", counts.correct_share() * 100.0);
        }
        let bar = tally.bar();
        let _ = writeln!(
            out,
            " {:>4} | {:>5} | {:>6} | {:>13.3} | {:>9.2} |",
            bar.over,
            bar.under,
            bar.missed,
            tally.noise_per_scene(),
            tally.seconds / tally.scenes.max(1) as f64
        );
    }
    let names = ["1", "2", "3 to 5", "6 and more"];
    let shares: Vec<String> = names
        .iter()
        .zip(first.by_depth)
        .map(|(name, (all, correct))| format!("{name}: {correct} of {all}"))
        .collect();
    let _ = writeln!(
        out,
        "\nCorrect by `{}` at 80 %, by nodes from a region's border to its innermost: {}.",
        first.method.name(),
        shares.join("; ")
    );
    out
}

/// Every region of the default method that is not correct at 80 %.
pub(crate) fn failures(findings: &[Finding]) -> String {
    let mut out = String::new();
    let ours = findings.iter().filter(|f| f.method == Method::Relief);
    for finding in ours {
        for failure in &finding.failures {
            let shares: Vec<String> = failure
                .shares
                .iter()
                .map(|(label, nodes)| format!("{label}: {nodes}"))
                .collect();
            let _ = writeln!(
                out,
                "- scene {} ({}), {}: region {} at ({}, {}), {} nodes, {} deep, {:.0} % valued; shares {}",
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
    if out.is_empty() {
        return out;
    }
    format!("\nNot correct by `relief` at 80 %:\n\n{out}")
}

/// The bars of a table. Short forms ask for less: few scenes make a coarse share.
pub(crate) fn bars(set: Set, view: View, tallies: &[Tally]) -> Vec<Bar> {
    let Some(relief) = tallies.iter().find(|t| t.method == Method::Relief) else {
        return Vec::new();
    };
    let bar = relief.bar();
    let least = if view == View::Outliers { 0.92 } else { 0.97 };
    let share = bar.correct_share();
    let mut bars = vec![Bar {
        set,
        what: format!(
            "{}: {:.2} % of regions correct at 80 %, of at least {:.0} %",
            view.name(),
            share * 100.0,
            least * 100.0
        ),
        holds: share >= least,
    }];
    if view == View::Plain {
        let noise = relief.noise_per_scene();
        bars.push(Bar {
            set,
            what: format!("plain: {noise:.3} noise regions a scene, of at most 0.05"),
            holds: noise <= 0.05,
        });
        if set == Set::Polyhedral {
            bars.push(Bar {
                set,
                what: format!("plain: {} regions missed, of none", bar.missed),
                holds: bar.missed == 0,
            });
        }
    }
    bars
}

pub(crate) fn agreement(set: Set, agreed: &Agreed) -> Bar {
    let below = agreed.below();
    let seeds: Vec<String> = below.iter().map(u64::to_string).collect();
    Bar {
        set,
        what: format!(
            "{}: index {:.4} in the mean of {} scenes, of at least {LEAST_INDEX}; least {:.3}, \
             below in {} ({}); {:.2} % of labelled nodes common",
            agreed.view.name(),
            agreed.mean(),
            agreed.scenes.len(),
            agreed.least(),
            below.len(),
            seeds.join(", "),
            agreed.coverage() * 100.0
        ),
        holds: agreed.mean() >= LEAST_INDEX,
    }
}

pub(crate) fn clutter(set: Set, found: &Cluttered) -> Bar {
    let seeds: Vec<String> = found.failed.iter().map(|f| f.seed.to_string()).collect();
    Bar {
        set,
        what: format!(
            "cluttered: {} of the {} faces correct without table and back plane, of all; {} \
             regions too many in {} scenes, {} without; scenes that fail: {}",
            found.with,
            found.without,
            found.noise,
            found.scenes,
            found.noise_without,
            if seeds.is_empty() {
                "none".into()
            } else {
                seeds.join(", ")
            }
        ),
        holds: found.failed.is_empty(),
    }
}

pub(crate) fn verdicts(bars: &[Bar]) -> String {
    let mut out = String::from("\n### Bars\n\n| set | bar | |\n| --- | --- | --- |\n");
    for bar in bars {
        let verdict = if bar.holds { "holds" } else { "**fails**" };
        let _ = writeln!(out, "| {} | {} | {verdict} |", bar.set.name(), bar.what);
    }
    out
}
