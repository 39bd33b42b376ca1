//! What a page says is read back from both of its forms, by readers that share no code with the
//! writers.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on is a test that has failed"
)]

use lopdf::Document;
use page::{
    Block, Chart, Column, Fact, Level, Line, Mark, Page, Picture, Section, Table, Verdict, to_html,
    to_pdf,
};
use scraper::{Html, Selector};

/// Hangul for "part".
const PART: &str = "\u{bd80}\u{d488}";

fn page(rows: usize) -> Page {
    let row = |row: usize| {
        vec![
            Line::new().count(row),
            Line::new().foreign(format!("face <{row}>")),
            Line::new().number(format!("{:.3}", row as f64 / 7.0), row as f64 / 7.0),
        ]
    };
    Page {
        title: format!("<script>alert(1)</script> & \"{PART}\""),
        kind: "Scan report".into(),
        verdict: Verdict {
            level: Level::Watch,
            line: Line::new().count(rows).text(" faces"),
        },
        facts: vec![Fact::new(
            "Operator",
            Line::new().foreign("M. M\u{fc}ller\u{202e}"),
        )],
        sections: vec![
            Section {
                id: "warnings",
                heading: "Warnings".into(),
                blocks: vec![Block::Warnings(vec!["a < b".into()])],
            },
            Section {
                id: "faces",
                heading: "Faces".into(),
                blocks: vec![
                    Block::Table(Table {
                        caption: "All faces.".into(),
                        columns: vec![
                            Column::words("Face"),
                            Column::words("Name"),
                            Column::numbers("rms, mm"),
                        ],
                        rows: (1..=rows).map(row).collect(),
                    }),
                    Block::Picture(Picture {
                        caption: "A picture.".into(),
                        alternative: "Two by one.".into(),
                        png: PNG.to_vec(),
                    }),
                    Block::Chart(Chart {
                        caption: "Bars.".into(),
                        alternative: "Three bars.".into(),
                        scale: "deviation, mm".into(),
                        limits: vec![-0.1, 0.0, 0.1, 0.2],
                        counts: vec![1, 4, 0],
                        marks: vec![Mark {
                            at: 0.1,
                            label: "limit".into(),
                        }],
                    }),
                ],
            },
        ],
        producer: "Relief 0.0".into(),
        date: [2026, 11, 21, 13, 17, 9],
    }
}

/// One red and one green pixel, by another program.
const PNG: [u8; 72] = [
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52,
    0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01, 0x08, 0x02, 0x00, 0x00, 0x00, 0x7b, 0x40, 0xe8,
    0xdd, 0x00, 0x00, 0x00, 0x0f, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0xf8, 0xcf, 0xc0, 0xc0,
    0xf0, 0x9f, 0x01, 0x00, 0x07, 0xff, 0x01, 0xff, 0x01, 0x7f, 0x89, 0xa7, 0x00, 0x00, 0x00, 0x00,
    0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82,
];

fn all<'a>(html: &'a Html, selector: &str) -> Vec<scraper::ElementRef<'a>> {
    html.select(&Selector::parse(selector).unwrap()).collect()
}

fn text(element: scraper::ElementRef<'_>) -> String {
    element.text().collect()
}

/// Text of a PDF file, sheet by sheet, without white space: where that stands is the reader's guess.
fn sheets(pdf: &[u8]) -> Vec<String> {
    let document = Document::load_mem(pdf).unwrap();
    let numbers = document.get_pages().into_keys();
    numbers
        .map(|number| {
            let text = document.extract_text(&[number]).unwrap();
            text.split_whitespace().collect()
        })
        .collect()
}

#[test]
fn html_holds_what_the_page_says_and_no_markup_of_others() {
    let html = to_html(&page(3));
    assert!(html.starts_with("<!DOCTYPE html>"));
    let read = Html::parse_document(&html);
    assert_eq!(read.errors, Vec::<String>::new());
    assert!(all(&read, "script").is_empty());
    assert_eq!(all(&read, "html")[0].attr("lang"), Some("en"));
    let title = format!("<script>alert(1)</script> & \"{PART}\"");
    assert_eq!(text(all(&read, "h1")[0]), title);
    assert_eq!(
        text(all(&read, "title")[0]),
        format!("{title}: Scan report")
    );
    assert_eq!(text(all(&read, "caption")[0]), "All faces.");
    assert_eq!(all(&read, "thead th[scope=col]").len(), 3);
    assert_eq!(text(all(&read, "ul.warnings li")[0]), "a < b");
    // A letter that turns lines around is told.
    assert_eq!(text(all(&read, "dd")[0]), "M. M\u{fc}ller[U+202E]");
    let rows = all(&read, "tbody tr");
    assert_eq!(rows.len(), 3);
    for (index, row) in (1..).zip(rows) {
        assert_eq!(text(row).matches(&format!("face <{index}>")).count(), 1);
        let number = row.select(&Selector::parse("td data").unwrap()).next();
        let value: f64 = number.unwrap().attr("value").unwrap().parse().unwrap();
        assert!(value == f64::from(index) / 7.0, "{value} in full");
    }
    assert_eq!(all(&read, "img")[0].attr("alt"), Some("Two by one."));
    assert_eq!(all(&read, "img")[0].attr("width"), Some("2"));
    let source = all(&read, "img")[0].attr("src").unwrap();
    assert!(source.starts_with("data:image/png;base64,iVBORw0KGgo"));
    let counts: Vec<_> = all(&read, "svg rect")
        .iter()
        .map(|bar| bar.attr("data-count"))
        .collect();
    assert_eq!(counts, [Some("1"), Some("4"), Some("0")]);
    // Nothing is loaded: every address is inside the file.
    for (selector, attribute) in [("[src]", "src"), ("[href]", "href")] {
        for element in all(&read, selector) {
            let address = element.attr(attribute).unwrap();
            assert!(
                address.starts_with("data:") || address.starts_with('#'),
                "{address}"
            );
        }
    }
    // Every link leads somewhere.
    for link in all(&read, "nav a") {
        assert_eq!(all(&read, link.attr("href").unwrap()).len(), 1);
    }
}

