//! Classes of regions after Hoover et al. 1996, "An experimental comparison of range image
//! segmentation algorithms", section 4.
//!
//! With O the nodes common to a truth region n and a machine region m, P their sizes, and T
//! the tolerance (above 0.5):
//!
//! * **correct**: O >= T P_n and O >= T P_m;
//! * **over-segmented**: two or more machine regions, each with O >= T P_m, which together
//!   cover T P_n of one truth region;
//! * **under-segmented**: two or more truth regions, each with O >= T P_n, which together
//!   cover T P_m of one machine region;
//! * **missed**: a truth region in none of these; **noise**: a machine region in none.
//!
//! A region may stand in an instance of each kind. Then the instance whose two measures
//! (share of the truth covered, share of the machine's nodes spent on it) have the greatest
//! mean is taken; of equals correct goes before over-segmented, that before under-segmented.
//!
//! Regions smaller than a least size are not counted. They serve only where nothing else
//! accounts for a region: a crumb beside a face that was found does not make it
//! over-segmented.

use std::collections::BTreeMap;

use super::Overlaps;

/// What became of a truth region.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TruthClass {
    /// One machine region stands for it.
    Correct,
    /// Several machine regions stand for it.
    Over,
    /// A machine region stands for it and others.
    Under,
    /// Nothing stands for it.
    Missed,
}

/// What a machine region is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MachineClass {
    /// It stands for one truth region.
    Correct,
    /// It stands for a part of a truth region.
    Over,
    /// It stands for several truth regions.
    Under,
    /// It stands for nothing.
    Noise,
}

/// The class of every region, by label; those of every size.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Classes {
    /// Of the truth.
    pub truth: BTreeMap<u16, TruthClass>,
    /// Of the machine.
    pub machine: BTreeMap<u16, MachineClass>,
}

/// One way to account for some regions.
#[derive(Debug)]
struct Instance {
    class: TruthClass,
    measure: f64,
    truth: Vec<u16>,
    machine: Vec<u16>,
}

/// Classifies all regions at a tolerance (0.5 < T <= 1). `truth_counts` tells which truth
/// regions are large enough to count; machine regions count from `machine_least` nodes.
///
/// # Panics
/// When the tolerance is out of its range: a region could then match two others.
#[must_use]
pub fn classify(
    overlaps: &Overlaps,
    tolerance: f64,
    truth_counts: impl Fn(u16) -> bool,
    machine_least: usize,
) -> Classes {
    assert!(
        tolerance > 0.5 && tolerance <= 1.0,
        "the tolerance is above 0.5 and at most 1"
    );
    let mut classes = Classes::default();
    for counted_alone in [true, false] {
        let open_truth = |classes: &Classes, t: u16| {
            !classes.truth.contains_key(&t) && (!counted_alone || truth_counts(t))
        };
        let open_machine = |classes: &Classes, m: u16| {
            !classes.machine.contains_key(&m)
                && (!counted_alone || overlaps.machine_nodes(m) >= machine_least)
        };
        let pairs: Vec<_> = overlaps
            .pairs()
            .filter(|&(t, m, _)| open_truth(&classes, t) && open_machine(&classes, m))
            .collect();
        let mut instances = instances(overlaps, tolerance, &pairs);
        instances.sort_by(|a, b| {
            let by_class = a.class.cmp(&b.class).then(a.truth.cmp(&b.truth));
            b.measure.total_cmp(&a.measure).then(by_class)
        });
        for instance in instances {
            let free = instance.truth.iter().all(|t| open_truth(&classes, *t))
                && instance.machine.iter().all(|m| open_machine(&classes, *m));
            if free {
                take(&mut classes, &instance);
            }
        }
    }
    for (label, _) in overlaps.truth() {
        classes.truth.entry(label).or_insert(TruthClass::Missed);
    }
    for (label, _) in overlaps.machine() {
        classes.machine.entry(label).or_insert(MachineClass::Noise);
    }
    classes
}

