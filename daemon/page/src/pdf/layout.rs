//! Where everything goes.

use super::PdfError;
use super::fonts::{Fonts, Weight};
use super::sheet::{BAND, BAR, Colour, FAINT, HEIGHT, INK, Mark, RULE, Sheets, WIDTH};
use crate::model::{Block, Chart, Fact, Level, Line, Page, Picture};
use crate::number::{grouped, ticks};
use crate::png;

/// Left and right of what is written, points.
pub(super) const MARGIN: f32 = 48.0;
/// Where it begins on a sheet.
const TOP: f32 = 62.0;
/// Where it ends.
const BOTTOM: f32 = HEIGHT - 54.0;
/// How wide it is.
pub(super) const MEASURE: f32 = WIDTH - 2.0 * MARGIN;

/// Sizes of letters.
const TEXT: f32 = 9.0;
const SMALL: f32 = 7.5;
/// From one line to the next, in sizes.
pub(super) const LEADING: f32 = 1.38;
/// From the top of a line to its base, in sizes.
const BASE: f32 = 1.02;

/// Pictures are not higher than this.
const PICTURE_HEIGHT: f32 = 318.0;

/// Sheets in the making.
pub(super) struct Layout {
    pub(super) out: Sheets,
    /// How far down the sheet everything is.
    pub(super) y: f32,
}

impl Layout {
    pub(super) fn new() -> Result<Self, PdfError> {
        Ok(Self {
            out: Sheets {
                sheets: vec![Vec::new()],
                pictures: Vec::new(),
                headings: Vec::new(),
                fonts: Fonts::new()?,
            },
            y: TOP,
        })
    }

    /// Draws on the last sheet.
    pub(super) fn draw(&mut self, mark: Mark) {
        if let Some(sheet) = self.out.sheets.last_mut() {
            sheet.push(mark);
        }
    }

    pub(super) fn fill(&mut self, place: [f32; 4], colour: Colour) {
        self.draw(Mark::Box { place, colour });
    }

    pub(super) fn turn(&mut self) {
        self.out.sheets.push(Vec::new());
        self.y = TOP;
    }

    /// Begins a new sheet if less than this is left; tells whether it did.
    pub(super) fn need(&mut self, height: f32) -> bool {
        let is_full = self.y + height > BOTTOM && self.y > TOP;
        if is_full {
            self.turn();
        }
        is_full
    }

    pub(super) fn settable(&self, text: &str) -> String {
        self.out.fonts.settable(text)
    }

    /// Width of a text, points.
    pub(super) fn measure(&self, text: &str, size: f32, weight: Weight) -> f32 {
        size * self.out.fonts.measure(text, weight)
    }

    /// Writes one line with its top left corner here. The text must be settable.
    pub(super) fn write(
        &mut self,
        [x, top]: [f32; 2],
        text: &str,
        (size, weight): (f32, Weight),
        colour: Colour,
    ) {
        let pieces = self.out.fonts.set(text, weight);
        self.draw(Mark::Letters {
            at: [x, top + BASE * size],
            size,
            colour,
            pieces,
        });
    }

    /// Lines no wider than this, broken between words, or within one that is wider.
    pub(super) fn wrapped(
        &self,
        text: &str,
        (size, weight): (f32, Weight),
        width: f32,
    ) -> Vec<String> {
        let mut lines = Vec::new();
        let mut line = String::new();
        let mut used = 0.0;
        let space = self.measure(" ", size, weight);
        for word in text.split(' ') {
            let wide = self.measure(word, size, weight);
            let gap = if line.is_empty() { 0.0 } else { space };
            if used + gap + wide <= width || (line.is_empty() && wide <= width) {
                if gap > 0.0 {
                    line.push(' ');
                }
                line.push_str(word);
                used += gap + wide;
                continue;
            }
            if !line.is_empty() {
                lines.push(core::mem::take(&mut line));
                used = 0.0;
            }
            for letter in word.chars() {
                let wide = size * self.out.fonts.width(letter, weight);
                if used + wide > width && !line.is_empty() {
                    lines.push(core::mem::take(&mut line));
                    used = 0.0;
                }
                line.push(letter);
                used += wide;
            }
        }
        lines.push(line);
        lines
    }

    /// A paragraph, from this far inside the left margin.
    fn paragraph(&mut self, text: &str, font: (f32, Weight), colour: Colour, indent: f32) {
        let text = self.settable(text);
        for line in self.wrapped(&text, font, MEASURE - indent) {
            self.need(LEADING * font.0);
            self.write([MARGIN + indent, self.y], &line, font, colour);
            self.y += LEADING * font.0;
        }
    }

