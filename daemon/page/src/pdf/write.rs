//! Sheets as a PDF file (ISO 32000-1).

use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{
    CidFontType, FontFlags, OutlineItemFlags, PageMode, Predictor, SystemInfo, UnicodeCmap,
};
use pdf_writer::{Content, Date, Filter, Finish, Name, Pdf, Rect, Ref, Str, TextStr};
use subsetter::subset;
use ttf_parser::{RawFace, Tag};

use super::PdfError;
use super::fonts::Font;
use super::sheet::{HEIGHT, Mark, Sheets, WIDTH};
use crate::letters::visible;
use crate::model::Page;
use crate::png::Rows;

const IDENTITY: SystemInfo<'_> = SystemInfo {
    registry: Str(b"Adobe"),
    ordering: Str(b"Identity"),
    supplement: 0,
};

/// Numbers of objects, one after another.
struct Numbers(i32);

impl Numbers {
    fn next(&mut self) -> Ref {
        self.0 += 1;
        Ref::new(self.0)
    }
}

pub(super) fn document(page: &Page, sheets: Sheets) -> Result<Vec<u8>, PdfError> {
    let mut numbers = Numbers(0);
    let mut pdf = Pdf::new();
    let (catalog, tree, outline, info) = (
        numbers.next(),
        numbers.next(),
        numbers.next(),
        numbers.next(),
    );
    let fonts: Vec<(Ref, &Font)> = sheets
        .fonts
        .all
        .iter()
        .filter(|font| !font.glyphs.is_empty())
        .map(|font| (numbers.next(), font))
        .collect();
    let pictures: Vec<Ref> = sheets.pictures.iter().map(|_| numbers.next()).collect();
    let pages: Vec<Ref> = sheets.sheets.iter().map(|_| numbers.next()).collect();

    let mut root = pdf.catalog(catalog);
    root.pages(tree);
    root.lang(TextStr("en"));
    root.viewer_preferences().display_doc_title(true);
    if !sheets.headings.is_empty() {
        root.outlines(outline).page_mode(PageMode::UseOutlines);
    }
    root.finish();
    let [year, month, day, hour, minute, second] = page.date;
    let byte = |part: u16| u8::try_from(part).unwrap_or(0);
    pdf.document_info(info)
        .title(TextStr(&format!("{}: {}", visible(&page.title), page.kind)))
        .producer(TextStr(&page.producer))
        .creation_date(
            Date::new(year)
                .month(byte(month))
                .day(byte(day))
                .hour(byte(hour))
                .minute(byte(minute))
                .second(byte(second))
                .utc_offset_hour(0)
                .utc_offset_minute(0),
        );
    pdf.pages(tree)
        .kids(pages.iter().copied())
        .count(pages.len() as i32);
    for (sheet, &number) in sheets.sheets.iter().zip(&pages) {
        let content = numbers.next();
        let mut leaf = pdf.page(number);
        leaf.parent(tree)
            .media_box(Rect::new(0.0, 0.0, WIDTH, HEIGHT))
            .contents(content);
        let mut resources = leaf.resources();
        let mut named = resources.fonts();
        for (number, font) in &fonts {
            named.pair(Name(font.name.as_bytes()), *number);
        }
        named.finish();
        let mut drawn = resources.x_objects();
        for mark in sheet {
            if let Mark::Picture { number, .. } = mark
                && let Some(object) = pictures.get(*number)
            {
                drawn.pair(Name(picture_name(*number).as_bytes()), *object);
            }
        }
        drawn.finish();
        resources.finish();
        leaf.finish();
        let drawn = deflated(&operators(sheet, &sheets));
        pdf.stream(content, &drawn).filter(Filter::FlateDecode);
    }
    for (rows, &number) in sheets.pictures.iter().zip(&pictures) {
        picture(&mut pdf, number, rows);
    }
    for (number, font) in &fonts {
        embed(&mut pdf, *number, font, &mut numbers)?;
    }
    outlines(&mut pdf, outline, &sheets, &pages, &mut numbers);
    Ok(pdf.finish())
}

fn picture_name(number: usize) -> String {
    format!("P{number}")
}

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut sink = ZlibEncoder::new(Vec::new(), Compression::default());
    // A vector takes all that it is given.
    let written = sink.write_all(bytes).and_then(|()| sink.finish());
    written.unwrap_or_default()
}

fn operators(sheet: &[Mark], sheets: &Sheets) -> Vec<u8> {
    let mut content = Content::new();
    for mark in sheet {
        match mark {
            Mark::Box { place, colour } => {
                let [left, top, width, height] = *place;
                let [red, green, blue] = *colour;
                content
                    .set_fill_rgb(red, green, blue)
                    .rect(left, HEIGHT - top - height, width, height)
                    .fill_nonzero();
            }
            Mark::Picture { place, number } => {
                let [left, top, width, height] = *place;
                content
                    .save_state()
                    .transform([width, 0.0, 0.0, height, left, HEIGHT - top - height])
                    .x_object(Name(picture_name(*number).as_bytes()))
                    .restore_state();
            }
            Mark::Letters {
                at,
                size,
                colour,
                pieces,
            } => {
                let [red, green, blue] = *colour;
                content
                    .begin_text()
                    .set_fill_rgb(red, green, blue)
                    .set_text_matrix([1.0, 0.0, 0.0, 1.0, at[0], HEIGHT - at[1]]);
                for piece in pieces {
                    let Some(font) = sheets.fonts.all.get(piece.font) else {
                        continue;
                    };
                    let codes: Vec<u8> = piece
                        .glyphs
                        .iter()
                        .flat_map(|glyph| glyph.to_be_bytes())
                        .collect();
                    content
                        .set_font(Name(font.name.as_bytes()), *size)
                        .show(Str(&codes));
                }
                content.end_text();
            }
        }
    }
    content.finish().into_vec()
}

