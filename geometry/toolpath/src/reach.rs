//! The least that a cutter could leave at a place, had it been everywhere: it stands on the surface, and
//! does not fit all of its creases.

use crate::cutter::Cutter;
use crate::surface::Surface;

/// Directions in which a better place is sought, turned by a part of a circle after each round.
const DIRECTIONS: u32 = 8;
const TURN: f64 = 0.3;
/// Least step of the search, as a share of the cutter's radius.
const LEAST_STEP: f64 = 3e-5;

/// The least height that is left at a place, and the tip that leaves it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reach {
    pub(crate) height_mm: f64,
    pub(crate) tip_mm: [f64; 2],
}

/// Searches from a tip on, by steps that begin with `step_mm`. What it finds is no lower than what
/// there is; in a bent groove it may be higher.
pub(crate) fn least(
    surface: &Surface,
    cutter: &Cutter,
    at: [f64; 2],
    from: [f64; 2],
    step_mm: f64,
) -> Option<Reach> {
    let leaves = |tip: [f64; 2]| {
        let rho = libm::hypot(tip[0] - at[0], tip[1] - at[1]);
        let above = cutter.height_mm(rho)?;
        Some(surface.drop_cutter(cutter, tip)?.z_mm + above)
    };
    let mut best = Reach {
        height_mm: leaves(from)?,
        tip_mm: from,
    };
    let shortest = LEAST_STEP * cutter.radius_mm();
    let mut step = step_mm.max(shortest);
    let mut turned = 0.0;
    let mut first = 0;
    while step >= shortest {
        let mut has_moved = false;
        for k in 0..DIRECTIONS {
            // Where it went on before it goes on best.
            let k = (first + k) % DIRECTIONS;
            let angle = turned + core::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS);
            let (sine, cosine) = libm::sincos(angle);
            let tip = [best.tip_mm[0] + step * cosine, best.tip_mm[1] + step * sine];
            if let Some(height_mm) = leaves(tip)
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
            step *= 0.5;
            turned += TURN;
        }
    }
    Some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

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
        // Its centre is over the groove at 2 sqrt(2).
        let centre = 2.0 * core::f64::consts::SQRT_2;
        for (y, least_mm) in [(0.0, centre - 2.0), (1.0, centre - 3.0_f64.sqrt()), (3.0, 3.0)] {
            let found = least(&surface, &cutter, [0.3, y], [0.1, y + 0.4], 0.2).unwrap();
            assert!((found.height_mm - least_mm).abs() < 1e-6, "{y}: {found:?}");
        }
    }
}
