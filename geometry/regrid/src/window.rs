//! The columns that the nodes of one grid column may draw on.

use crate::settings::RegridSettings;
use crate::strip::{Strip, at_rank, lower_median, typical};

/// Within a window the local sample spacing is believed up to this many times the median
/// one, which bounds the area a node has to look at.
const SPACING_LIMIT: f64 = 4.0;
/// It is also believed only up to this many times the spacing for which the pitch would be
/// about right. Where a window holds stray samples alone, their distances say nothing.
const PITCH_LIMIT: f64 = 4.0;
/// A node's window may show samples to be thinner than their distances along columns say,
/// up to this factor.
const WIDENING_LIMIT: f64 = 2.0;

/// Samples count as at most so many times as far apart one way as the other: where they are much
/// denser one way, all that are nearest to a node would lie in one line, on which no plane stands.
const LONGEST_CELL: f64 = 4.0;

/// Columns within reach of a grid column, and what follows from them for all its nodes.
#[derive(Debug)]
pub(crate) struct Window<'a> {
    /// In ascending x: up to `reach_columns` on each side of the grid column, and one at
    /// its very x.
    pub(crate) strips: &'a [Strip],
    /// Typical distance of neighbouring columns, millimetres.
    pub(crate) column_spacing_mm: f64,
    /// How many times as far as in y samples count in x when the nearest are looked for.
    pub(crate) stretch: f64,
    /// Greatest local sample spacing believed, millimetres.
    pub(crate) greatest_sample_spacing_mm: f64,
    /// How far in y a node's window reaches, millimetres.
    pub(crate) reach_y_mm: f64,
}

impl<'a> Window<'a> {
    /// The window of the columns of which `strips` is a part that goes far enough, in
    /// ascending x. `None` where no plane could be found: fewer than two columns, or no
    /// two samples in any of them.
    pub(crate) fn new(
        strips: &'a [Strip],
        x_mm: f64,
        settings: &RegridSettings,
        gaps: &mut Gaps,
    ) -> Option<Self> {
        let strips = around(strips, settings.reach_columns, x_mm);
        let column_spacing_mm = gaps.column_spacing(strips)?;
        let sample_spacing_mm = gaps.sample_spacing(strips)?;
        let pitch_mm = settings.pitch_mm;
        let suited_mm = (pitch_mm * pitch_mm / column_spacing_mm)
            .max(pitch_mm)
            .max(column_spacing_mm);
        let limit_mm = PITCH_LIMIT * suited_mm;
        let sample_spacing_mm = sample_spacing_mm.min(limit_mm);
        let mut stretch = stretch(column_spacing_mm, sample_spacing_mm);
        if stretch != 1.0 {
            // A crowded column must not speak for all.
            let of_columns_mm = gaps.spacing_of_columns(strips)?.min(limit_mm);
            stretch = self::stretch(column_spacing_mm, of_columns_mm);
            if stretch > 1.0 {
                // Of columns that are hardly filled it takes several for one, and most samples
                // are of the others.
                let of_most_mm = sample_spacing_mm.min(of_columns_mm);
                let of_full_mm = column_spacing_mm / filled(strips, of_most_mm);
                stretch = self::stretch(of_full_mm, of_most_mm).max(1.0);
            }
        }
        Some(Self {
            strips,
            column_spacing_mm,
            stretch,
            greatest_sample_spacing_mm: (SPACING_LIMIT * sample_spacing_mm).min(limit_mm),
            reach_y_mm: settings.reach_columns as f64 * column_spacing_mm.max(sample_spacing_mm),
        })
    }

    /// The unit of support lengths in x and y where samples are this far apart in a column.
    pub(crate) fn spacing(&self, sample_spacing_mm: f64) -> Spacing {
        let mean_mm = (self.column_spacing_mm * sample_spacing_mm).sqrt();
        Spacing {
            mean_mm,
            x_mm: mean_mm.max(self.column_spacing_mm),
            y_mm: mean_mm.max(0.5 * sample_spacing_mm),
            stretch: self.stretch,
        }
    }

    /// The greatest unit that any node of this window may have.
    pub(crate) fn greatest_spacing(&self) -> Spacing {
        self.spacing(self.greatest_sample_spacing_mm)
    }

