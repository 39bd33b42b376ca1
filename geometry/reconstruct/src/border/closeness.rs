//! How closely borders are to follow the nodes beside them, where that is asked for.

use super::cracks::Chain;

/// Borders that pass a node within so many nodes are followed as closely as is asked for it: they may
/// be drawn past it by more than a pitch.
const ASKED_NODES: i64 = 2;

/// How closely each border is to be followed; of none where nothing is asked of any node. Columns and
/// rows of nodes, column by column.
pub(crate) fn levels(
    chains: &[Chain],
    closeness: &[u8],
    (columns, rows): (usize, usize),
) -> Vec<usize> {
    if closeness.is_empty() {
        return Vec::new();
    }
    let (columns, rows) = (columns as i64, rows as i64);
    let near = |middle: &[f64; 2]| {
        let [i, j] = middle.map(|at| at.floor() as i64);
        let around = (i - ASKED_NODES + 1..=i + ASKED_NODES)
            .flat_map(move |i| (j - ASKED_NODES + 1..=j + ASKED_NODES).map(move |j| (i, j)));
        let within = around.filter(|(i, j)| (0..columns).contains(i) && (0..rows).contains(j));
        within
            .filter_map(|(i, j)| closeness.get((i * rows + j) as usize))
            .max()
    };
    let of_chain = |chain: &Chain| {
        let most = chain.middles.iter().filter_map(near).max();
        most.map_or(0, |most| usize::from(*most))
    };
    chains.iter().map(of_chain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_border_within_two_nodes_is_asked_and_others_are_not() {
        let chain = |x: f64| Chain {
            middles: (0..9).map(|j| [x, f64::from(j) + 0.5]).collect(),
            left: 1,
            right: 2,
            ends: None,
        };
        let chains = [chain(2.5), chain(4.5), chain(7.5)];
        let mut closeness = vec![0; 90];
        assert_eq!(levels(&chains, &closeness, (10, 9)), [0, 0, 0]);
        closeness[4 * 9 + 3] = 2;
        closeness[4 * 9 + 4] = 1;
        assert_eq!(levels(&chains, &closeness, (10, 9)), [2, 2, 0]);
        assert!(levels(&chains, &[], (10, 9)).is_empty());
    }
}
