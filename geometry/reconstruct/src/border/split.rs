//! Borders between two pieces that are a crease on a part of their way only, cut before they are
//! drawn.
//!
//! A cone stands on a surface that falls away below it: on one side its foot is a crease, on the
//! other the rim of a step. The surfaces place the crease; where they meet nowhere near, nodes and
//! samples tell alone. Taken for one crease, the border would be led straight past the step.

use nurbs::PatchSurface;

use super::cracks::{Chain, CrackMap};
use super::intersection::{CREASE, gap};
use crate::assemble::{Placement, STEP_SIGMAS};
use crate::meeting::{runs, without_short};
use crate::polygon::{minus, norm};

/// Stretches of fewer cracks go with those beside them.
const LEAST_CRACKS: usize = 12;

/// How far to one side of the cracks the line of a crease may lie in the mean, pitches: nodes know no
/// side. Where it lies farther, surfaces are carried on, as at the foot of a wall, to where nothing of
/// them was seen.
const ASIDE: f64 = 0.5;

/// Cuts the borders where the surfaces on their sides cease to meet; `surfaces[k]` belongs to piece
/// `k + 1`, with the root mean square of its residuals in millimetres.
pub(crate) fn split(
    cracks: &mut CrackMap,
    surfaces: &[(&PatchSurface, f64)],
    placement: Placement,
) {
    let surface = |piece: u32| surfaces.get((piece as usize).checked_sub(1)?).copied();
    let mut cuts = Vec::new();
    for chain in &cracks.chains {
        let sides = surface(chain.left).zip(surface(chain.right));
        cuts.push(sides.map_or_else(Vec::new, |sides| {
            let found = beside(chain, sides.into(), placement);
            let meets: Vec<Option<bool>> = found.iter().map(Beside::meets).collect();
            let cuts = places(&meets, chain.ends.is_none());
            let is_even = is_even(&found, &cuts, chain.ends.is_none());
            if is_even { cuts } else { Vec::new() }
        }));
    }
    cracks.cut(&cuts);
}

/// What the surfaces on its sides do near a crack.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Beside {
    /// They meet so far to one side, pitches.
    Meet(f64),
    /// They part by more than their residuals explain.
    Part,
    /// Neither, as beside a smooth join.
    Neither,
}

impl Beside {
    fn meets(&self) -> Option<bool> {
        match self {
            Self::Meet(_) => Some(true),
            Self::Part => Some(false),
            Self::Neither => None,
        }
    }
}

fn beside(chain: &Chain, sides: [(&PatchSurface, f64); 2], placement: Placement) -> Vec<Beside> {
    let gap = gap(sides.map(|side| side.0), placement);
    let noise_mm = STEP_SIGMAS * norm(sides.map(|side| side.1));
    let each = chain.middles.iter().map(|&middle| {
        let (gap_mm, _) = gap.height(middle);
        match gap.nearest(middle, CREASE) {
            Some(met) => Beside::Meet(norm(minus(met, middle)).copysign(gap_mm)),
            None if gap_mm.abs() > noise_mm => Beside::Part,
            None => Beside::Neither,
        }
    });
    each.collect()
}

/// Whether the line of each stretch that is a crease lies to neither side of the cracks.
fn is_even(found: &[Beside], cuts: &[usize], is_closed: bool) -> bool {
    let mut bounds = vec![0];
    bounds.extend(cuts);
    bounds.push(found.len());
    let of_bounds = bounds
        .windows(2)
        .map(|pair| found[pair[0]..pair[1]].to_vec());
    let mut stretches: Vec<Vec<Beside>> = of_bounds.collect();
    if is_closed && stretches.len() > 1 {
        let first = stretches.remove(0);
        if let Some(last) = stretches.last_mut() {
            last.extend(first);
        }
    }
    stretches.iter().all(|stretch| {
        let met = stretch.iter().filter_map(|own| match own {
            Beside::Meet(aside) => Some(*aside),
            _ => None,
        });
        let met: Vec<f64> = met.collect();
        let is_crease = 2 * met.len() > stretch.len();
        !is_crease || (met.iter().sum::<f64>() / met.len() as f64).abs() <= ASIDE
    })
}

