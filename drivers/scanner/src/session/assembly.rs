//! One column, put together from fragments that come in any order.

use scanner_protocol::commands::Missing;
use scanner_protocol::{ColumnEnd, ColumnFragment, Sample};

use crate::scanner::{RawColumn, RawSample};

/// The fragments of one column that have come so far.
#[derive(Debug, Default)]
pub(super) struct Assembly {
    /// What every part of the column must agree on, once a part has come.
    shape: Option<Shape>,
    /// By fragment index; as long as the number of fragments.
    parts: Vec<Option<Part>>,
    /// All samples, each at its place in the column. Fragments are too many for memory of their own.
    samples: Vec<Sample>,
    have: usize,
    /// The number of samples that the column's end told.
    told_samples: Option<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Shape {
    table_counts: i32,
    fragments: u16,
}

/// Where the samples of a fragment are.
#[derive(Debug, Clone, Copy)]
struct Part {
    first_sample: usize,
    count: usize,
}

/// The parts of a column contradict each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Contradiction(pub(super) &'static str);

impl Assembly {
    /// Takes a fragment; says whether it is new. At most `max_samples` fragments are
    /// believed in, since each holds a sample.
    pub(super) fn fragment(
        &mut self,
        fragment: &ColumnFragment,
        max_samples: u16,
    ) -> Result<bool, Contradiction> {
        self.agree(
            Shape {
                table_counts: fragment.table_counts,
                fragments: fragment.fragments,
            },
            max_samples,
        )?;
        let first_sample = usize::from(fragment.first_sample);
        if first_sample + fragment.len() > usize::from(max_samples) {
            return Err(Contradiction("more samples than planned"));
        }
        let Some(part) = self.parts.get_mut(usize::from(fragment.fragment)) else {
            return Err(Contradiction("a fragment beyond the last"));
        };
        if part.is_some() {
            return Ok(false);
        }
        let count = fragment.len();
        *part = Some(Part {
            first_sample,
            count,
        });
        let end = first_sample + count;
        if self.samples.len() < end {
            self.samples.resize(end, Sample::default());
        }
        let places = self.samples.iter_mut().skip(first_sample);
        for (place, sample) in places.zip(fragment.samples()) {
            *place = sample;
        }
        self.have += 1;
        Ok(true)
    }

    /// Takes the column's end.
    pub(super) fn end(&mut self, end: &ColumnEnd, max_samples: u16) -> Result<(), Contradiction> {
        self.agree(
            Shape {
                table_counts: end.table_counts,
                fragments: end.fragments,
            },
            max_samples,
        )?;
        self.told_samples = Some(usize::from(end.samples));
        Ok(())
    }

    fn agree(&mut self, shape: Shape, max_samples: u16) -> Result<(), Contradiction> {
        match self.shape {
            None if shape.fragments > max_samples => {
                Err(Contradiction("more fragments than samples"))
            }
            None => {
                self.shape = Some(shape);
                self.parts
                    .resize_with(usize::from(shape.fragments), || None);
                Ok(())
            }
            Some(known) if known == shape => Ok(()),
            Some(_) => Err(Contradiction("its parts disagree")),
        }
    }

    /// Whether every fragment is there.
    pub(super) fn is_complete(&self) -> bool {
        self.shape.is_some() && self.have == self.parts.len()
    }

    /// Which fragments are missing, as far as one request can say.
    pub(super) fn missing(&self) -> Missing {
        if self.have == 0 {
            return Missing::whole();
        }
        Missing::of(
            (0_u16..)
                .zip(&self.parts)
                .filter(|(_, part)| part.is_none())
                .map(|(fragment, _)| fragment),
        )
    }

    /// The column, once it is complete. Checks that the fragments join without gap or overlap.
    /// Ready for another column afterwards.
    pub(super) fn finish(&mut self, index: u32) -> Result<RawColumn, Contradiction> {
        let column = self.column(index);
        self.clear();
        column
    }

    /// Forgets all that has come, and keeps the memory for what will.
    pub(super) fn clear(&mut self) {
        self.shape = None;
        self.parts.clear();
        self.samples.clear();
        self.have = 0;
        self.told_samples = None;
    }

