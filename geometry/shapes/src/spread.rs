//! A few of many.

/// The golden section of the unit, whose multiples fall as evenly as can be.
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// Indices of at most `most` among `count` things, ascending and evenly spread, one from each
/// of as many equal stretches. They are in step with nothing: samples come row by row, and
/// each so-manieth of them would be of one row.
pub fn spread(count: usize, most: usize) -> impl Iterator<Item = usize> {
    let few = most.min(count);
    let of_all = move |k: usize| match k.checked_mul(count) {
        Some(all) => all / few,
        None => (k as u128 * count as u128 / few as u128) as usize,
    };
    (0..few).map(move |k| {
        if few == count {
            return k;
        }
        let [first, next] = [k, k + 1].map(of_all);
        let turn = u128::from((k as u64).wrapping_mul(GOLDEN));
        first + ((turn * (next - first) as u128) >> 64) as usize
    })
}

/// Whether this index is of the share of all that so many halvings leave: for when it is not
/// known beforehand how many there are. Each share holds the next, and is as evenly spread.
#[must_use]
pub fn is_in_share(index: u64, halvings: u32) -> bool {
    index.wrapping_mul(GOLDEN).leading_zeros() >= halvings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_taken_where_they_are_few() {
        assert!(spread(7, 10).eq(0..7) && spread(7, 7).eq(0..7));
        assert_eq!(spread(0, 10).count() + spread(10, 0).count(), 0);
    }

    #[test]
    fn a_few_ascend_and_are_of_every_row() {
        let few: Vec<usize> = spread(60_000, 1000).collect();
        assert!(few.len() == 1000 && few.is_sorted_by(|a, b| a < b));
        assert!(few.windows(2).all(|pair| pair[1] - pair[0] <= 120));
        let mut of_row = [0; 60];
        for index in few {
            of_row[index % 60] += 1;
        }
        assert!(
            of_row.iter().all(|count| (10..25).contains(count)),
            "{of_row:?}"
        );
    }
}