/// Before which cracks a border is cut, ascending.
fn places(meets: &[Option<bool>], is_closed: bool) -> Vec<usize> {
    let Some(known) = meets.iter().position(Option::is_some) else {
        return Vec::new();
    };
    // A closed border is looked at from where it changes, so that no stretch goes over its end.
    let changes = |k: &usize| meets[*k] != meets[(*k + meets.len() - 1) % meets.len()];
    let begin = if is_closed {
        (0..meets.len()).find(changes).unwrap_or(0)
    } else {
        0
    };
    let mut last = meets[known];
    let mut kinds: Vec<bool> = Vec::with_capacity(meets.len());
    for k in 0..meets.len() {
        let own = meets[(begin + k) % meets.len()];
        last = own.or(last);
        kinds.push(last == Some(true));
    }
    without_short(&mut kinds, LEAST_CRACKS);
    let found = runs(&kinds);
    let mut cuts: Vec<usize> = found.iter().skip(1).map(|(from, _)| *from).collect();
    if is_closed && cuts.len() % 2 == 1 {
        cuts.push(0);
    }
    let mut cuts: Vec<usize> = cuts.iter().map(|k| (begin + k) % meets.len()).collect();
    cuts.sort_unstable();
    cuts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::border::cracks::trace;
    use crate::meeting::testing::{PLACEMENT, graph};
    use crate::pieces::{PieceLimits, PieceMap};
    use crate::testing::region_map;

    #[test]
    fn stretches_are_cut_and_what_is_short_or_unknown_goes_with_its_neighbours() {
        let of = |kinds: &[(Option<bool>, usize)], is_closed| {
            let all: Vec<Option<bool>> = kinds
                .iter()
                .flat_map(|(kind, count)| std::iter::repeat_n(*kind, *count))
                .collect();
            places(&all, is_closed)
        };
        let (meets, parts) = (Some(true), Some(false));
        assert_eq!(of(&[(meets, 30), (parts, 20)], false), [30]);
        assert_eq!(of(&[(meets, 30), (parts, 20)], true), [0, 30]);
        assert_eq!(of(&[(parts, 5), (meets, 30), (parts, 20)], true), [5, 35]);
        assert_eq!(
            of(&[(meets, 30), (None, 20), (meets, 20)], false),
            [0_usize; 0]
        );
        assert_eq!(
            of(&[(meets, 30), (parts, 11), (meets, 20)], true),
            [0_usize; 0]
        );
        assert_eq!(of(&[(None, 40)], true), [0_usize; 0]);
        assert_eq!(of(&[(None, 40), (parts, 20), (meets, 20)], false), [60]);
    }

    #[test]
    fn a_line_to_one_side_of_all_cracks_is_no_crease() {
        let with = |aside: fn(usize) -> f64| {
            let mut found: Vec<Beside> = (0..40).map(|k| Beside::Meet(aside(k))).collect();
            found.extend([Beside::Part; 20]);
            is_even(&found, &[40], false) && is_even(&found, &[0, 40], true)
        };
        assert!(with(|k| if k % 2 == 0 { 0.9 } else { -0.9 }));
        assert!(with(|_| -0.4));
        assert!(!with(|_| -0.6));
        assert!(is_even(&[Beside::Part; 20], &[], true));
    }

    #[test]
    fn a_boss_whose_foot_is_a_step_on_one_side_has_two_borders() {
        let picture: Vec<String> = (0..30)
            .map(|row| {
                let boss = |column: i32| (5..25).contains(&row) && (5..25).contains(&column);
                (0..30).map(|c| if boss(c) { 'b' } else { 'a' }).collect()
            })
            .collect();
        let rows: Vec<&str> = picture.iter().map(String::as_str).collect();
        let limits = PieceLimits {
            min_nodes: 1,
            min_hole_nodes: 1,
        };
        let pieces = PieceMap::new(&region_map(&rows), limits);
        let mut cracks = trace(&pieces);
        let whole: Vec<f64> = cracks
            .loops
            .iter()
            .flatten()
            .map(|l| cracks.area(l))
            .collect();
        let count = cracks.chains.len();
        // The foot of a pyramid, 10 mm wide; from its middle on the ground falls away.
        let boss = graph(0.5, |x, y| 5.0 - (x + 2.5).abs().max((y + 2.5).abs()));
        let ground = graph(0.5, |x, _| -2.0 * (x + 2.5).max(0.0));
        split(&mut cracks, &[(&ground, 0.01), (&boss, 0.01)], PLACEMENT);
        assert_eq!(cracks.chains.len(), count + 1);
        let of_boss = &cracks.loops[1];
        let [uses] = &of_boss[..] else {
            panic!("{of_boss:?}")
        };
        let middle = |index: usize| {
            let middles = &cracks.chains[index].middles;
            middles.iter().map(|m| m[0]).sum::<f64>() / middles.len() as f64
        };
        let mut columns: Vec<f64> = uses.iter().map(|(index, _)| middle(*index)).collect();
        columns.sort_by(f64::total_cmp);
        assert!(
            matches!(columns[..], [crease, step] if crease < 13.0 && step > 17.0),
            "{columns:?}"
        );
        let parted: Vec<f64> = cracks
            .loops
            .iter()
            .flatten()
            .map(|l| cracks.area(l))
            .collect();
        // Junctions fill two corners that middles cut off.
        for (parted, whole) in parted.iter().zip(&whole) {
            assert!((parted - whole).abs() <= 0.5, "{parted} {whole}");
        }
        assert_eq!(parted.len(), whole.len());
    }
}
