//! The letters there are, how wide they are, and which of them a file needs.

use std::collections::BTreeMap;

use subsetter::GlyphRemapper;
use ttf_parser::{Face, GlyphId};

use super::PdfError;
use crate::letters::{by_number, visible};

/// Light or heavy letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Weight {
    Regular,
    Bold,
}

const NAMES: [&str; 3] = ["NotoSans-Regular", "NotoSans-Bold", "NotoSansKR-Hangul"];
const FILES: [&[u8]; 3] = [
    include_bytes!("../../fonts/NotoSans-Regular.ttf"),
    include_bytes!("../../fonts/NotoSans-Bold.ttf"),
    include_bytes!("../../fonts/NotoSansKR-Hangul.otf"),
];
/// Letters that neither of the others has; it has one weight only.
const FALLBACK: usize = 2;

/// A font, and what is used of it.
pub(super) struct Font {
    pub(super) name: &'static str,
    pub(super) file: &'static [u8],
    pub(super) face: Face<'static>,
    pub(super) used: GlyphRemapper,
    /// Letter and width in thousandths of the size of each glyph used, by its new number.
    pub(super) glyphs: BTreeMap<u16, (char, f32)>,
}

/// All fonts.
pub(super) struct Fonts {
    pub(super) all: Vec<Font>,
}

/// Letters of one font in a row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Piece {
    pub(super) font: usize,
    /// Numbers of glyphs in the file.
    pub(super) glyphs: Vec<u16>,
    /// Width, in sizes.
    pub(super) width: f32,
}

impl Fonts {
    pub(super) fn new() -> Result<Self, PdfError> {
        let font = |(name, file): (&'static str, &'static [u8])| {
            let face = Face::parse(file, 0).map_err(|error| PdfError::Font {
                name,
                reason: error.to_string(),
            })?;
            Ok(Font {
                name,
                file,
                face,
                used: GlyphRemapper::new(),
                glyphs: BTreeMap::new(),
            })
        };
        let all: Result<Vec<Font>, PdfError> = NAMES.into_iter().zip(FILES).map(font).collect();
        Ok(Self { all: all? })
    }

    /// The font that has a letter, and its glyph there.
    fn glyph(&self, letter: char, weight: Weight) -> Option<(usize, GlyphId)> {
        let first = match weight {
            Weight::Regular => 0,
            Weight::Bold => 1,
        };
        [first, FALLBACK].into_iter().find_map(|index| {
            let glyph = self.all.get(index)?.face.glyph_index(letter)?;
            Some((index, glyph))
        })
    }

    /// Text in which each letter can be set: others are told by their numbers.
    pub(super) fn settable(&self, text: &str) -> String {
        let mut shown = String::with_capacity(text.len());
        for letter in visible(text).chars() {
            if self.glyph(letter, Weight::Regular).is_some() {
                shown.push(letter);
            } else {
                shown.push_str(&by_number(letter));
            }
        }
        shown
    }

    /// Width of a letter, in sizes.
    pub(super) fn width(&self, letter: char, weight: Weight) -> f32 {
        self.glyph(letter, weight)
            .and_then(|(index, glyph)| self.advance(index, glyph))
            .unwrap_or(0.0)
    }

    fn advance(&self, index: usize, glyph: GlyphId) -> Option<f32> {
        let face = &self.all.get(index)?.face;
        let advance = face.glyph_hor_advance(glyph)?;
        Some(f32::from(advance) / f32::from(face.units_per_em()))
    }

    /// Width of a text, in sizes.
    pub(super) fn measure(&self, text: &str, weight: Weight) -> f32 {
        text.chars().map(|letter| self.width(letter, weight)).sum()
    }

    /// Glyphs of a text, kept as used.
    pub(super) fn set(&mut self, text: &str, weight: Weight) -> Vec<Piece> {
        let mut pieces: Vec<Piece> = Vec::new();
        for letter in text.chars() {
            let Some((index, glyph)) = self.glyph(letter, weight) else {
                continue;
            };
            let width = self.advance(index, glyph).unwrap_or(0.0);
            let Some(font) = self.all.get_mut(index) else {
                continue;
            };
            let number = font.used.remap(glyph.0);
            font.glyphs
                .entry(number)
                .or_insert((letter, 1000.0 * width));
            match pieces.last_mut() {
                Some(piece) if piece.font == index => {
                    piece.glyphs.push(number);
                    piece.width += width;
                }
                _ => pieces.push(Piece {
                    font: index,
                    glyphs: vec![number],
                    width,
                }),
            }
        }
        pieces
    }
}
