//! The search against its definition.

use super::*;
use crate::settings::RegridSettings;
use crate::window::{Gaps, Window};

/// Uniform numbers below 1.
struct Uniform(u64);

impl Uniform {
    fn draw(&mut self) -> f64 {
        let state = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = state.wrapping_add(1_442_695_040_888_963_407);
        f64::from((self.0 >> 40) as u32) / f64::from(1_u32 << 24)
    }
}

/// How samples lie in a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Pattern {
    /// On a lattice: ties wherever one looks.
    Lattice,
    /// On a lattice, some of them twice with the same z and some with another.
    Double,
    Scattered,
    /// Most in a few places, some columns without any.
    Clumped,
    /// Many more in a column than columns.
    Dense,
    /// Many more columns than samples in one.
    Sparse,
}

impl Pattern {
    const ALL: [Self; 6] = [
        Self::Lattice,
        Self::Double,
        Self::Scattered,
        Self::Clumped,
        Self::Dense,
        Self::Sparse,
    ];

    fn strips(self, random: &mut Uniform) -> Vec<Strip> {
        let strip = |k: u32| {
            let jitter = match self {
                Self::Scattered | Self::Clumped => 0.8 * random.draw(),
                _ => 0.0,
            };
            let mut samples: Vec<(f64, f64)> = (0..40)
                .filter(|j| self != Self::Clumped || (k % 4 != 1 && j % 13 < 4))
                .flat_map(|j| {
                    let row = f64::from(j);
                    let z = f64::from(j % 3);
                    match self {
                        Self::Lattice => vec![(row, z)],
                        Self::Sparse => vec![(9.0 * row, z)],
                        Self::Double if j % 5 == 0 => vec![(row, z), (row, z), (row, z + 1.0)],
                        Self::Double => vec![(row, z)],
                        Self::Scattered => vec![(40.0 * random.draw(), z)],
                        Self::Clumped => vec![(row + 3.0 * random.draw(), z)],
                        Self::Dense => vec![(0.1 * row + 18.0, z), (row, z)],
                    }
                })
                .collect();
            samples.sort_by(|s, t| s.0.total_cmp(&t.0).then(s.1.total_cmp(&t.1)));
            let x_mm = f64::from(k) + jitter;
            Strip { x_mm, samples }
        };
        (0..24).map(strip).collect()
    }
}

/// Downwards from the node, then upwards.
fn turn(n: &Neighbour) -> (bool, usize) {
    let is_above = n.dy >= 0.0;
    (
        is_above,
        if is_above {
            n.index
        } else {
            usize::MAX - n.index
        },
    )
}

/// Of each strip the nearest within the window's reach, those below first where two are as near,
/// at most half of `number`; of all of them the first in their order.
fn by_definition(
    window: &Window<'_>,
    [x_mm, y_mm]: [f64; 2],
    number: usize,
) -> Vec<(usize, usize)> {
    let farthest = |far: f64, own: &Strip| far.max((own.x_mm - x_mm).abs());
    let reach_x_mm = window.strips.iter().fold(0.0, farthest) * window.stretch;
    // Samples at the very corners of the reach are within it or not as rounding has it.
    let reach_mm = (reach_x_mm * reach_x_mm + window.reach_y_mm * window.reach_y_mm).sqrt();
    let mut all = Vec::new();
    for (strip, own) in window.strips.iter().enumerate() {
        let dx = own.x_mm - x_mm;
        let dx2 = (dx * window.stretch) * (dx * window.stretch);
        let height_mm = height(reach_mm * reach_mm, dx2).min(window.reach_y_mm);
        let mut samples: Vec<Neighbour> = own
            .samples
            .iter()
            .enumerate()
            .map(|(index, (y, z))| Neighbour {
                strip,
                index,
                distance2: dx2 + (y - y_mm) * (y - y_mm),
                ..Neighbour::at(dx, y - y_mm, *z)
            })
            .filter(|n| n.dy.abs() <= height_mm)
            .collect();
        samples.sort_by_key(turn);
        samples.sort_by(|s, t| s.dy.abs().total_cmp(&t.dy.abs()));
        samples.truncate(number.div_ceil(2));
        samples.sort_by_key(turn);
        all.append(&mut samples);
    }
    all.sort_by(Neighbour::order);
    all.truncate(number);
    all.iter().map(|n| (n.strip, n.index)).collect()
}

#[test]
fn the_nearest_are_those_by_definition() {
    let mut search = Search::default();
    let mut random = Uniform(1);
    for pattern in Pattern::ALL {
        let strips = pattern.strips(&mut random);
        for reach_columns in [1, 3, 8, 30] {
            let settings = RegridSettings {
                reach_columns,
                ..RegridSettings::with_pitch(0.75)
            };
            for (number, x_mm) in [(6, 0.0), (8, 7.3), (17, 11.5), (32, 12.0), (72, 23.5)] {
                // Where there are few columns within reach there may be no window.
                let window = Window::new(&strips, x_mm, &settings, &mut Gaps::default());
                let Some(window) = window else { continue };
                search.begin(&window, x_mm);
                for node in 0..70 {
                    let y_mm = 0.75 * f64::from(node) - 5.0;
                    let told = |found: &[Neighbour]| -> Vec<(usize, usize)> {
                        found.iter().map(|n| (n.strip, n.index)).collect()
                    };
                    let what = (pattern, reach_columns, number, x_mm, y_mm);
                    let defined = by_definition(&window, [x_mm, y_mm], number);
                    let found = told(search.nearest(&window, y_mm, number));
                    assert_eq!(found, defined, "{what:?}");
                    if node % 7 == 0 {
                        let wider = told(search.wider(&window, y_mm, 5 * number));
                        let defined = by_definition(&window, [x_mm, y_mm], 5 * number);
                        assert_eq!(wider, defined, "wider {what:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_node_is_near_samples_by_definition() {
    let mut search = Search::default();
    let mut random = Uniform(2);
    let settings = RegridSettings::with_pitch(1.0);
    for pattern in Pattern::ALL {
        let strips = pattern.strips(&mut random);
        let window = Window::new(&strips, 9.4, &settings, &mut Gaps::default()).unwrap();
        for within in [[1.0, 0.5], [2.0, 1.5], [0.1, 1.0], [2.5, 0.01]] {
            search.begin(&window, 9.4);
            let near = || {
                let is_near = |s: &&Strip| (s.x_mm - 9.4).abs() <= within[0];
                let near = window.strips.iter().filter(is_near);
                near.flat_map(|s| &s.samples).map(|s| s.0)
            };
            let lowest = near().min_by(f64::total_cmp);
            assert_eq!(search.lowest(&window, within[0]), lowest);
            for node in 0..60 {
                let y_mm = 0.8 * f64::from(node) - 3.0;
                let above = near().filter(|y| *y >= y_mm).min_by(f64::total_cmp);
                let defined = if near().any(|y| (y - y_mm).abs() <= within[1]) {
                    Near::Some
                } else {
                    above.map_or(Near::Nothing, Near::Above)
                };
                let found = search.near(&window, y_mm, within);
                assert_eq!(found, defined, "{pattern:?} {within:?} {y_mm}");
            }
        }
    }
}
