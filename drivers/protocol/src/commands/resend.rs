//! Asking again for what was lost.

use crate::wire::{MessageError, Reader, Wire, Writer, message};

/// Most bytes of a bitmap of missing fragments: 512 fragments in one request.
pub const RESEND_BITMAP: usize = 64;

message! {
    /// Asks for a column, or for some of its fragments, again. Not answered by itself: the
    /// fragments come again, then the column's end. The device passes over a column that
    /// it has not measured yet, or that has been acknowledged.
    Resend = 0x41 {
        /// The scan's number.
        scan_id: u16,
        /// Which column.
        column: u32,
        /// Which of its fragments.
        missing: Missing,
    }
}

/// Which fragments of a column are missing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Missing {
    /// The fragment of the bitmap's first bit.
    pub first_fragment: u16,
    /// Bit `k % 8` of byte `k / 8`, lowest bit first, stands for fragment
    /// `first_fragment + k`. Without any byte the whole column is meant.
    pub bitmap: heapless::Vec<u8, RESEND_BITMAP>,
}

impl Missing {
    /// The whole column.
    #[must_use]
    pub fn whole() -> Self {
        Self {
            first_fragment: 0,
            bitmap: heapless::Vec::new(),
        }
    }

    /// These fragments, in rising order. What is beyond the reach of one bitmap, counted
    /// from the first, is left out: it is asked for once the others have come.
    #[must_use]
    pub fn of(fragments: impl IntoIterator<Item = u16>) -> Self {
        let mut missing = Self::whole();
        let mut first = None;
        for fragment in fragments {
            let first = *first.get_or_insert(fragment);
            let Some(bit) = fragment.checked_sub(first).map(usize::from) else {
                continue;
            };
            if bit / 8 >= RESEND_BITMAP {
                break;
            }
            if bit / 8 >= missing.bitmap.len() {
                let _ = missing.bitmap.resize(bit / 8 + 1, 0);
            }
            if let Some(byte) = missing.bitmap.get_mut(bit / 8) {
                *byte |= 1 << (bit % 8);
            }
        }
        missing.first_fragment = first.unwrap_or(0);
        missing
    }

    /// Whether this fragment is asked for.
    #[must_use]
    pub fn contains(&self, fragment: u16) -> bool {
        if self.bitmap.is_empty() {
            return true;
        }
        fragment
            .checked_sub(self.first_fragment)
            .map(usize::from)
            .is_some_and(|bit| {
                self.bitmap
                    .get(bit / 8)
                    .is_some_and(|byte| byte >> (bit % 8) & 1 == 1)
            })
    }
}

impl Wire for Missing {
    fn put(&self, out: &mut Writer) {
        self.first_fragment.put(out);
        // RESEND_BITMAP is below 256.
        (self.bitmap.len() as u8).put(out);
        out.put(&self.bitmap);
    }

    fn get(input: &mut Reader<'_>) -> Result<Self, MessageError> {
        let first_fragment = Wire::get(input)?;
        let len = usize::from(u8::get(input)?);
        if len > RESEND_BITMAP {
            return Err(MessageError::BadValue);
        }
        let bitmap =
            heapless::Vec::from_slice(input.take(len)?).map_err(|_| MessageError::BadValue)?;
        Ok(Self {
            first_fragment,
            bitmap,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bitmap_holds_exactly_the_fragments_asked_for() {
        let missing = Missing::of([3, 4, 11, 514]);
        for fragment in 0..600 {
            assert_eq!(
                missing.contains(fragment),
                [3, 4, 11, 514].contains(&fragment),
                "{fragment}"
            );
        }
        assert_eq!(missing.bitmap.len(), RESEND_BITMAP);
        assert!(!Missing::of([3, 515]).contains(515));
        assert!(Missing::whole().contains(65_535));
    }
}