#[test]
fn pdf_holds_the_same_and_heads_are_repeated() {
    let pdf = to_pdf(&page(333)).unwrap();
    let sheets = sheets(&pdf);
    assert!(sheets.len() >= 5, "{}", sheets.len());
    let whole = sheets.concat();
    for row in 1..=333 {
        let cells = format!("{row}face<{row}>{:.3}", f64::from(row) / 7.0);
        assert_eq!(whole.matches(&cells).count(), 1, "{cells}");
    }
    for (index, sheet) in sheets.iter().enumerate() {
        let number = format!("Page{}of{}", index + 1, sheets.len());
        assert!(sheet.contains(&number), "{number}: {sheet}");
        assert!(sheet.contains("2026-11-2113:17UTC"), "{sheet}");
        if sheet.contains("face<") {
            assert!(sheet.contains("FaceNamerms,mm"), "{sheet}");
        }
    }
    assert!(whole.contains(&format!("<script>alert(1)</script>&\"{PART}\"")));
    assert!(whole.contains("M.M\u{fc}ller[U+202E]"));
    let document = Document::load_mem(&pdf).unwrap();
    let info = document
        .trailer
        .get(b"Info")
        .unwrap()
        .as_reference()
        .unwrap();
    let info = document.get_dictionary(info).unwrap();
    let dated = info.get(b"CreationDate").unwrap().as_str().unwrap();
    assert!(dated.starts_with(b"D:20261121131709"));
    let pictures: usize = document
        .get_pages()
        .values()
        .map(|sheet| document.get_page_images(*sheet).unwrap().len())
        .sum();
    assert_eq!(pictures, 1);
}

#[test]
fn letters_without_a_shape_are_told_by_their_numbers() {
    let mut page = page(1);
    page.title = "\u{4e2d}\u{1f600}x".into();
    assert!(to_html(&page).contains("<bdi>\u{4e2d}\u{1f600}x</bdi>"));
    assert!(sheets(&to_pdf(&page).unwrap())[0].contains("[U+4E2D][U+1F600]x"));
}

#[test]
fn the_same_page_gives_the_same_bytes() {
    assert_eq!(to_html(&page(40)), to_html(&page(40)));
    assert_eq!(to_pdf(&page(40)), to_pdf(&page(40)));
    let mut later = page(40);
    later.date[5] += 1;
    assert_ne!(to_pdf(&page(40)), to_pdf(&later));
}

#[test]
fn nothing_to_say_and_words_without_end_do_no_harm() {
    let mut page = page(0);
    page.title = "x".repeat(3000);
    page.facts = vec![Fact::new("Note", "long ".repeat(4000)), Fact::new("", "")];
    page.sections.push(Section {
        id: "empty",
        heading: String::new(),
        blocks: Vec::new(),
    });
    let sheets = sheets(&to_pdf(&page).unwrap());
    let whole = sheets.concat();
    assert_eq!(whole.matches("long").count(), 4000);
    assert!(sheets.len() > 3);
    let read = Html::parse_document(&to_html(&page));
    assert_eq!(read.errors, Vec::<String>::new());
}

#[test]
fn pictures_of_other_kinds_are_refused_with_their_names() {
    let with = |png: Vec<u8>| {
        let mut page = page(0);
        page.sections[1].blocks = vec![Block::Picture(Picture {
            caption: "The map".into(),
            alternative: String::new(),
            png,
        })];
        to_pdf(&page).unwrap_err().to_string()
    };
    assert_eq!(
        with(b"GIF89a".to_vec()),
        "The map: the picture is no whole PNG file"
    );
    assert_eq!(
        with(PNG[..50].to_vec()),
        "The map: the picture is no whole PNG file"
    );
    let mut grey = PNG.to_vec();
    grey[25] = 0;
    assert!(with(grey).starts_with("The map: the picture is not of 8 bits"));
}
