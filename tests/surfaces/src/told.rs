//! Tables on their way to a page.

/// What is printed as it comes, and kept for the page.
#[derive(Default)]
pub(crate) struct Told {
    pub(crate) page: String,
    /// Bars that were missed.
    pub(crate) missed: Vec<String>,
}

impl Told {
    pub(crate) fn line(&mut self, line: &str) {
        println!("{line}");
        self.page.push_str(line);
        self.page.push('\n');
    }

    /// The first two lines of a table.
    pub(crate) fn head(&mut self, cells: &[&str]) {
        self.line(&format!("| {} |", cells.join(" | ")));
        self.line(&format!("|{}", " --- |".repeat(cells.len())));
    }
}
