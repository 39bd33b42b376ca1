//! The page of a scan or a comparison that an engineer can file.

mod acceptance;
mod comparison;
mod further;
mod parameters;
mod scan;
mod settings;

use std::io;

use jiff::Timestamp;
use jiff::tz::TimeZone;
use page::{Fact, Line, Page, Picture, number};

pub use acceptance::acceptance_page;
pub use comparison::comparison_page;
pub use scan::scan_page;

use crate::report::{CalibrationReport, ScanReport};

/// A form in which a page is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PageFormat {
    /// One HTML file.
    Html,
    /// PDF on A4.
    Pdf,
}

impl PageFormat {
    /// Both, in the order in which they are written.
    pub const ALL: [Self; 2] = [Self::Html, Self::Pdf];

    /// The ending of its files, which is its name too.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Html => "html",
            Self::Pdf => "pdf",
        }
    }

    /// The page in this form.
    ///
    /// # Errors
    /// A picture that is not of the kind that is drawn here.
    pub fn bytes(self, page: &Page) -> io::Result<Vec<u8>> {
        match self {
            Self::Html => Ok(page::to_html(page).into_bytes()),
            Self::Pdf => page::to_pdf(page).map_err(io::Error::other),
        }
    }
}

/// Which forms are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PageFormats {
    /// Whether the page is written as HTML.
    pub html: bool,
    /// Whether it is written as PDF.
    pub pdf: bool,
}

impl PageFormats {
    /// No page.
    pub const NONE: Self = Self {
        html: false,
        pdf: false,
    };
    /// Both.
    pub const BOTH: Self = Self {
        html: true,
        pdf: true,
    };

    /// Those that are wanted, in the order in which they are written.
    pub fn wanted(self) -> impl Iterator<Item = PageFormat> {
        PageFormat::ALL
            .into_iter()
            .filter(move |format| match format {
                PageFormat::Html => self.html,
                PageFormat::Pdf => self.pdf,
            })
    }
}

/// Year to second of a time, UTC.
fn date(time: Timestamp) -> [u16; 6] {
    let time = time.to_zoned(TimeZone::UTC);
    let part = |part: i8| u16::from(part.unsigned_abs());
    [
        time.year().unsigned_abs(),
        part(time.month()),
        part(time.day()),
        part(time.hour()),
        part(time.minute()),
        part(time.second()),
    ]
}

fn producer() -> String {
    format!("Relief {}", env!("CARGO_PKG_VERSION"))
}

/// A number with so many digits after the point, or a dash where there is none.
fn figure(value: Option<f64>, decimals: usize) -> Line {
    match value {
        Some(value) => Line::new().number(number::fixed(value, decimals), value),
        None => "-".into(),
    }
}

/// The same with its sign.
fn signed(value: f64, decimals: usize) -> Line {
    Line::new().number(number::signed(value, decimals), value)
}

/// A share of 1 in per cent.
fn per_cent(share: f64, decimals: usize) -> Line {
    let shown = number::fixed(100.0 * share, decimals);
    Line::new().number(shown, share).text(" %")
}

/// A place or direction in brackets.
fn triple(values: [f64; 3], decimals: usize) -> Line {
    let [x, y, z] = values.map(|value| figure(Some(value), decimals));
    let line = Line::new().text("(").line(x).text(", ").line(y);
    line.text(", ").line(z).text(")")
}

fn of_a_kind(count: usize, one: &str, many: &str) -> Line {
    let line = Line::new().count(count);
    line.text(format!(" {}", if count == 1 { one } else { many }))
}

/// Who took which samples of what, where it is known.
fn origin(scan: &ScanReport) -> Vec<Fact> {
    let given = [
        ("Scanner", &scan.scanner),
        ("Operator", &scan.operator),
        ("Part", &scan.part),
        ("Note", &scan.note),
        ("Scan", &scan.id),
    ];
    let mut facts = vec![Fact::new("Source", Line::new().foreign(&scan.source))];
    facts.extend(given.into_iter().filter_map(|(label, value)| {
        let value = value.as_ref().filter(|value| !value.is_empty())?;
        Some(Fact::new(label, Line::new().foreign(value)))
    }));
    let mut samples = Line::new().count(scan.samples as usize).text(" in ");
    samples = samples.line(of_a_kind(scan.columns as usize, "column", "columns"));
    if let Some(dropouts) = scan.dropouts {
        samples = samples.text("; ").count(dropouts as usize);
        samples = samples.text(" rays without");
    }
    facts.push(Fact::new("Samples", samples));
    facts.extend(
        scan.calibration
            .as_ref()
            .map(|own| Fact::new("Calibrated", calibrated(own))),
    );
    facts
}

/// When a scanner was calibrated, and how well.
fn calibrated(own: &CalibrationReport) -> Line {
    let mut line = Line::from(own.date.clone());
    if let Some(days) = own.age_days {
        let days = usize::try_from(days).unwrap_or(0);
        line = line
            .text(", ")
            .line(of_a_kind(days, "day", "days"))
            .text(" before");
    }
    line.text(", residual ")
        .line(figure(Some(own.residual_mm), 4))
        .text(" mm")
}

fn picture(caption: &str, alternative: String, png: Vec<u8>) -> Picture {
    Picture {
        caption: caption.to_owned(),
        alternative,
        png,
    }
}