    fn column(&self, index: u32) -> Result<RawColumn, Contradiction> {
        let mut count = 0;
        for part in self.parts.iter().flatten() {
            if part.first_sample != count {
                return Err(Contradiction("its fragments do not join"));
            }
            count += part.count;
        }
        if self.told_samples.is_some_and(|told| told != count) {
            return Err(Contradiction("its end tells another number of samples"));
        }
        // The one block of memory that the column travels in from here on.
        let mut samples = Vec::with_capacity(count);
        let returned = self.samples.iter().filter(|s| !s.reading.no_return);
        samples.extend(returned.map(|sample| RawSample {
            lateral_counts: sample.lateral_counts,
            range_counts: sample.reading.range_counts,
            intensity: sample.reading.intensity,
            saturated: sample.reading.saturated,
        }));
        Ok(RawColumn {
            index,
            table_counts: self.shape.map_or(0, |shape| shape.table_counts),
            dropouts: (count - samples.len()) as u32,
            samples,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scanner_protocol::events::Laterals;
    use scanner_protocol::{MAX_COLUMN_FRAGMENTS, MAX_COLUMN_SAMPLES, Reading};

    fn fragment(index: u16, first_sample: u16, count: u16) -> ColumnFragment {
        let samples = (first_sample..first_sample + count).map(|sample| Sample {
            lateral_counts: i32::from(sample),
            reading: Reading::default(),
        });
        ColumnFragment {
            scan_id: 1,
            column: 0,
            fragment: index,
            fragments: MAX_COLUMN_FRAGMENTS,
            first_sample,
            table_counts: 7,
            laterals: Laterals::Listed(samples.collect()),
        }
    }

    #[test]
    fn the_longest_column_comes_together_however_much_is_missing() {
        let fragments: Vec<ColumnFragment> = (0..MAX_COLUMN_FRAGMENTS)
            .map(|index| {
                let first = index * 10;
                fragment(index, first, 10.min(MAX_COLUMN_SAMPLES - first))
            })
            .collect();
        let mut assembly = Assembly::default();
        // Every third arrives at first; the rest as it is asked for.
        for fragment in fragments.iter().step_by(3) {
            assert_eq!(assembly.fragment(fragment, MAX_COLUMN_SAMPLES), Ok(true));
        }
        let mut requests = 0;
        while !assembly.is_complete() {
            let missing = assembly.missing();
            requests += 1;
            for fragment in fragments.iter().filter(|f| missing.contains(f.fragment)) {
                assert_eq!(assembly.fragment(fragment, MAX_COLUMN_SAMPLES), Ok(true));
            }
        }
        // One request reaches 512 fragments.
        assert_eq!(requests, usize::from(MAX_COLUMN_FRAGMENTS).div_ceil(512));
        let column = assembly.finish(0).unwrap();
        assert_eq!(column.samples.len(), usize::from(MAX_COLUMN_SAMPLES));
        assert!(
            (0..)
                .zip(&column.samples)
                .all(|(i, s)| s.lateral_counts == i)
        );
    }

    #[test]
    fn nothing_of_a_column_is_left_for_the_next_one() {
        let mut assembly = Assembly::default();
        // A long one whole, one that ends in a contradiction, one that is given up, a short one.
        for (fragments, told) in [(3, Some(30)), (2, Some(30)), (2, None), (1, None)] {
            for index in 0..fragments {
                let part = ColumnFragment {
                    fragments,
                    ..fragment(index, index * 10, 10)
                };
                assert_eq!(assembly.fragment(&part, 100), Ok(true));
            }
            if let Some(samples) = told {
                let end = ColumnEnd {
                    scan_id: 1,
                    column: 0,
                    table_counts: 7,
                    fragments,
                    samples,
                };
                assert_eq!(assembly.end(&end, 100), Ok(()));
                let is_true = samples == fragments * 10;
                assert_eq!(assembly.finish(0).is_ok(), is_true);
            } else if fragments > 1 {
                assembly.clear();
            }
        }
        assert!(assembly.is_complete());
        let column = assembly.finish(1).unwrap();
        assert_eq!((column.samples.len(), column.dropouts), (10, 0));
    }

    #[test]
    fn parts_that_contradict_each_other_are_refused() {
        let check = |change: fn(&mut ColumnFragment)| {
            let mut assembly = Assembly::default();
            assert_eq!(
                assembly.fragment(&fragment(0, 0, 10), 2_000),
                Err(Contradiction("more fragments than samples"))
            );
            assert_eq!(assembly.fragment(&fragment(0, 0, 10), 60_000), Ok(true));
            assert_eq!(assembly.fragment(&fragment(0, 0, 10), 60_000), Ok(false));
            let mut next = fragment(1, 10, 10);
            change(&mut next);
            assert!(assembly.fragment(&next, 60_000).is_err());
        };
        check(|f| f.table_counts += 1);
        check(|f| f.fragments -= 1);
        check(|f| f.first_sample = 59_995);
        check(|f| f.fragment = f.fragments);
    }

    #[test]
    fn gaps_and_overlaps_and_wrong_counts_are_noticed() {
        let column = |second_sample: u16, told: u16| {
            let mut assembly = Assembly::default();
            for mut part in [fragment(0, 0, 10), fragment(1, second_sample, 10)] {
                part.fragments = 2;
                assembly.fragment(&part, 100)?;
            }
            let end = ColumnEnd {
                scan_id: 1,
                column: 0,
                table_counts: 7,
                fragments: 2,
                samples: told,
            };
            assembly.end(&end, 100)?;
            assembly.finish(0)
        };
        assert!(column(10, 20).is_ok());
        assert!(column(9, 20).is_err());
        assert!(column(11, 20).is_err());
        assert!(column(10, 21).is_err());
    }
}
