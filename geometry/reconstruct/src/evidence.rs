//! What samples tell beside the nodes.

use shapes::Form;

/// What is known of the regions besides their nodes. By the letter of the paper it is not asked.
#[derive(Debug, Clone, Copy, Default)]
pub struct Evidence<'a> {
    /// The form of a region, by label from 1 on, where one is known, and the numbers that the samples
    /// gave it.
    pub forms: &'a [Option<Known>],
    /// The samples beside the outlines of regions, which tell better than nodes where those and
    /// the steps between regions run.
    pub outline_samples: &'a [OutlineSample],
}

/// What a region is.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// Its surface.
    pub form: Form,
    /// How many free numbers that has.
    pub freedom: usize,
}

/// A sample beside an outline, or the place of one that is missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutlineSample {
    /// Its region, or the one that it would be of if that went on.
    pub region: u16,
    /// Its x and y in the part frame, millimetres.
    pub place_mm: [f64; 2],
    /// Whether it is there.
    pub seen: Seen,
}

/// Whether a sample is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// It is.
    Present,
    /// It is not, beyond the last one of a column or where a column beside has one.
    Missing,
    /// It is not, among others that are.
    Lost,
}
