//! A network told to people.

use super::run::Told;
use crate::output;

pub(super) fn told(told: &Told) -> String {
    let [inputs, hidden, outputs] = told.neurons;
    let errors = told
        .errors
        .iter()
        .map(|own| vec![own.epoch.to_string(), format!("{:.6}", own.error)]);
    let judged = &told.judged;
    let share = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
    let mut lines = vec![
        output::table(&["EPOCH", "ERROR"], &[0, 1], errors),
        String::new(),
        confusion(told),
        String::new(),
        format!(
            "network       {inputs}-{hidden}-{outputs}, seed {}, taught {} patterns in {} epochs{}",
            told.seed,
            told.patterns,
            told.epochs,
            if told.converged {
                ", below the tolerance"
            } else {
                ""
            }
        ),
        format!(
            "others        {} patterns that it was not taught: {:.2} % right, {:.2} % unknown",
            judged.patterns,
            share(judged.right, judged.patterns),
            share(judged.unknown, judged.patterns)
        ),
        format!(
            "random codes  {}, of which {:.2} % are taken for a class",
            judged.random_codes,
            share(judged.random_codes_known, judged.random_codes)
        ),
    ];
    lines.push(match &told.bounds {
        Some(bounds) => format!(
            "unknown       beyond {:.2} edits of {} known codes, below an output of {}, or a lead of {}",
            bounds.distance, told.known, bounds.output, bounds.margin
        ),
        None => "unknown       nothing; the greatest output is the answer".to_owned(),
    });
    lines.push(format!("time          {:.1} s", told.seconds));
    lines.push(format!("written to    {}", told.output.display()));
    lines.join("\n")
}

/// What the network calls patterns of each class.
fn confusion(told: &Told) -> String {
    let mut heading = vec!["IS \\ CALLED"];
    heading.extend(told.classes.iter().map(String::as_str));
    heading.push("unknown");
    let rows = told.classes.iter().zip(&told.judged.confusion);
    let lines = rows.map(|(class, row)| {
        let counts = row.iter().map(ToString::to_string);
        core::iter::once(class.clone()).chain(counts).collect()
    });
    let numbers: Vec<usize> = (1..heading.len()).collect();
    output::table(&heading, &numbers, lines)
}
