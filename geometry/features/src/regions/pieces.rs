//! Connected pieces of nodes.

/// Neighbours of a node along columns and rows.
pub(crate) fn neighbours(
    columns: usize,
    rows: usize,
    node: usize,
) -> impl Iterator<Item = usize> + use<> {
    let (column, row) = (node / rows, node % rows);
    let beside = [
        (column > 0).then(|| node - rows),
        (column + 1 < columns).then(|| node + rows),
        (row > 0).then(|| node - 1),
        (row + 1 < rows).then(|| node + 1),
    ];
    beside.into_iter().flatten()
}

/// Connected pieces of the nodes that are wanted, in the order of their first nodes; neighbours are
/// connected if they are said to be.
pub(super) fn pieces(
    columns: usize,
    rows: usize,
    is_wanted: &dyn Fn(usize) -> bool,
    are_connected: &dyn Fn(usize, usize) -> bool,
) -> Vec<Vec<usize>> {
    let mut seen = vec![false; columns * rows];
    let mut pieces = Vec::new();
    for start in 0..seen.len() {
        if seen[start] || !is_wanted(start) {
            continue;
        }
        seen[start] = true;
        let mut piece = vec![start];
        let mut next = 0;
        while next < piece.len() {
            let node = piece[next];
            next += 1;
            for other in neighbours(columns, rows, node) {
                if !seen[other] && is_wanted(other) && are_connected(node, other) {
                    seen[other] = true;
                    piece.push(other);
                }
            }
        }
        pieces.push(piece);
    }
    pieces
}
