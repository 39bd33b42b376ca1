//! The range image of the scan under way, as far as it has been seen.

use std::collections::BTreeMap;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Color;
use relief_api::{LiveColumn, ScanImage};

use super::colours::Depth;

/// Most columns, and nodes in one, that are kept: more than any terminal has of either.
const MOST: i64 = 600;
/// Nodes that are looked at to choose the colours.
const LOOKED_AT: usize = 5000;
/// From little to much, where there are no colours.
const SHADES: [char; 4] = ['\u{2591}', '\u{2592}', '\u{2593}', '\u{2588}'];

/// Nodes by column and row of the lattice; micrometres.
#[derive(Debug, Default)]
pub(super) struct Picture {
    /// Every so many columns and rows are kept.
    step: i64,
    columns: BTreeMap<i64, BTreeMap<i64, i32>>,
    /// The latest column: the scan grows to where it is.
    latest: Option<i64>,
    /// Columns of the scan before it, those of now, and all of them.
    progress: Option<[u32; 3]>,
}

impl Picture {
    /// Adds columns of a scan that now has so many of all columns.
    pub(super) fn push(&mut self, live: &[LiveColumn], columns: u32, planned: u32) {
        self.step = self.step.max(1);
        let [before, ..] = self.progress.unwrap_or([columns.saturating_sub(1); 3]);
        self.progress = Some([before, columns, planned]);
        for column in live {
            self.latest = Some(column.i);
            self.put(column, 1);
        }
        self.shrink();
    }

    /// Adds a range image of the scan, which is newer than what is there.
    pub(super) fn lay(&mut self, image: &ScanImage, columns: u32, planned: u32) {
        self.progress = Some([0, columns, planned]);
        let step = i64::from(image.step.max(1));
        self.step = self.step.max(1);
        if self.step % step != 0 {
            self.thin(self.step * step);
        }
        for column in &image.columns {
            self.put(column, step);
        }
        self.shrink();
    }

    /// Keeps of a column what is to be kept.
    fn put(&mut self, column: &LiveColumn, spacing: i64) {
        if column.i.rem_euclid(self.step) != 0 {
            return;
        }
        let nodes = column.z_um.iter().enumerate();
        let nodes = nodes.filter_map(|(k, um)| Some((column.j_first + k as i64 * spacing, (*um)?)));
        let kept = nodes.filter(|(j, _)| j.rem_euclid(self.step) == 0);
        self.columns.insert(column.i, kept.collect());
    }

    fn shrink(&mut self) {
        while self.is_too_large() {
            self.thin(self.step * 2);
        }
    }

    fn thin(&mut self, step: i64) {
        self.step = step;
        self.columns.retain(|i, _| i.rem_euclid(step) == 0);
        for column in self.columns.values_mut() {
            column.retain(|j, _| j.rem_euclid(step) == 0);
        }
    }

    fn is_too_large(&self) -> bool {
        let [columns, rows] = self
            .extent()
            .map_or([0; 2], |[i, j]| [i[1] - i[0], j[1] - j[0]]);
        columns.max(rows) / self.step.max(1) > MOST
    }

    /// The heights that colours tell apart, millimetres.
    pub(super) fn z_mm(&self) -> Option<[f64; 2]> {
        self.z_um().map(|z| z.map(|um| f64::from(um) * 1e-3))
    }

    /// The heights but for the lowest and the highest hundredth: one outlier would leave all others
    /// one colour.
    fn z_um(&self) -> Option<[i32; 2]> {
        let nodes: usize = self.columns.values().map(BTreeMap::len).sum();
        let heights = self.columns.values().flat_map(BTreeMap::values);
        let mut some: Vec<i32> = heights.step_by(nodes / LOOKED_AT + 1).copied().collect();
        some.sort_unstable();
        let beyond = some.len() / 100;
        let last = some.len().checked_sub(beyond + 1)?;
        Some([*some.get(beyond)?, *some.get(last)?])
    }

    /// How many are kept.
    #[cfg(test)]
    pub(super) fn nodes(&self) -> usize {
        self.columns.values().map(BTreeMap::len).sum()
    }

