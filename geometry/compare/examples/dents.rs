//! How often a dent of 0.1 mm, 5 mm wide, is found in simulated scans, and anything where there is
//! none: `cargo run --release -p compare --example dents`, or with the number of scans of each
//! kind after `--`. Seeds from 2001 on, which nobody looked at in tuning.

#[path = "../tests/bench/mod.rs"]
mod bench;

use bench::{DENT, Dent, held, taken};
use compare::Alignment;

const FIRST_SEED: u64 = 2001;
const SCANS: u64 = 8;

/// How far from its place a dent counts as found, millimetres.
const NEAR_MM: f64 = 2.0;

fn main() -> Result<(), std::num::ParseIntError> {
    let scans = match std::env::args().nth(1) {
        Some(scans) => scans.parse()?,
        None => SCANS,
    };
    println!("| dent | alignment | scans | found | farthest, mm | anything else |");
    println!("| --- | --- | ---: | ---: | ---: | ---: |");
    let smooth = Dent {
        is_flat: false,
        ..DENT
    };
    for (name, dents) in [
        ("none", vec![]),
        ("flat", vec![DENT]),
        ("smooth", vec![smooth]),
    ] {
        for alignment in [Alignment::AsPlaced, Alignment::BestFit] {
            let (mut found, mut farthest_mm, mut else_found) = (0, 0.0_f64, 0);
            for seed in FIRST_SEED..FIRST_SEED + scans {
                let of_scan = held(&taken(&dents, seed), alignment, None);
                let away = of_scan.regions.iter().map(|region| {
                    let [x, y, _] = region.nominal_centre_mm;
                    libm::hypot(x - DENT.at_mm[0], y - DENT.at_mm[1])
                });
                let (near, far): (Vec<f64>, Vec<f64>) =
                    away.partition(|away| !dents.is_empty() && *away <= NEAR_MM);
                found += usize::from(!near.is_empty());
                farthest_mm = near.into_iter().fold(farthest_mm, f64::max);
                else_found += far.len();
            }
            let place = alignment.as_str();
            println!("| {name} | {place} | {scans} | {found} | {farthest_mm:.2} | {else_found} |");
        }
    }
    Ok(())
}