fn take(classes: &mut Classes, instance: &Instance) {
    let machine = match instance.class {
        TruthClass::Correct => MachineClass::Correct,
        TruthClass::Over => MachineClass::Over,
        TruthClass::Under => MachineClass::Under,
        TruthClass::Missed => MachineClass::Noise,
    };
    let truth = instance.truth.iter().map(|t| (*t, instance.class));
    classes.truth.extend(truth);
    let labels = instance.machine.iter().map(|m| (*m, machine));
    classes.machine.extend(labels);
}

fn instances(overlaps: &Overlaps, tolerance: f64, pairs: &[(u16, u16, usize)]) -> Vec<Instance> {
    let reaches = |part: usize, whole: usize| part as f64 >= tolerance * whole as f64;
    let share = |part: usize, whole: usize| part as f64 / whole as f64;
    let mut found = Vec::new();
    let mut parts: BTreeMap<u16, Vec<(u16, usize)>> = BTreeMap::new();
    let mut wholes: BTreeMap<u16, Vec<(u16, usize)>> = BTreeMap::new();
    for &(t, m, shared) in pairs {
        let (of_truth, of_machine) = (overlaps.truth_nodes(t), overlaps.machine_nodes(m));
        let (covers, spent) = (reaches(shared, of_truth), reaches(shared, of_machine));
        if covers && spent {
            found.push(Instance {
                class: TruthClass::Correct,
                measure: (share(shared, of_truth) + share(shared, of_machine)) / 2.0,
                truth: vec![t],
                machine: vec![m],
            });
        }
        if spent {
            parts.entry(t).or_default().push((m, shared));
        }
        if covers {
            wholes.entry(m).or_default().push((t, shared));
        }
    }
    for (t, machine) in parts {
        let nodes = overlaps.truth_nodes(t);
        let together = machine.iter().map(|(_, shared)| shared).sum();
        if machine.len() >= 2 && reaches(together, nodes) {
            let each = machine.iter();
            let spent: f64 = each
                .map(|&(m, s)| share(s, overlaps.machine_nodes(m)))
                .sum();
            found.push(Instance {
                class: TruthClass::Over,
                measure: (share(together, nodes) + spent / machine.len() as f64) / 2.0,
                truth: vec![t],
                machine: machine.into_iter().map(|(m, _)| m).collect(),
            });
        }
    }
    for (m, truth) in wholes {
        let nodes = overlaps.machine_nodes(m);
        let together = truth.iter().map(|(_, shared)| shared).sum();
        if truth.len() >= 2 && reaches(together, nodes) {
            let each = truth.iter();
            let covered: f64 = each.map(|&(t, s)| share(s, overlaps.truth_nodes(t))).sum();
            found.push(Instance {
                class: TruthClass::Under,
                measure: (share(together, nodes) + covered / truth.len() as f64) / 2.0,
                truth: truth.into_iter().map(|(t, _)| t).collect(),
                machine: vec![m],
            });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of nodes from runs (truth, machine, nodes).
    fn classes(runs: &[(u16, u16, usize)], tolerance: f64, least: usize) -> Classes {
        let of = |pick: fn(&(u16, u16, usize)) -> u16| -> Vec<u16> {
            let runs = runs.iter();
            runs.flat_map(|run| std::iter::repeat_n(pick(run), run.2))
                .collect()
        };
        let overlaps = Overlaps::new(&of(|r| r.0), &of(|r| r.1));
        let counts = |t| overlaps.truth_nodes(t) >= least;
        classify(&overlaps, tolerance, counts, least)
    }

    fn truth(runs: &[(u16, u16, usize)], tolerance: f64) -> Vec<TruthClass> {
        classes(runs, tolerance, 1).truth.into_values().collect()
    }

    fn machine(runs: &[(u16, u16, usize)], tolerance: f64) -> Vec<MachineClass> {
        classes(runs, tolerance, 1).machine.into_values().collect()
    }

    #[test]
    fn the_same_regions_are_correct_whatever_their_numbers() {
        let runs = [(1, 9, 60), (2, 4, 40), (0, 0, 10)];
        assert_eq!(truth(&runs, 0.95), [TruthClass::Correct; 2]);
        assert_eq!(machine(&runs, 0.95), [MachineClass::Correct; 2]);
        assert_eq!(truth(&runs, 1.0), [TruthClass::Correct; 2]);
    }

    #[test]
    fn correct_ends_just_below_the_tolerance_of_the_truth() {
        let covered = |nodes| [(1, 1, nodes), (1, 0, 100 - nodes)];
        assert_eq!(truth(&covered(80), 0.8), [TruthClass::Correct]);
        assert_eq!(truth(&covered(79), 0.8), [TruthClass::Missed]);
        assert_eq!(machine(&covered(79), 0.8), [MachineClass::Noise]);
        assert_eq!(truth(&covered(79), 0.75), [TruthClass::Correct]);
    }

    #[test]
    fn correct_ends_just_below_the_tolerance_of_the_machine() {
        let spent = |nodes| [(1, 1, nodes), (0, 1, 100 - nodes)];
        assert_eq!(truth(&spent(80), 0.8), [TruthClass::Correct]);
        assert_eq!(truth(&spent(79), 0.8), [TruthClass::Missed]);
        assert_eq!(machine(&spent(79), 0.8), [MachineClass::Noise]);
    }

    #[test]
    fn a_face_in_pieces_is_over_segmented() {
        let runs = [(1, 1, 45), (1, 2, 40), (1, 0, 15)];
        assert_eq!(truth(&runs, 0.8), [TruthClass::Over]);
        assert_eq!(machine(&runs, 0.8), [MachineClass::Over; 2]);
        // Together they cover 85 of 100.
        assert_eq!(truth(&runs, 0.9), [TruthClass::Missed]);
        assert_eq!(machine(&runs, 0.9), [MachineClass::Noise; 2]);
    }

    #[test]
    fn a_piece_that_lies_elsewhere_does_not_count_to_the_pieces() {
        // The second piece spends 40 of 60 nodes on the face.
        let runs = [(1, 1, 60), (1, 2, 40), (0, 2, 20)];
        assert_eq!(truth(&runs, 0.65), [TruthClass::Over]);
        assert_eq!(truth(&runs, 0.8), [TruthClass::Missed]);
    }

    #[test]
    fn faces_in_one_are_under_segmented() {
        let runs = [(1, 1, 50), (2, 1, 45), (0, 1, 5)];
        assert_eq!(truth(&runs, 0.95), [TruthClass::Under; 2]);
        assert_eq!(machine(&runs, 0.95), [MachineClass::Under]);
        let runs = [(1, 1, 50), (2, 1, 45), (0, 1, 6)];
        assert_eq!(truth(&runs, 0.95), [TruthClass::Missed; 2]);
        assert_eq!(machine(&runs, 0.95), [MachineClass::Noise]);
    }

    #[test]
    fn what_nothing_stands_for_is_missed_and_what_stands_for_nothing_is_noise() {
        let runs = [(1, 0, 50), (2, 2, 50), (0, 3, 50)];
        assert_eq!(
            truth(&runs, 0.51),
            [TruthClass::Missed, TruthClass::Correct]
        );
        assert_eq!(
            machine(&runs, 0.51),
            [MachineClass::Correct, MachineClass::Noise]
        );
    }

    #[test]
    fn the_better_account_is_taken() {
        // Correct by the first alone: (0.8 + 1) / 2. By both pieces: (1 + 1) / 2.
        let runs = [(1, 1, 80), (1, 2, 20)];
        assert_eq!(truth(&runs, 0.8), [TruthClass::Over]);
        assert_eq!(machine(&runs, 0.8), [MachineClass::Over; 2]);
        // The second piece lies half elsewhere: (0.8 + 1) / 2 against none.
        let runs = [(1, 1, 80), (1, 2, 20), (0, 2, 20)];
        assert_eq!(truth(&runs, 0.8), [TruthClass::Correct]);
        assert_eq!(
            machine(&runs, 0.8),
            [MachineClass::Correct, MachineClass::Noise]
        );
        // One machine region over a large and a small face: 0.9 against 1.
        let runs = [(1, 1, 80), (2, 1, 20)];
        assert_eq!(truth(&runs, 0.8), [TruthClass::Under; 2]);
    }

    #[test]
    fn of_equal_accounts_correct_is_taken() {
        // Correct: (160/200 + 1) / 2 = 0.9. In pieces: (180/200 + (1 + 20/25) / 2) / 2 = 0.9.
        let tied = [(1, 1, 160), (1, 2, 20), (1, 0, 20), (0, 2, 5)];
        assert_eq!(truth(&tied, 0.6), [TruthClass::Correct]);
        assert_eq!(
            machine(&tied, 0.6),
            [MachineClass::Correct, MachineClass::Noise]
        );
        // One node decides either way.
        let more = [(1, 1, 160), (1, 2, 21), (1, 0, 19), (0, 2, 5)];
        assert_eq!(truth(&more, 0.6), [TruthClass::Over]);
        let less = [(1, 1, 161), (1, 2, 19), (1, 0, 20), (0, 2, 5)];
        assert_eq!(truth(&less, 0.6), [TruthClass::Correct]);
    }

    #[test]
    fn crumbs_do_not_change_what_accounts_for_a_face() {
        let runs = [(1, 1, 880), (1, 2, 120), (2, 3, 500), (3, 3, 60)];
        let all = classes(&runs, 0.8, 1);
        assert_eq!(all.truth[&1], TruthClass::Over);
        assert_eq!(all.truth[&2], TruthClass::Under);
        let counted = classes(&runs, 0.8, 121);
        assert_eq!(counted.truth[&1], TruthClass::Correct);
        assert_eq!(counted.truth[&2], TruthClass::Correct);
        assert_eq!(counted.truth[&3], TruthClass::Missed);
        assert_eq!(counted.machine[&2], MachineClass::Noise);
    }

    #[test]
    fn crumbs_serve_where_nothing_else_does() {
        // A face in crumbs is over-segmented, not missed; a crumb that found a crumb is no
        // noise; a counted face found by a machine region just too small is correct.
        let runs = [(1, 1, 75), (1, 2, 75), (2, 3, 40), (3, 4, 95), (3, 0, 5)];
        let counted = classes(&runs, 0.8, 100);
        assert_eq!(counted.truth[&1], TruthClass::Over);
        assert_eq!(counted.truth[&2], TruthClass::Correct);
        assert_eq!(counted.truth[&3], TruthClass::Correct);
        assert_eq!(counted.machine[&3], MachineClass::Correct);
        assert_eq!(counted.machine[&4], MachineClass::Correct);
    }

    #[test]
    fn a_loose_tolerance_gives_each_region_one_class() {
        let runs = [(1, 1, 51), (1, 2, 49), (2, 2, 60), (2, 3, 40)];
        let found = classes(&runs, 0.51, 1);
        // The second: (0.6 + 60/109) / 2 as one, (1 + (60/109 + 1) / 2) / 2 in pieces.
        assert_eq!(found.truth[&1], TruthClass::Correct);
        assert_eq!(found.truth[&2], TruthClass::Over);
        assert_eq!(found.machine[&1], MachineClass::Correct);
        assert_eq!(found.machine[&2], MachineClass::Over);
        assert_eq!(found.machine[&3], MachineClass::Over);
    }

    #[test]
    #[should_panic(expected = "above 0.5")]
    fn a_tolerance_of_one_half_is_refused() {
        let _ = classes(&[(1, 1, 1)], 0.5, 1);
    }
}
