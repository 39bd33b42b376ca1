//! What a page says.

/// A page.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    /// Whose page it is: the name of a part, most often.
    pub title: String,
    /// What kind of page it is, in a word or two.
    pub kind: String,
    /// What came of it, in a line.
    pub verdict: Verdict,
    /// Who, when, what and with what.
    pub facts: Vec<Fact>,
    /// Everything else.
    pub sections: Vec<Section>,
    /// The program that made it, with its version.
    pub producer: String,
    /// When what it tells of took place: year, month, day, hour, minute and second, UTC. A PDF
    /// file is dated by it, so that it is the same whenever it is made.
    pub date: [u16; 6],
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// How glad one may be of it.
    pub level: Level,
    /// In a line.
    pub line: Line,
}

/// How glad one may be of something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// It is as it should be.
    Good,
    /// There is something to look at.
    Watch,
    /// It is not as it should be.
    Bad,
}

/// A part of a page under a heading.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Names it in links; unique in the page, letters and hyphens only.
    pub id: &'static str,
    /// Its heading.
    pub heading: String,
    /// What it says.
    pub blocks: Vec<Block>,
}

/// A piece of a section.
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// A paragraph.
    Text(Line),
    /// A list of warnings.
    Warnings(Vec<String>),
    /// Labels and what belongs to them.
    Facts(Vec<Fact>),
    /// A table.
    Table(Table),
    /// A picture.
    Picture(Picture),
    /// Bars over a scale.
    Chart(Chart),
}

/// A label and what belongs to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Fact {
    /// The label.
    pub label: String,
    /// What belongs to it.
    pub value: Line,
}

impl Fact {
    /// A label and what belongs to it.
    #[must_use]
    pub fn new(label: impl Into<String>, value: impl Into<Line>) -> Self {
        Self {
            label: label.into(),
            value: value.into(),
        }
    }
}

/// A line of text; some of it may be numbers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Line {
    /// One after another.
    pub runs: Vec<Run>,
}

/// A piece of a line.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// As it is shown.
    pub text: String,
    /// The number that is shown, in full; it goes into HTML beside what is shown of it.
    pub value: Option<f64>,
    /// Whether it came from elsewhere and may be written in any direction.
    pub is_foreign: bool,
    /// Whether it is a code, to be read letter by letter.
    pub is_code: bool,
}

impl Line {
    /// An empty line.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds words.
    #[must_use]
    pub fn text(self, text: impl Into<String>) -> Self {
        self.run(text.into(), None, false, false)
    }

    /// Adds a number as it is shown, and as it is.
    #[must_use]
    pub fn number(self, shown: impl Into<String>, value: f64) -> Self {
        self.run(shown.into(), Some(value), false, false)
    }

    /// Adds a whole number.
    #[must_use]
    pub fn count(self, value: usize) -> Self {
        self.number(crate::number::grouped(value as u64), value as f64)
    }

    /// Adds text that a person wrote.
    #[must_use]
    pub fn foreign(self, text: impl Into<String>) -> Self {
        self.run(text.into(), None, true, false)
    }

    /// Adds a code, such as a checksum.
    #[must_use]
    pub fn code(self, text: impl Into<String>) -> Self {
        self.run(text.into(), None, false, true)
    }

    /// Adds another line.
    #[must_use]
    pub fn line(mut self, other: Self) -> Self {
        self.runs.extend(other.runs);
        self
    }

    fn run(mut self, text: String, value: Option<f64>, is_foreign: bool, is_code: bool) -> Self {
        self.runs.push(Run {
            text,
            value,
            is_foreign,
            is_code,
        });
        self
    }

    /// The text of it.
    #[must_use]
    pub fn plain(&self) -> String {
        self.runs.iter().map(|run| run.text.as_str()).collect()
    }
}

impl From<&str> for Line {
    fn from(text: &str) -> Self {
        Self::new().text(text)
    }
}

impl From<String> for Line {
    fn from(text: String) -> Self {
        Self::new().text(text)
    }
}

/// A table; every row has as many cells as there are columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Its columns. The first names the row.
    pub columns: Vec<Column>,
    /// Its rows.
    pub rows: Vec<Vec<Line>>,
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its head.
    pub heading: String,
    /// Where its cells stand.
    pub align: Align,
}

impl Column {
    /// A column of words.
    #[must_use]
    pub fn words(heading: &str) -> Self {
        Self {
            heading: heading.to_owned(),
            align: Align::Left,
        }
    }

    /// A column of numbers.
    #[must_use]
    pub fn numbers(heading: &str) -> Self {
        Self {
            heading: heading.to_owned(),
            align: Align::Right,
        }
    }
}

/// Where the cells of a column stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// At the left.
    Left,
    /// At the right, as numbers do.
    Right,
}

/// A picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// What it shows.
    pub caption: String,
    /// The same for those who do not see it.
    pub alternative: String,
    /// The file: 8 bits of red, green and blue, not interlaced.
    pub png: Vec<u8>,
}

/// Bars over a scale: how often what occurs.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// What it shows.
    pub caption: String,
    /// The same for those who do not see it.
    pub alternative: String,
    /// What the scale means, with its unit.
    pub scale: String,
    /// Where bars begin and end; one more than there are bars.
    pub limits: Vec<f64>,
    /// How high they are.
    pub counts: Vec<usize>,
    /// Marks across the bars.
    pub marks: Vec<Mark>,
}

/// A mark across the bars of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Where on the scale.
    pub at: f64,
    /// What it is.
    pub label: String,
}
