//! What is drawn on sheets of paper.

use super::fonts::Piece;
use crate::png::Rows;

/// A4, points.
pub(super) const WIDTH: f32 = 595.276;
pub(super) const HEIGHT: f32 = 841.89;

/// Red, green and blue, 0 to 1.
pub(super) type Colour = [f32; 3];

pub(super) const INK: Colour = [0.11, 0.14, 0.16];
pub(super) const FAINT: Colour = [0.35, 0.39, 0.43];
pub(super) const RULE: Colour = [0.8, 0.82, 0.85];
pub(super) const BAND: Colour = [0.955, 0.965, 0.973];
pub(super) const BAR: Colour = [0.29, 0.49, 0.70];

/// One thing drawn. Places are in points from the upper left corner of the sheet.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Mark {
    /// Letters, at the left end of their base line.
    Letters {
        at: [f32; 2],
        size: f32,
        colour: Colour,
        pieces: Vec<Piece>,
    },
    /// A filled rectangle: left, top, width, height.
    Box { place: [f32; 4], colour: Colour },
    /// A picture, by its number.
    Picture { place: [f32; 4], number: usize },
}

/// Everything that is drawn, sheet by sheet.
pub(super) struct Sheets {
    pub(super) sheets: Vec<Vec<Mark>>,
    pub(super) pictures: Vec<Rows>,
    /// Where each section begins: heading, sheet, and how far down.
    pub(super) headings: Vec<(String, usize, f32)>,
    pub(super) fonts: super::fonts::Fonts,
}
