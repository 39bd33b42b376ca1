//! The tables, and the page with them.

use std::fmt::Write;

use faults::Need;

use crate::tally::Tally;

pub(crate) fn table(tallies: &[Tally]) -> String {
    let mut text = String::from(
        "| class | rate | scans | complete by themselves | complete with a person | failed | \
         pauses per scan | columns measured twice | longer by, s |\n\
         | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n",
    );
    for tally in tallies {
        let rate = tally.class.map_or("drawn".to_owned(), |class| {
            format!("{} per {}", class.rate, class.per)
        });
        let person = tally.class.is_some_and(|class| class.need != Need::Nobody);
        let scans = tally.scans.max(1) as f64;
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "| {}{} | {rate} | {} | {} | {} | {} | {:.2} | {:.1} % | {:.1} |",
            tally.name,
            if person { " (needs a person)" } else { "" },
            tally.scans,
            tally.alone,
            tally.attended,
            tally.failures.len(),
            tally.pauses as f64 / scans,
            100.0 * (tally.measured as f64 / tally.columns.max(1) as f64 - 1.0),
            tally.took.as_secs_f64() / scans,
        );
    }
    text
}

pub(crate) fn page(tallies: &[Tally], from: u64) -> String {
    let scans: u64 = tallies.iter().map(|tally| tally.scans).sum();
    format!(
        "# Scans under faults\n\n\
         Written by `cargo xtask study faults`. {scans} scans of 50 columns, seeds from {from}, in \
         simulated time: the driver's session and recovery against the simulated device, joined by \
         a line in memory. `--only CLASS --replay SEED` runs one of them again.\n\n\
         Of every scan is asked: it ends, without a panic; the laser is off at the end, and \
         while a person is waited for; a complete scan is closed at the device; its journal is that of the same scan without faults, byte for byte. Of classes that need nobody, 99.9 % \
         of the scans must end without a person; the others must stop for their cause, and go on \
         when a person, who comes after 30 s, tells them to. A tenth of the columns takes as long \
         as 2 s to the disk, the others 4 ms. A mix draws each class with \
         probability 0.3 (0.1 if it needs a person) at a rate between a hundredth of the one below \
         and all of it.\n\n\
         Every other scan is on a line that tells nobody when the cable is pulled. A class that \
         needs nobody may still stop for a person when nothing comes of ten attempts; a scan under \
         one that needs a person ends by itself if the fault does not strike. An object that \
         is moved before 16 samples of it were measured is measured where it stands then: too little \
         to notice it by.\n\n\
         {}",
        table(tallies)
    )
}
