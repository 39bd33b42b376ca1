//! Tables, over as many sheets as they need.

use super::fonts::Weight;
use super::layout::{LEADING, Layout, MARGIN, MEASURE};
use super::sheet::{BAND, FAINT, INK, RULE};
use crate::model::{Align, Table};

const SIZE: f32 = 7.4;
/// Between a cell and its neighbours.
const PAD: f32 = 4.0;
/// A column whose cells are wider than this is broken into lines first.
const WIDE: f32 = 230.0;
/// A word that is wider than this is broken.
const WORD: f32 = 92.0;

/// A row as lines of each cell.
type Row = Vec<Vec<String>>;

impl Layout {
    pub(super) fn table(&mut self, table: &Table) {
        let heads: Vec<String> = table
            .columns
            .iter()
            .map(|column| self.settable(&column.heading))
            .collect();
        let cells: Vec<Vec<String>> = table
            .rows
            .iter()
            .map(|row| {
                row.iter()
                    .map(|cell| self.settable(&cell.plain()))
                    .collect()
            })
            .collect();
        let widths = self.widths(&heads, &cells);
        let aligns: Vec<Align> = table.columns.iter().map(|column| column.align).collect();
        let head = self.broken(&heads, &widths, Weight::Bold);
        let height = |row: &Row| {
            let lines = row.iter().map(Vec::len).max().unwrap_or(1).max(1);
            lines as f32 * LEADING * SIZE + 4.0
        };
        let first = cells
            .first()
            .map(|row| self.broken(row, &widths, Weight::Regular));
        self.need(22.0 + height(&head) + first.as_ref().map_or(0.0, height));
        self.caption(&table.caption);
        self.y += 2.0;
        self.head(&head, &widths, &aligns, height(&head));
        for row in &cells {
            let row = self.broken(row, &widths, Weight::Regular);
            let deep = height(&row);
            if self.need(deep) {
                self.caption(&format!("{} (continued)", table.caption));
                self.y += 2.0;
                self.head(&head, &widths, &aligns, height(&head));
            }
            self.row(&row, &widths, &aligns, Weight::Regular);
            self.y += deep;
            self.fill([MARGIN, self.y - 0.4, MEASURE, 0.4], RULE);
        }
        self.y += 10.0;
    }

    fn head(&mut self, head: &Row, widths: &[f32], aligns: &[Align], height: f32) {
        self.fill([MARGIN, self.y, MEASURE, height], BAND);
        self.row(head, widths, aligns, Weight::Bold);
        self.y += height;
        self.fill([MARGIN, self.y - 0.8, MEASURE, 0.8], FAINT);
    }

    fn row(&mut self, row: &Row, widths: &[f32], aligns: &[Align], weight: Weight) {
        let mut left = MARGIN;
        for ((cell, width), align) in row.iter().zip(widths).zip(aligns) {
            for (index, line) in cell.iter().enumerate() {
                let x = match align {
                    Align::Left => left + PAD,
                    Align::Right => left + width - PAD - self.measure(line, SIZE, weight),
                };
                let top = self.y + 2.0 + index as f32 * LEADING * SIZE;
                self.write([x, top], line, (SIZE, weight), INK);
            }
            left += width;
        }
    }

    fn broken(&self, cells: &[String], widths: &[f32], weight: Weight) -> Row {
        let pairs = cells.iter().zip(widths);
        pairs
            .map(|(cell, width)| self.wrapped(cell, (SIZE, weight), width - 2.0 * PAD + 0.01))
            .collect()
    }

    /// Columns as wide as their cells ask for; where that is more than there is, the widest give
    /// way, and where it is less, all get their share of the rest.
    fn widths(&self, heads: &[String], cells: &[Vec<String>]) -> Vec<f32> {
        let mut least = Vec::with_capacity(heads.len());
        let mut wanted = Vec::with_capacity(heads.len());
        for (index, head) in heads.iter().enumerate() {
            let column = || cells.iter().filter_map(|row| row.get(index));
            let word = |text: &String, weight: Weight| {
                let words = text.split(' ');
                let widths = words.map(|word| self.measure(word, SIZE, weight));
                widths.fold(0.0, f32::max)
            };
            let longest_word = column()
                .map(|cell| word(cell, Weight::Regular))
                .fold(0.0, f32::max)
                .min(WORD)
                .max(word(head, Weight::Bold));
            // A head may take two lines.
            let half_head = 0.6 * self.measure(head, SIZE, Weight::Bold);
            let whole = column()
                .map(|cell| self.measure(cell, SIZE, Weight::Regular))
                .fold(half_head, f32::max);
            least.push(longest_word + 2.0 * PAD);
            wanted.push(whole.min(WIDE).max(longest_word) + 2.0 * PAD);
        }
        let sum = |widths: &[f32]| widths.iter().sum::<f32>();
        let capped = |cap: f32| -> Vec<f32> {
            let pairs = wanted.iter().zip(&least);
            pairs
                .map(|(wanted, least)| wanted.min(cap.max(*least)))
                .collect()
        };
        let mut widths = wanted.clone();
        if sum(&widths) > MEASURE {
            let (mut low, mut high) = (0.0, MEASURE);
            for _ in 0..24 {
                let cap = (low + high) / 2.0;
                if sum(&capped(cap)) > MEASURE {
                    high = cap;
                } else {
                    low = cap;
                }
            }
            widths = capped(low);
        }
        // Shrinks, too, where even the words are wider than the sheet.
        let scale = MEASURE / sum(&widths).max(1.0);
        widths.into_iter().map(|width| width * scale).collect()
    }
}
