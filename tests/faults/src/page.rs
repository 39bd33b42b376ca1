//! The tables, and the page with them.

use std::fmt::Write;

use faults::Need;

use crate::tally::Tally;

pub(crate) fn table(tallies: &[Tally]) -> String {
    let mut text = String::from(
        "| class | rate | scans | struck | times | complete by themselves | complete with a person | excused | failed | \
         pauses per scan | columns measured twice | longer by, s |\n\
         | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n",
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
            "| {}{} | {rate} | {} | {} | {} | {} | {} | {} | {} | {:.2} | {:.1} % | {:.1} |",
            tally.name,
            if person { " (needs a person)" } else { "" },
            tally.scans,
            tally.struck,
            tally.strikes,
            tally.alone,
            tally.attended,
            tally.excused,
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
         within the dead-man time while a person is waited for and while the host sleeps; once it \
         has been off for a quarter of an hour it does not go on again without a person's word; a \
         complete scan is closed at the device; its journal is that of the same scan without \
         faults, byte for byte. Of classes that need nobody, 99.9 % \
         of the scans must end without a person; the others must stop for their cause, and go on \
         when a person, who comes after 30 s, tells them to. A tenth of the columns takes as long \
         as 2 s to the disk, the others 4 ms. A mix draws each class with \
         probability 0.3 (0.1 if it needs a person) at a rate between a hundredth of the one below \
         and all of it.\n\n\
         Every other scan is on a line that tells nobody when the cable is pulled. A class that \
         needs nobody may still stop for a person when nothing comes of ten attempts; a scan under \
         one that needs a person ends by itself if the fault does not strike, or strikes when the \
         last column is measured.\n\n\
         `host-sleep`: the host does nothing for up to 20 s, while the device goes on and the line \
         keeps what fits into 256 KiB. `long-sleep`: the same for 16 minutes to an hour. \
         `clock-jump`: the clock that the device tells in its status jumps by up to two hours, \
         forward or back, or to the last second before it begins anew; and, at the same rate, the \
         host's clock leaps ahead by 1 to 400 s between two looks at the line, every other time \
         that of the device with it, as where both are in one suspended machine. (The driver \
         goes by a clock that counts from the computer's start and never runs back.) `pause`: \
         somebody pauses the scan within 0.5 s of a column, and after every other word that lets it \
         go on within 4 s once more, whatever it is at then.\n\n\
         *Struck* are the scans in which the fault happened at least once, *times* is how often it \
         did in all of them (of a mix: any of its faults). *Excused* are scans whose object was \
         moved before 16 samples of it were measured, too little to notice it by: their journal \
         holds it where it stood then (and counts as complete), or there is none, since it was \
         measured in two places, cannot be put back, and the person gives up after 20 visits.\n\n\
         {}",
        table(tallies)
    )
}