    /// The spacing widened to this mean one, within the window's limits. Columns made from
    /// a cloud may be full in one place and empty beside it, which distances along the full
    /// ones do not show.
    pub(crate) fn widened(&self, spacing: Spacing, mean_mm: f64) -> Spacing {
        let limit_mm = (WIDENING_LIMIT * spacing.mean_mm).min(self.greatest_spacing().mean_mm);
        let mean_mm = mean_mm.min(limit_mm).max(spacing.mean_mm);
        Spacing {
            mean_mm,
            x_mm: spacing.x_mm.max(mean_mm),
            y_mm: spacing.y_mm.max(mean_mm),
            stretch: spacing.stretch,
        }
    }
}

/// Share of their length on which columns have samples, if these are so far apart: columns made
/// from the points of a cloud may have all of a beam's or a few strays.
fn filled(strips: &[Strip], sample_spacing_mm: f64) -> f64 {
    let (mut filled_mm, mut length_mm) = (0.0, 0.0);
    for strip in strips {
        if let [first, .., last] = strip.samples.as_slice() {
            filled_mm += (strip.samples.len() - 1) as f64 * sample_spacing_mm;
            length_mm += last.0 - first.0;
        }
    }
    if filled_mm < length_mm {
        filled_mm / length_mm
    } else {
        1.0
    }
}

/// How many times as far as in y samples count in x that are so far apart.
fn stretch(column_spacing_mm: f64, sample_spacing_mm: f64) -> f64 {
    let long = sample_spacing_mm / (LONGEST_CELL * column_spacing_mm);
    let wide = LONGEST_CELL * sample_spacing_mm / column_spacing_mm;
    if long > 1.0 { long } else { wide.min(1.0) }
}

/// Finds distances of neighbours; what is found for one window makes the next one faster.
#[derive(Debug, Default)]
pub(crate) struct Gaps {
    lengths: Vec<f64>,
    /// Spacings of columns.
    columns: Vec<f64>,
    /// The median sample spacing of the window before.
    before_mm: f64,
}

/// The median sample spacing is looked for within this share of that of the window before.
const NEAR: f64 = 1.0 / 128.0;

impl Gaps {
    /// The typical distance of neighbouring columns.
    fn column_spacing(&mut self, strips: &[Strip]) -> Option<f64> {
        let gaps = strips.windows(2).map(|pair| pair[1].x_mm - pair[0].x_mm);
        self.lengths.clear();
        self.lengths.extend(gaps);
        // In an order that a mirrored scan shares, so that the sum is the same.
        self.lengths.sort_unstable_by(f64::total_cmp);
        typical(&mut self.lengths)
    }

    /// The median distance of neighbours along columns, of those that differ in y.
    fn sample_spacing(&mut self, strips: &[Strip]) -> Option<f64> {
        let near = [1.0 - NEAR, 1.0 + NEAR].map(|share| share * self.before_mm);
        let median = match self.median_within(strips, near) {
            Some(median) => median,
            None => self.median_within(strips, [0.0, f64::INFINITY])?,
        };
        self.before_mm = median;
        Some(median)
    }

    /// The median of the columns' own median distances.
    fn spacing_of_columns(&mut self, strips: &[Strip]) -> Option<f64> {
        self.columns.clear();
        for strip in strips {
            let above = strip.samples.get(1..).unwrap_or_default();
            let gaps = strip
                .samples
                .iter()
                .zip(above)
                .map(|(low, high)| high.0 - low.0);
            self.lengths.clear();
            self.lengths.extend(gaps.filter(|gap| *gap > 0.0));
            self.columns.extend(lower_median(&mut self.lengths));
        }
        lower_median(&mut self.columns)
    }

    /// The same if it is within these limits.
    fn median_within(&mut self, strips: &[Strip], [low_mm, high_mm]: [f64; 2]) -> Option<f64> {
        let most = strips.iter().map(|s| s.samples.len()).sum();
        if self.lengths.len() < most {
            self.lengths.resize(most, 0.0);
        }
        // Without branches, for which lengths are within the limits is hard to foresee.
        let (mut all, mut below, mut within) = (0, 0, 0);
        for strip in strips {
            let above = strip.samples.get(1..).unwrap_or_default();
            for ((low, _), (high, _)) in strip.samples.iter().zip(above) {
                let gap = high - low;
                let is_gap = gap > 0.0;
                all += usize::from(is_gap);
                below += usize::from(is_gap & (gap < low_mm));
                if let Some(place) = self.lengths.get_mut(within) {
                    *place = gap;
                }
                within += usize::from(is_gap & (gap >= low_mm) & (gap <= high_mm));
            }
        }
        let rank = (usize::checked_sub(all, 1)? / 2).checked_sub(below)?;
        at_rank(self.lengths.get_mut(..within)?, rank)
    }
}