    pub(super) fn caption(&mut self, text: &str) {
        self.paragraph(text, (SMALL, Weight::Regular), FAINT, 0.0);
    }

    pub(super) fn page(&mut self, page: &Page) -> Result<(), PdfError> {
        self.paragraph(&page.kind, (TEXT, Weight::Regular), FAINT, 0.0);
        self.paragraph(&page.title, (20.0, Weight::Bold), INK, 0.0);
        self.y += 4.0;
        self.verdict(page.verdict.level, &page.verdict.line);
        self.facts(&page.facts);
        for section in &page.sections {
            let first = section.blocks.first();
            let follows = match first {
                Some(Block::Picture(_)) => PICTURE_HEIGHT + 30.0,
                Some(Block::Chart(_)) => CHART + 60.0,
                _ => 46.0,
            };
            self.y += 12.0;
            self.need(34.0 + follows);
            let (heading, sheet) = (self.settable(&section.heading), self.out.sheets.len() - 1);
            self.out.headings.push((heading.clone(), sheet, self.y));
            self.fill([MARGIN, self.y, MEASURE, 0.7], RULE);
            self.y += 6.0;
            self.write([MARGIN, self.y], &heading, (12.5, Weight::Bold), INK);
            self.y += 21.0;
            for block in &section.blocks {
                self.block(block)?;
            }
        }
        Ok(())
    }

    fn block(&mut self, block: &Block) -> Result<(), PdfError> {
        match block {
            Block::Text(line) => {
                self.paragraph(&line.plain(), (TEXT, Weight::Regular), INK, 0.0);
                self.y += 5.0;
            }
            Block::Warnings(warnings) => {
                for warning in warnings {
                    self.need(LEADING * TEXT);
                    self.fill([MARGIN, self.y + 1.0, 2.5, 10.0], colour(Level::Watch));
                    self.paragraph(warning, (TEXT, Weight::Regular), INK, 9.0);
                    self.y += 3.0;
                }
            }
            Block::Facts(facts) => self.facts(facts),
            Block::Table(table) => self.table(table),
            Block::Picture(picture) => self.picture(picture)?,
            Block::Chart(chart) => self.chart(chart),
        }
        Ok(())
    }

    fn verdict(&mut self, level: Level, line: &Line) {
        let font = (10.0, Weight::Bold);
        let text = self.settable(&line.plain());
        let lines = self.wrapped(&text, font, MEASURE - 18.0);
        let height = lines.len() as f32 * LEADING * font.0 + 9.0;
        self.need(height);
        self.fill([MARGIN, self.y, MEASURE, height], BAND);
        self.fill([MARGIN, self.y, 3.5, height], colour(level));
        self.y += 4.5;
        for line in lines {
            self.write([MARGIN + 11.0, self.y], &line, font, INK);
            self.y += LEADING * font.0;
        }
        self.y += 11.0;
    }

    /// Facts in two columns; those that are long go across both.
    fn facts(&mut self, facts: &[Fact]) {
        const LABEL: f32 = 84.0;
        const GAP: f32 = 18.0;
        let font = (8.0, Weight::Regular);
        let half = (MEASURE - GAP) / 2.0;
        let mut is_left = true;
        let mut depth = 0.0_f32;
        for fact in facts {
            let (label, value) = (
                self.settable(&fact.label),
                self.settable(&fact.value.plain()),
            );
            let is_long = self.measure(&value, font.0, font.1) > 2.0 * (half - LABEL);
            if is_long && !is_left {
                self.y += depth;
                is_left = true;
            }
            let width = if is_long { MEASURE } else { half };
            let lines = self.wrapped(&value, font, width - LABEL);
            let height = lines.len() as f32 * LEADING * font.0 + 3.5;
            if is_left {
                depth = 0.0;
                self.need(height.min(HEIGHT / 2.0));
            }
            let left = if is_left { MARGIN } else { MARGIN + half + GAP };
            self.write([left, self.y], &label, font, FAINT);
            let mut top = self.y;
            for line in lines {
                if is_long && top + LEADING * font.0 > BOTTOM {
                    self.turn();
                    top = self.y;
                }
                self.write([left + LABEL, top], &line, font, INK);
                top += LEADING * font.0;
            }
            depth = depth.max(top - self.y + 3.5);
            self.fill([left, top + 1.2, width, 0.4], RULE);
            if is_long || !is_left {
                self.y += depth;
                is_left = true;
            } else {
                is_left = false;
            }
        }
        if !is_left {
            self.y += depth;
        }
        self.y += 4.0;
    }