/// The rows of a PNG file are what PDF expects, filters and all.
fn picture(pdf: &mut Pdf, number: Ref, rows: &Rows) {
    let (width, height) = (rows.width as i32, rows.height as i32);
    let mut object = pdf.image_xobject(number, &rows.compressed);
    object
        .width(width)
        .height(height)
        .bits_per_component(8)
        .color_space()
        .device_rgb();
    object.filter(Filter::FlateDecode);
    object
        .decode_parms()
        .predictor(Predictor::PngOptimum)
        .colors(3)
        .bits_per_component(8)
        .columns(width);
    object.finish();
}

/// The glyphs that are used of a font, and what letters they are.
fn embed(pdf: &mut Pdf, number: Ref, font: &Font, numbers: &mut Numbers) -> Result<(), PdfError> {
    let refused = |reason: String| PdfError::Font {
        name: font.name,
        reason,
    };
    let (descendant, descriptor, file, letters) = (
        numbers.next(),
        numbers.next(),
        numbers.next(),
        numbers.next(),
    );
    let part = subset(font.file, 0, &font.used).map_err(|error| refused(error.to_string()))?;
    // Of a font with cubic outlines the outlines alone.
    let outlines = RawFace::parse(&part, 0)
        .ok()
        .and_then(|face| face.table(Tag::from_bytes(b"CFF ")));
    let is_cff = outlines.is_some();
    let part = outlines.unwrap_or(&part);
    // Six letters before a font's name say that it is a part of it.
    let name = format!("RELIEF+{}", font.name);
    let name = Name(name.as_bytes());
    let mut top = pdf.type0_font(number);
    top.base_font(name)
        .encoding_predefined(Name(b"Identity-H"))
        .descendant_font(descendant)
        .to_unicode(letters);
    top.finish();

    let mut below = pdf.cid_font(descendant);
    below
        .subtype(if is_cff {
            CidFontType::Type0
        } else {
            CidFontType::Type2
        })
        .base_font(name)
        .system_info(IDENTITY)
        .font_descriptor(descriptor)
        .default_width(0.0);
    if !is_cff {
        below.cid_to_gid_map_predefined(Name(b"Identity"));
    }
    let mut widths = below.widths();
    for (glyph, (_, width)) in &font.glyphs {
        widths.consecutive(*glyph, [*width]);
    }
    widths.finish();
    below.finish();

    let face = &font.face;
    let em = 1000.0 / f32::from(face.units_per_em());
    let scaled = |value: i16| f32::from(value) * em;
    let bounds = face.global_bounding_box();
    let mut told = pdf.font_descriptor(descriptor);
    told.name(name)
        .flags(FontFlags::SYMBOLIC)
        .bbox(Rect::new(
            scaled(bounds.x_min),
            scaled(bounds.y_min),
            scaled(bounds.x_max),
            scaled(bounds.y_max),
        ))
        .italic_angle(0.0)
        .ascent(scaled(face.ascender()))
        .descent(scaled(face.descender()))
        .cap_height(scaled(face.capital_height().unwrap_or(714)))
        .stem_v(if face.is_bold() { 140.0 } else { 90.0 });
    if is_cff {
        told.font_file3(file);
    } else {
        told.font_file2(file);
    }
    told.finish();
    let packed = deflated(part);
    let mut stream = pdf.stream(file, &packed);
    stream.filter(Filter::FlateDecode);
    if is_cff {
        stream.pair(Name(b"Subtype"), Name(b"CIDFontType0C"));
    } else {
        stream.pair(Name(b"Length1"), part.len() as i32);
    }
    stream.finish();

    let mut map = UnicodeCmap::new(Name(b"Letters"), IDENTITY);
    for (glyph, (letter, _)) in &font.glyphs {
        map.pair(*glyph, *letter);
    }
    pdf.stream(letters, &map.finish());
    Ok(())
}

fn outlines(pdf: &mut Pdf, outline: Ref, sheets: &Sheets, pages: &[Ref], numbers: &mut Numbers) {
    let items: Vec<Ref> = sheets.headings.iter().map(|_| numbers.next()).collect();
    let (Some(&first), Some(&last)) = (items.first(), items.last()) else {
        return;
    };
    pdf.outline(outline)
        .first(first)
        .last(last)
        .count(items.len() as i32);
    for (index, ((heading, sheet, top), &number)) in sheets.headings.iter().zip(&items).enumerate()
    {
        let mut item = pdf.outline_item(number);
        item.title(TextStr(heading))
            .parent(outline)
            .flags(OutlineItemFlags::empty());
        if let Some(previous) = index.checked_sub(1).and_then(|before| items.get(before)) {
            item.prev(*previous);
        }
        if let Some(next) = items.get(index + 1) {
            item.next(*next);
        }
        if let Some(page) = pages.get(*sheet) {
            item.dest().page(*page).xyz(0.0, HEIGHT - top + 8.0, None);
        }
    }
}
