//! A page that can be filed: described once, written as HTML and as PDF.
//!
//! [`Page`] is what is to be said, in sections of text, facts, tables, pictures and charts; it
//! knows nothing of what was measured. [`to_html`] makes one file of it that needs nothing else:
//! pictures are inside, there are no scripts, and it can be read on a telephone, in the dark and
//! on paper. [`to_pdf`] sets the same on A4.
//!
//! Both are functions of their argument alone: same page, same bytes.

mod html;
mod letters;
mod model;
pub mod number;
mod pdf;
mod png;

pub use html::to_html;
pub use model::{
    Align, Block, Chart, Column, Fact, Level, Line, Mark, Page, Picture, Run, Section, Table,
    Verdict,
};
pub use pdf::{PdfError, to_pdf};
pub use png::PngError;