    fn picture(&mut self, picture: &Picture) -> Result<(), PdfError> {
        let rows = png::rows(&picture.png).map_err(|source| PdfError::Picture {
            caption: picture.caption.clone(),
            source,
        })?;
        let (wide, high) = (rows.width as f32, rows.height as f32);
        let scale = (MEASURE / wide).min(PICTURE_HEIGHT / high);
        let (width, height) = (wide * scale, high * scale);
        let caption = self.settable(&picture.caption);
        let lines = self
            .wrapped(&caption, (SMALL, Weight::Regular), MEASURE)
            .len();
        self.need(height + lines as f32 * LEADING * SMALL + 12.0);
        let number = self.out.pictures.len();
        self.out.pictures.push(rows);
        let place = [MARGIN, self.y, width, height];
        self.draw(Mark::Picture { place, number });
        self.y += height + 3.0;
        self.caption(&picture.caption);
        self.y += 9.0;
        Ok(())
    }

    fn chart(&mut self, chart: &Chart) {
        let (Some(&low), Some(&high)) = (chart.limits.first(), chart.limits.last()) else {
            return;
        };
        self.need(CHART + 60.0);
        let font = (SMALL, Weight::Regular);
        let width = MEASURE - 2.0 * SIDE;
        let x = |value: f64| {
            let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
            MARGIN + SIDE + share as f32 * width
        };
        let most = chart.counts.iter().copied().max().unwrap_or(0).max(1);
        let highest = format!("highest bar: {}", grouped(most as u64));
        self.write([MARGIN + SIDE, self.y], &highest, font, FAINT);
        let floor = self.y + 12.0 + CHART;
        for (limits, count) in chart.limits.windows(2).zip(&chart.counts) {
            let &[from, to] = limits else { continue };
            let height = *count as f32 / most as f32 * CHART;
            let wide = (x(to) - x(from) - 0.4).max(0.1);
            self.fill([x(from), floor - height, wide, height], BAR);
        }
        self.fill([MARGIN + SIDE, floor, width, 0.6], FAINT);
        for (value, text) in ticks(low, high, 6) {
            self.fill([x(value), floor, 0.6, 4.0], FAINT);
            let left = x(value) - self.measure(&text, font.0, font.1) / 2.0;
            self.write([left, floor + 4.0], &text, font, FAINT);
        }
        for mark in &chart.marks {
            if (low..=high).contains(&mark.at) {
                self.fill([x(mark.at), floor - CHART, 0.9, CHART], colour(Level::Bad));
                let label = self.settable(&mark.label);
                let left = x(mark.at) - self.measure(&label, font.0, font.1) / 2.0;
                self.write([left, floor - CHART - 12.0], &label, font, FAINT);
            }
        }
        let scale = self.settable(&chart.scale);
        let left = MARGIN + (MEASURE - self.measure(&scale, font.0, font.1)) / 2.0;
        self.write([left, floor + 15.0], &scale, font, FAINT);
        self.y = floor + 29.0;
        self.caption(&chart.caption);
        self.y += 9.0;
    }

    /// Heads and feet; what they say of the number of sheets is known only now.
    pub(super) fn finish(mut self, page: &Page) -> Sheets {
        let font = (SMALL, Weight::Regular);
        let [year, month, day, hour, minute, _] = page.date;
        let head = format!(
            "{}  |  {}  |  {year:04}-{month:02}-{day:02} {hour:02}:{minute:02} UTC",
            page.title, page.kind
        );
        let head = self.settable(&head);
        let head = self.wrapped(&head, font, MEASURE).swap_remove(0);
        let producer = self.settable(&page.producer);
        let sheets = core::mem::take(&mut self.out.sheets);
        let all = sheets.len();
        for (index, sheet) in sheets.into_iter().enumerate() {
            self.out.sheets.push(sheet);
            self.write([MARGIN, 30.0], &head, font, FAINT);
            self.fill([MARGIN, 44.0, MEASURE, 0.5], RULE);
            self.write([MARGIN, HEIGHT - 40.0], &producer, font, FAINT);
            let number = format!("Page {} of {all}", index + 1);
            let left = MARGIN + MEASURE - self.measure(&number, font.0, font.1);
            self.write([left, HEIGHT - 40.0], &number, font, FAINT);
        }
        self.out
    }
}

/// Height of a chart's bars.
const CHART: f32 = 96.0;
/// Room left and right of them.
const SIDE: f32 = 16.0;

fn colour(level: Level) -> Colour {
    match level {
        Level::Good => [0.10, 0.50, 0.22],
        Level::Watch => [0.70, 0.46, 0.05],
        Level::Bad => [0.70, 0.15, 0.12],
    }
}
