//! Outlines with numbers over the shaded part, and what is said of each beside it.

use colorous::TABLEAU10;
use range_image::RangeImage;

use super::canvas::{Canvas, Mask, Rgb, TEXT_HEIGHT, Weight, fitted, text_width};
use super::plot::{FAINT, INK, PAPER, Plot, dimmed, shade};

const LEGEND_GAP: usize = 24;
const LEGEND_ROOM: usize = 520;
const LEGEND_LINE: usize = 22;
const LEGEND_HEIGHT: usize = 300;
/// The part.
const GROUND: Rgb = [214, 218, 222];

/// One outline.
#[derive(Debug, Clone, PartialEq)]
pub struct OutlineNote {
    /// Its number or name, short.
    pub number: String,
    /// What is said beside it.
    pub text: String,
    /// Whether there is something that the user should read elsewhere; marked with an asterisk.
    pub is_doubtful: bool,
    /// The closed polygon in the scan's x and y, millimetres.
    pub loop_mm: Vec<[f64; 2]>,
    /// Where the number goes.
    pub label_mm: [f64; 2],
}

pub(super) fn draw(image: &RangeImage, notes: &[OutlineNote], name: &str) -> Canvas {
    let subtitle = format!("features: {}", notes.len());
    let mut plot = Plot::new(image, name, &subtitle, LEGEND_ROOM, LEGEND_HEIGHT);
    plot.paint(image, |column, row| {
        image.z_mm(column, row)?;
        let light = 0.62 + 0.44 * shade(image, column, row, |_, _| true);
        Some(dimmed(GROUND, light.min(1.05)))
    });
    for (index, note) in notes.iter().enumerate() {
        for (radius, colour) in [(2.6, PAPER), (1.5, colour(index))] {
            let mut mask = Mask::like(&plot.canvas);
            let places: Vec<[f64; 2]> = note
                .loop_mm
                .iter()
                .map(|[x, y]| plot.place(image, *x, *y))
                .collect();
            for (k, from) in places.iter().enumerate() {
                let to = places[(k + 1) % places.len()];
                mask.stroke(*from, to, radius);
            }
            plot.canvas.stencil(&mask, colour);
        }
    }
    plot.axes(image);
    for (index, note) in notes.iter().enumerate() {
        label(&mut plot, image, note, colour(index));
    }
    legend(&mut plot, notes);
    plot.canvas
}

fn colour(index: usize) -> Rgb {
    let own = TABLEAU10[index % TABLEAU10.len()];
    [own.r, own.g, own.b]
}

fn label(plot: &mut Plot, image: &RangeImage, note: &OutlineNote, colour: Rgb) {
    let [x, y] = plot.place(image, note.label_mm[0], note.label_mm[1]);
    let width = text_width(&note.number) + 8;
    let left = (x - width as f64 / 2.0).max(0.0) as usize;
    let top = (y - TEXT_HEIGHT as f64 / 2.0).max(0.0) as usize;
    plot.canvas.fill(left, top, width, TEXT_HEIGHT + 2, PAPER);
    plot.canvas.frame(left, top, width, TEXT_HEIGHT + 2, colour);
    plot.canvas
        .text(left + 4, top + 1, &note.number, Weight::Bold, INK);
}

fn legend(plot: &mut Plot, notes: &[OutlineNote]) {
    let left = plot.right() + LEGEND_GAP;
    let mut y = plot.top();
    let bottom = plot.top() + plot.height().max(LEGEND_HEIGHT);
    for (index, note) in notes.iter().enumerate() {
        if y + 2 * LEGEND_LINE > bottom && index + 1 < notes.len() {
            let rest = format!("... and {} more", notes.len() - index);
            plot.canvas.text(left, y, &rest, Weight::Regular, FAINT);
            return;
        }
        plot.canvas.fill(left, y, 14, 14, colour(index));
        let mark = if note.is_doubtful { " *" } else { "" };
        let text = format!("{:>2}  {}{mark}", note.number, note.text);
        let text = fitted(&text, LEGEND_ROOM - LEGEND_GAP - 24);
        plot.canvas.text(left + 22, y, &text, Weight::Regular, INK);
        y += LEGEND_LINE;
    }
}