/// The strips nearest to this x, up to so many on either side and one at that very x, of strips in
/// ascending x.
pub(crate) fn around(strips: &[Strip], number: usize, x_mm: f64) -> &[Strip] {
    let left = strips.partition_point(|s| s.x_mm < x_mm);
    let right = strips.partition_point(|s| s.x_mm <= x_mm);
    let end = right.saturating_add(number).min(strips.len());
    &strips[left.saturating_sub(number)..end]
}

/// Local spacing of samples, millimetres.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spacing {
    /// Side of the square that holds one sample on average.
    pub(crate) mean_mm: f64,
    /// Unit of support lengths in x.
    pub(crate) x_mm: f64,
    /// Unit of support lengths in y.
    pub(crate) y_mm: f64,
    /// That of the window.
    pub(crate) stretch: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_spacing_is_that_of_all_whatever_the_window_before() {
        let strip = |x_mm: f64, shares: &[f64]| {
            let mut y = 0.0;
            let heights = shares.iter().map(|gap| {
                y += gap;
                (y, 1.0)
            });
            Strip {
                x_mm,
                samples: heights.collect(),
            }
        };
        let strips = [
            strip(0.0, &[0.0, 1.0, 1.01, 0.0, 1.02]),
            strip(1.0, &[]),
            strip(2.0, &[5.0, 0.99, 3.0, 0.0]),
        ];
        // 0.99, 1.0, 1.01, 1.02 and 3.0 apart, but for rounding.
        for before_mm in [0.0, 0.5, 0.99, 1.01, 1.02, 3.0, 1e9] {
            let mut gaps = Gaps {
                before_mm,
                ..Gaps::default()
            };
            let found = gaps.sample_spacing(&strips).unwrap();
            assert!((found - 1.01).abs() < 1e-12, "{before_mm} {found}");
            assert_eq!(gaps.sample_spacing(&strips[1..2]), None);
        }
    }

    #[test]
    fn a_crowded_column_stretches_no_window() {
        let strip = |k: i32, number: i32| Strip {
            x_mm: f64::from(k),
            samples: (0..number)
                .map(|j| (20.0 * f64::from(j) / f64::from(number), 0.0))
                .collect(),
        };
        let settings = RegridSettings::with_pitch(2.0);
        let stretch = |numbers: [i32; 7]| {
            let strips: Vec<Strip> = (0..).zip(numbers).map(|(k, n)| strip(k, n)).collect();
            Window::new(&strips, 3.0, &settings, &mut Gaps::default())
                .unwrap()
                .stretch
        };
        assert_eq!(stretch([20; 7]), 1.0);
        assert_eq!(stretch([20, 20, 20, 100_000, 20, 20, 20]), 1.0);
        assert!((stretch([200; 7]) - 0.4).abs() < 1e-9);
        // Four columns from one sample to the next are the most that does not stretch.
        assert_eq!(stretch([5; 7]), 1.0);
        assert!(stretch([4; 7]) > 1.2);
        // Two columns of strays for each full one: those are 3 mm apart.
        let of_cloud = |spacing_mm: f64| {
            let strips: Vec<Strip> = (0..9)
                .map(|k| Strip {
                    x_mm: f64::from(k),
                    samples: match k % 3 {
                        0 => (0..40).map(|j| (spacing_mm * f64::from(j), 0.0)).collect(),
                        _ => [2.0, 80.0, 39.0 * spacing_mm].map(|y| (y, 0.0)).to_vec(),
                    },
                })
                .collect();
            let window = Window::new(&strips, 4.0, &settings, &mut Gaps::default());
            window.unwrap().stretch
        };
        assert_eq!(of_cloud(6.0), 1.0);
        assert!(of_cloud(16.0) > 1.2);
    }

    #[test]
    fn strips_around_are_those_on_either_side_and_the_one_between() {
        let strips: Vec<Strip> = (0..9)
            .map(|k| Strip {
                x_mm: f64::from(k),
                samples: Vec::new(),
            })
            .collect();
        let around = |number, x_mm| -> Vec<f64> {
            let around = around(&strips, number, x_mm);
            around.iter().map(|s| s.x_mm).collect()
        };
        assert_eq!(around(2, 4.0), [2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(around(2, 4.5), [3.0, 4.0, 5.0, 6.0]);
        assert_eq!(around(2, -7.0), [0.0, 1.0]);
        assert_eq!(around(1, 8.0), [7.0, 8.0]);
        assert_eq!(around(usize::MAX, 3.0).len(), 9);
    }
}