    /// Columns and rows from where to where; `None` where nothing was seen.
    fn extent(&self) -> Option<[[i64; 2]; 2]> {
        let (i_low, i_high) = (*self.columns.keys().next()?, *self.columns.keys().last()?);
        let rows = self.columns.values();
        let low = rows
            .clone()
            .filter_map(|column| column.keys().next())
            .min()?;
        let high = rows.filter_map(|column| column.keys().last()).max()?;
        Some([[i_low, i_high], [*low, *high]])
    }

    /// The same with the columns that are still to come, so that the picture fills a place that
    /// stays.
    fn whole(&self) -> Option<[[i64; 2]; 2]> {
        let [[low, high], rows] = self.extent()?;
        let [before, columns, planned] = self.progress.unwrap_or_default();
        let seen = f64::from(columns.saturating_sub(before).max(1));
        let left = f64::from(planned.saturating_sub(columns));
        let rest = ((high - low + self.step) as f64 * left / seen) as i64;
        let columns = if self.latest.is_some_and(|i| i - low < high - i) {
            [low - rest, high]
        } else {
            [low, high + rest]
        };
        Some([columns, rows])
    }

    /// Draws it with two nodes in each character, one above the other.
    pub(super) fn draw(&self, area: Rect, buffer: &mut Buffer, depth: Depth) {
        let (Some([[i_low, i_high], [j_low, j_high]]), Some([z_low, z_high])) =
            (self.whole(), self.z_um())
        else {
            return;
        };
        if area.is_empty() {
            return;
        }
        let [wide, high] = [i64::from(area.width), 2 * i64::from(area.height)];
        let (across, up) = (i_high - i_low + 1, j_high - j_low + 1);
        // Lattice lines in a dot, alike both ways.
        let per_dot = (across as f64 / wide as f64).max(up as f64 / high as f64);
        let range = f64::from(z_high) - f64::from(z_low);
        let share = |dot: [i64; 2]| {
            let [from, to] = [0, 1].map(|end| {
                let line = |low: i64, dot: i64| low + ((dot + end) as f64 * per_dot) as i64;
                [line(i_low, dot[0]), line(j_low, dot[1])]
            });
            let um = self.near(from, to)?;
            Some((f64::from(um) - f64::from(z_low)) / range.max(1.0))
        };
        let rows = (((up as f64 / per_dot).ceil() as i64 + 1) / 2).min(i64::from(area.height));
        for y in 0..rows {
            for x in 0..wide.min((across as f64 / per_dot).ceil() as i64) {
                let below = share([x, 2 * (rows - 1 - y)]);
                let above = share([x, 2 * (rows - 1 - y) + 1]);
                let place = (area.x + x as u16, area.y + y as u16);
                if let Some(cell) = buffer.cell_mut(place) {
                    let (symbol, front, back) = dots(above, below, depth);
                    cell.set_char(symbol).set_fg(front).set_bg(back);
                }
            }
        }
    }

    /// A node of a rectangle of lattice lines, the first that there is.
    fn near(&self, from: [i64; 2], to: [i64; 2]) -> Option<i32> {
        // A dot may be smaller than the step of what is kept: look back by one.
        let [i, j] = [0, 1].map(|d| {
            let first = from[d].div_euclid(self.step) * self.step;
            first..to[d].max(from[d] + 1)
        });
        let mut columns = self.columns.range(i).map(|(_, column)| column);
        columns.find_map(|column| column.range(j.clone()).next().map(|(_, um)| *um))
    }
}

/// A character that shows two dots, and its colours.
fn dots(above: Option<f64>, below: Option<f64>, depth: Depth) -> (char, Color, Color) {
    const UPPER: char = '\u{2580}';
    const LOWER: char = '\u{2584}';
    let colour = |share: f64| depth.colour(share);
    match (above, below) {
        (None, None) => (' ', Color::Reset, Color::Reset),
        (Some(a), Some(b)) if depth == Depth::Mono => {
            let shade = f64::midpoint(a, b) * (SHADES.len() as f64 - 0.01);
            let shade = SHADES.get(shade as usize).copied();
            (shade.unwrap_or('\u{2588}'), Color::Reset, Color::Reset)
        }
        (Some(a), Some(b)) => (UPPER, colour(a), colour(b)),
        (Some(a), None) => (UPPER, colour(a), Color::Reset),
        (None, Some(b)) => (LOWER, colour(b), Color::Reset),
    }
}
