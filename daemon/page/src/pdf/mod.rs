//! A page set on A4.

mod fonts;
mod layout;
mod sheet;
mod table;
mod write;

use crate::model::Page;
use crate::png::PngError;
use layout::Layout;

/// A page cannot be set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PdfError {
    /// A picture is not of the kind that is taken over.
    #[error("{caption}: {source}")]
    Picture {
        /// What it shows.
        caption: String,
        /// What is wrong with it.
        source: PngError,
    },
    /// A font that is built in cannot be used.
    #[error("the font {name} cannot be used: {reason}")]
    Font {
        /// Its name.
        name: &'static str,
        /// What is wrong with it.
        reason: String,
    },
}

/// The page as PDF 1.7.
///
/// # Errors
/// [`PdfError`] where a picture is not of the kind that is drawn here.
pub fn to_pdf(page: &Page) -> Result<Vec<u8>, PdfError> {
    let mut layout = Layout::new()?;
    layout.page(page)?;
    write::document(page, layout.finish(page))
}
