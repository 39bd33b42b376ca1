//! Colours of faces (ISO 10303-46).

use super::data::{Data, Id};

/// The colours of a model, each defined once.
#[derive(Debug, Default)]
pub(super) struct Styles {
    known: Vec<([u8; 3], Id)>,
    items: Vec<Id>,
}

impl Styles {
    /// Gives a face its colour.
    pub(super) fn colour(&mut self, data: &mut Data, face: Id, colour: [u8; 3]) {
        let known = self.known.iter().find(|(other, _)| *other == colour);
        let style = match known {
            Some(&(_, style)) => style,
            None => {
                let style = define(data, colour);
                self.known.push((colour, style));
                style
            }
        };
        self.items.push(data.add("STYLED_ITEM", |v| {
            v.text("");
            v.ids(&[style]);
            v.id(face);
        }));
    }

    /// The representation that holds all styles.
    pub(super) fn finish(self, data: &mut Data, context: Id) {
        data.add(
            "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION",
            |v| {
                v.text("");
                v.ids(&self.items);
                v.id(context);
            },
        );
    }
}

/// `PRESENTATION_STYLE_ASSIGNMENT` of both sides of a surface.
fn define(data: &mut Data, colour: [u8; 3]) -> Id {
    let [red, green, blue] = colour;
    let name = format!("#{red:02X}{green:02X}{blue:02X}");
    let rgb = data.add("COLOUR_RGB", |v| {
        v.text(&name);
        colour.iter().for_each(|&c| v.real(f64::from(c) / 255.0));
    });
    let named = |keyword: &str, data: &mut Data, id: Id| {
        data.add(keyword, |v| {
            v.text("");
            v.ids(&[id]);
        })
    };
    let fill = data.add("FILL_AREA_STYLE_COLOUR", |v| {
        v.text("");
        v.id(rgb);
    });
    let fill = named("FILL_AREA_STYLE", data, fill);
    let fill = data.add("SURFACE_STYLE_FILL_AREA", |v| v.id(fill));
    let side = named("SURFACE_SIDE_STYLE", data, fill);
    let both = data.add("SURFACE_STYLE_USAGE", |v| {
        v.word(".BOTH.");
        v.id(side);
    });
    data.add("PRESENTATION_STYLE_ASSIGNMENT", |v| v.ids(&[both]))
}
