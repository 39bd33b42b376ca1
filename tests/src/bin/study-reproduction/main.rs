//! Shim & Lee's experiments on the simulated house and cylinder.

mod conditions;
mod experiment;
mod regions;
mod true_image;

use pipeline::Method;
use conditions::{SEEDS, Subject};

fn main() -> anyhow::Result<()> {
    for subject in Subject::ALL {
        for seed in SEEDS.take(2) {
            let scan = experiment::Scan::take(subject, seed)?;
            for method in Method::ALL {
                let run = experiment::run(&scan, method, 1)?;
                println!("{} {seed} {method}: {:#?}\n{:?}", subject.title(), run.figures, run.labels);
            }
        }
    }
    Ok(())
}
