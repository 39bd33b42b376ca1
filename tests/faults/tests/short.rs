//! The short form of the study: every class, and mixes of them.

// A helper that unwraps fails its test, as it should.
#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

use std::collections::BTreeMap;

use faults::{CLASSES, Conditions, Need, Outcome, run};
use scanner_driver::ScannerError;

/// Scans of each class.
const EACH: u64 = 20;

/// Mixes.
const MIXES: u64 = 60;

fn flawless(seed: u64) -> Vec<u8> {
    let conditions = Conditions {
        seed,
        feels_the_plug: true,
        ..Conditions::default()
    };
    let outcome = run(&conditions).expect("nothing goes wrong");
    assert_eq!((outcome.pauses, outcome.measured), (0, 50));
    outcome.journal.expect("a complete scan")
}

/// The journals of scans that nothing befalls.
fn references() -> BTreeMap<u64, Vec<u8>> {
    (0..faults::scene::count())
        .map(|seed| (seed, flawless(seed)))
        .collect()
}

/// Whether the scan is another than without faults and may be, since its object was moved before
/// it was seen.
fn check(name: &str, seed: u64, outcome: &Outcome, references: &BTreeMap<u64, Vec<u8>>) -> bool {
    let reference = &references[&(seed % faults::scene::count())];
    let same = outcome.journal.as_ref() == Some(reference);
    if outcome.moved_before_it_was_seen {
        let told = outcome.journal.is_some() || outcome.error == Some(ScannerError::Aborted);
        assert!(told, "{name}, seed {seed}: {outcome:?}");
        return !same;
    }
    assert!(same, "{name}, seed {seed}: another journal: {outcome:?}");
    false
}

#[test]
fn every_class_is_survived_and_the_journal_is_the_same() {
    let references = references();
    for class in &CLASSES {
        let (mut attended, mut struck, mut excused) = (0, 0, 0);
        for seed in 0..EACH {
            let outcome = run(&class.alone(seed)).unwrap();
            excused += u64::from(check(class.name, seed, &outcome, &references));
            struck += u64::from(class.strikes(&outcome.strikes) > 0);
            match class.need {
                Need::Nobody => {
                    assert!(
                        outcome.attended.is_empty(),
                        "{}, seed {seed}: {:?}",
                        class.name,
                        outcome.attended
                    );
                }
                Need::Person(words) => {
                    attended += outcome.attended.len();
                    for pause in &outcome.attended {
                        let text = pause.to_string();
                        assert!(text.contains(words), "{}, seed {seed}: {text}", class.name);
                    }
                }
            }
        }
        assert_eq!(class.need != Need::Nobody, attended > 0, "{}", class.name);
        // A class that misses its scans proves nothing of them.
        assert!(struck * 10 >= EACH * 8, "{}: {struck} struck", class.name);
        let most_excused = if class.name == "move-part" {
            EACH / 3
        } else {
            0
        };
        assert!(excused <= most_excused, "{}: {excused} excused", class.name);
    }
}

#[test]
fn mixes_of_faults_are_survived() {
    let references = references();
    for seed in 0..MIXES {
        let (conditions, _) = faults::class::mix(seed);
        let outcome = run(&conditions).unwrap();
        check("mix", seed, &outcome, &references);
    }
}

#[test]
fn a_seed_replays_to_the_turn() {
    let (conditions, _) = faults::class::mix(7);
    let (one, other) = (run(&conditions).unwrap(), run(&conditions).unwrap());
    assert_eq!(one.took, other.took);
    assert_eq!(one.journal, other.journal);
    assert_eq!((one.pauses, one.measured), (other.pauses, other.measured));
}

/// The first seed under which a person is needed, with that person's help.
fn attended(name: &str, change: impl Fn(&mut Conditions)) -> (u64, Outcome) {
    let class = faults::Class::named(name).unwrap();
    (0..100)
        .map(|seed| {
            let mut conditions = class.alone(seed);
            change(&mut conditions);
            (seed, run(&conditions).unwrap())
        })
        .find(|(_, outcome)| !outcome.attended.is_empty() && !outcome.moved_before_it_was_seen)
        .expect("a scan that stops")
}

#[test]
fn an_object_not_put_back_is_refused_with_its_figure() {
    let references = references();
    let (seed, outcome) = attended("move-part", |conditions| conditions.careless = true);
    check("move-part", seed, &outcome, &references);
    assert!(outcome.attended.len() >= 2, "{:?}", outcome.attended);
    for pause in &outcome.attended[..2] {
        assert!(pause.to_string().contains("mm off"), "{pause}");
    }
}

#[test]
fn an_interlock_still_open_is_refused() {
    let references = references();
    let (seed, outcome) = attended("interlock", |conditions| {
        conditions.faults.device.hold = std::time::Duration::from_secs(50);
    });
    check("interlock", seed, &outcome, &references);
    assert!(outcome.attended.len() >= 2, "{:?}", outcome.attended);
}
