//! Colour definitions, entity 314.

use reconstruct::Model;

use super::error::WriteError;
use super::options::WriteOptions;
use super::shapes::plain_entry;
use super::sheet::{ColourField, Entry, Pointer, Sheet, Status};

/// The standard's own colours, from 1: black, red, green, blue, yellow, magenta, cyan,
/// white. A definition names the nearest for readers that know no others.
const STANDARD: [[u8; 3]; 8] = [
    [0, 0, 0],
    [255, 0, 0],
    [0, 255, 0],
    [0, 0, 255],
    [255, 255, 0],
    [255, 0, 255],
    [0, 255, 255],
    [255, 255, 255],
];

/// The colours of a model, each defined once.
pub(super) struct Colours(Vec<([u8; 3], Pointer)>);

impl Colours {
    /// Defines the colours that the model's faces need, in the order of the faces.
    pub(super) fn define(
        sheet: &mut Sheet,
        model: &Model,
        options: &WriteOptions,
    ) -> Result<Self, WriteError> {
        let mut known: Vec<([u8; 3], Pointer)> = Vec::new();
        for face in &model.faces {
            let colour = options.colour(face.region);
            if known.iter().any(|(other, _)| *other == colour) {
                continue;
            }
            let mut record = sheet.begin(Entry {
                line_font: 0,
                colour: ColourField::Number(nearest_standard(colour)),
                ..plain_entry(314, 0, Status::Definition)
            });
            for channel in colour {
                record.real(f64::from(channel) / 2.55);
            }
            let [red, green, blue] = colour;
            record.text(&format!("#{red:02X}{green:02X}{blue:02X}"));
            known.push((colour, record.finish()?));
        }
        Ok(Self(known))
    }

    /// The colour field of a face.
    pub(super) fn of(&self, region: u16, options: &WriteOptions) -> ColourField {
        let colour = options.colour(region);
        self.0
            .iter()
            .find(|(other, _)| *other == colour)
            .map_or(ColourField::Number(0), |&(_, pointer)| {
                ColourField::Defined(pointer)
            })
    }
}

fn nearest_standard(colour: [u8; 3]) -> u8 {
    let distance = |other: &[u8; 3]| -> u32 {
        colour
            .iter()
            .zip(other)
            .map(|(&a, &b)| u32::from(a.abs_diff(b)).pow(2))
            .sum()
    };
    let nearest = (1..=8)
        .zip(&STANDARD)
        .min_by_key(|(_, other)| distance(other));
    nearest.map_or(8, |(number, _)| number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_of_the_standard_colours() {
        assert_eq!(nearest_standard([10, 0, 20]), 1);
        assert_eq!(nearest_standard([250, 30, 20]), 2);
        assert_eq!(nearest_standard([200, 255, 230]), 8);
        assert_eq!(nearest_standard([10, 200, 220]), 7);
    }
}
