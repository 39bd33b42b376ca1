//! The least that a cutter could leave at a place, had it been everywhere: it stands on the surface, and
//! does not fit all of its creases.

use crate::cutter::Cutter;

/// Directions in which a better place is sought besides that of the valley in which it is, turned by a
/// part of a circle after each round.
const DIRECTIONS: u32 = 8;
const TURN: f64 = 0.3;

/// The least height that is left at a place, and the tip that leaves it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reach {
    pub(crate) height_mm: f64,
    pub(crate) tip_mm: [f64; 2],
}

/// Searches from the best of some tips on, of equal ones the first, by steps that begin with `step_mm` and
/// end with `shortest_mm`, or when what was found and the step are `enough`; the step is endless until the
/// search has come to a first halt.
/// What it finds is no lower than what there is; in a groove it may be a little higher. `height` is that of
/// the tip where it may stand and is below some height.
pub(crate) fn least(
    height: &dyn Fn([f64; 2], f64) -> Option<f64>,
    cutter: &Cutter,
    at: [f64; 2],
    starts: &[[f64; 2]],
    [step_mm, shortest_mm]: [f64; 2],
    enough: &dyn Fn(&Reach, f64) -> bool,
) -> Option<Reach> {
    let leaves = |tip: [f64; 2], below_mm: f64| {
        let rho = libm::hypot(tip[0] - at[0], tip[1] - at[1]);
        let above = cutter.height_mm(rho)?;
        Some(height(tip, below_mm - above)? + above)
    };
    let mut step = step_mm.max(shortest_mm);
    let mut begun: Option<Reach> = None;
    for tip in starts {
        if begun.is_some_and(|begun| enough(&begun, f64::INFINITY)) {
            break;
        }
        // One that is hardly lower is no better.
        let below_mm = begun.map_or(f64::INFINITY, |begun| begun.height_mm - shortest_mm);
        if let Some(height_mm) = leaves(*tip, below_mm)
            && height_mm < below_mm
        {
            begun = Some(Reach {
                height_mm,
                tip_mm: *tip,
            });
        }
    }
    let mut best = begun?;
    let mut turned = 0.0;
    let mut first = 0;
    // Where it came to a halt before: from there to where it is now leads along a valley.
    let mut halt = best.tip_mm;
    let mut valley = None;
    // Steps of some length may lead on and on: how much is still to be gained is known after a halt.
    let mut left_mm = f64::INFINITY;
    while step >= shortest_mm && !enough(&best, left_mm) {
        let mut has_moved = false;
        for k in 0..DIRECTIONS + 2 {
            // Where it went on before it goes on best.
            let k = (first + k) % (DIRECTIONS + 2);
            let angle = match (k.checked_sub(DIRECTIONS), valley) {
                (Some(_), None) => continue,
                (Some(side), Some(angle)) => angle + core::f64::consts::PI * f64::from(side),
                (None, _) => turned + core::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS),
            };
            let (sine, cosine) = libm::sincos(angle);
            let tip = [best.tip_mm[0] + step * cosine, best.tip_mm[1] + step * sine];
            if let Some(height_mm) = leaves(tip, best.height_mm)
                && height_mm < best.height_mm
            {
                best = Reach {
                    height_mm,
                    tip_mm: tip,
                };
                (has_moved, first) = (true, k);
                break;
            }
        }
        if !has_moved {
            let way = [best.tip_mm[0] - halt[0], best.tip_mm[1] - halt[1]];
            if way != [0.0; 2] {
                (valley, halt) = (Some(libm::atan2(way[1], way[0])), best.tip_mm);
            }
            step *= 0.5;
            left_mm = step;
            turned += TURN;
        }
    }
    Some(best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Surface;

    /// A groove along x with sides that rise by 1 in 1.
    fn groove() -> Surface {
        let vertices = [
            [-9.0, -9.0, 9.0],
            [9.0, -9.0, 9.0],
            [-9.0, 0.0, 0.0],
            [9.0, 0.0, 0.0],
            [-9.0, 9.0, 9.0],
            [9.0, 9.0, 9.0],
        ];
        let triangles = [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]];
        Surface::new(&vertices, &triangles).unwrap()
    }

    #[test]
    fn a_ball_in_a_groove_leaves_what_it_does_not_fit() {
        let cutter = Cutter::ball(4.0).unwrap();
        let surface = groove();
        let height = |at: [f64; 2], below: f64| {
            let contact = surface.drop_below(&cutter, at, below)?;
            Some(contact.z_mm)
        };
        // Its centre is over the groove at 2 sqrt(2).
        let centre = 2.0 * core::f64::consts::SQRT_2;
        for (y, least_mm) in [
            (0.0, centre - 2.0),
            (1.0, centre - 3.0_f64.sqrt()),
            (3.0, 3.0),
        ] {
            let steps = [0.2, 1e-5];
            let never = |_: &Reach, _| false;
            let found =
                least(&height, &cutter, [0.3, y], &[[0.1, y + 0.4]], steps, &never).unwrap();
            assert!((found.height_mm - least_mm).abs() < 2e-5, "{y}: {found:?}");
        }
    }

    #[test]
    fn a_search_that_has_not_halted_yet_is_not_ended() {
        let cutter = Cutter::flat(4.0).unwrap();
        // A slope: the least is left by the tip that has the place at its rim.
        let height = |at: [f64; 2], below: f64| Some(0.8 * (at[1] + 2.0)).filter(|z| *z < below);
        let enough = |_: &Reach, left_mm: f64| left_mm <= 0.2;
        let found = |starts: &[[f64; 2]]| {
            let found = least(&height, &cutter, [0.0; 2], starts, [0.2, 1e-5], &enough);
            found.unwrap().height_mm
        };
        assert!(found(&[[0.0, 0.0]]) < 0.8);
        // It goes on from the best start, and one that does not reach the place is none.
        assert!(found(&[[0.0, 1.9], [0.0, -1.95], [0.0, -2.1]]) < 0.0401);
    }
}
