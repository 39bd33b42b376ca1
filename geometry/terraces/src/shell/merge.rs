//! Faces on one surface are joined, and edges that go on in one curve.

use std::collections::BTreeMap;

use super::{Key, Path, Shell};
use crate::field::Field;
use crate::height::Height;
use crate::plan::{Support, angle, distance, sub};
use crate::union;

pub(super) fn join(shell: &mut Shell, field: &Field, heights: &[Height]) {
    surfaces(shell, field, heights);
    curves(shell);
}

/// Drops edges between faces on one surface. One that can run all round an axis stays cut open at
/// one place: readers expect it.
fn surfaces(shell: &mut Shell, field: &Field, heights: &[Height]) {
    let plan = &field.plan;
    // Groups of edges that go or stay together; those that are to stay if need be come last.
    let mut uprights: BTreeMap<(bool, usize, usize, usize), Vec<usize>> = BTreeMap::new();
    let mut seams = Vec::new();
    for edge in 0..shell.edges.len() {
        let faces = [0, 1].map(|k| shell.uses[shell.of_edge[edge][k]].face);
        let keys = faces.map(|face| shell.faces[face].key);
        if keys[0] != keys[1] {
            continue;
        }
        match (keys[0], shell.edges[edge].path) {
            (Key::Wall { support, .. }, Path::Upright { vertex }) => {
                let on = plan.supports[support];
                let [a, b] = [faces[0].min(faces[1]), faces[0].max(faces[1])];
                let is_last = match on {
                    Support::Line { .. } => false,
                    Support::Circle { c, r } => {
                        distance(plan.vertices[vertex], [c[0] + r, c[1]]) < 1e-5
                    }
                };
                let group = uprights.entry((is_last, vertex, a, b)).or_default();
                group.push(edge);
            }
            (Key::Top(surface), Path::Over { is_seam: true, .. })
                if heights[surface].axis().is_some() =>
            {
                seams.push((edge, surface));
            }
            _ => {
                union::join(&mut shell.parent, faces[0], faces[1]);
                drop(shell, edge);
            }
        }
    }
    for ((_, _, a, b), edges) in uprights {
        if union::join(&mut shell.parent, a, b) {
            edges.into_iter().for_each(|edge| drop(shell, edge));
        }
    }
    let mut groups: BTreeMap<(usize, usize, i64), Vec<usize>> = BTreeMap::new();
    for (edge, surface) in seams {
        let faces = [0, 1].map(|k| shell.root(shell.uses[shell.of_edge[edge][k]].face));
        let (
            Some(axis),
            Path::Over {
                support, from, to, ..
            },
        ) = (heights[surface].axis(), shell.edges[edge].path)
        else {
            continue;
        };
        let middle = plan.supports[support].at(0.5 * (from + to));
        let turn = (angle(sub(middle, axis)) * 1e5).round() as i64;
        let [a, b] = [faces[0].min(faces[1]), faces[0].max(faces[1])];
        groups.entry((a, b, turn)).or_default().push(edge);
    }
    // Those along x are kept, if one is: faces begin there.
    let mut groups: Vec<_> = groups.into_iter().collect();
    groups.sort_by_key(|((a, b, turn), _)| (*turn == 0, *a, *b, *turn));
    for ((a, b, _), edges) in groups {
        if union::join(&mut shell.parent, a, b) {
            edges.into_iter().for_each(|edge| drop(shell, edge));
        }
    }
}

fn drop(shell: &mut Shell, edge: usize) {
    for k in 0..2 {
        // The loop goes on where the other face's does.
        let (of, other) = (shell.of_edge[edge][k], shell.of_edge[edge][1 - k]);
        let (before, next) = (shell.uses[of].before, shell.uses[other].next);
        shell.uses[before].next = next;
        shell.uses[next].before = before;
    }
    shell.edges[edge].is_alive = false;
}

/// Joins edges of one curve between the same faces where nothing else ends.
fn curves(shell: &mut Shell) {
    let mut at: Vec<Vec<usize>> = vec![Vec::new(); shell.vertices.len()];
    for (index, edge) in shell.edges.iter().enumerate().filter(|(_, e)| e.is_alive) {
        edge.ends.iter().for_each(|&end| at[end].push(index));
    }
    for vertex in 0..at.len() {
        let [a, b] = at[vertex][..] else { continue };
        if a == b || !goes_on(shell, a, b) {
            continue;
        }
        // First the one that ends here, then the one that begins here.
        let (a, b) = match (shell.edges[a].ends, shell.edges[b].ends) {
            (ends, others) if ends[1] == vertex && others[0] == vertex => (a, b),
            (ends, others) if ends[0] == vertex && others[1] == vertex => (b, a),
            _ => continue,
        };
        let end = shell.edges[b].ends[1];
        if let (Path::Over { from, to, .. }, Path::Over { to: last, .. }) =
            (shell.edges[b].path, &mut shell.edges[a].path)
        {
            *last += to - from;
        }
        shell.edges[a].ends[1] = end;
        shell.edges[b].is_alive = false;
        for k in 0..2 {
            let of = shell.of_edge[b][k];
            let (before, next) = (shell.uses[of].before, shell.uses[of].next);
            shell.uses[before].next = next;
            shell.uses[next].before = before;
        }
        for other in &mut at[end] {
            if *other == b {
                *other = a;
            }
        }
        at[vertex].clear();
    }
}

/// Both run along one curve, between the same two faces.
fn goes_on(shell: &Shell, a: usize, b: usize) -> bool {
    let faces = |edge: usize| {
        let mut faces = [0, 1].map(|k| shell.root(shell.uses[shell.of_edge[edge][k]].face));
        faces.sort_unstable();
        faces
    };
    let is_one = match (shell.edges[a].path, shell.edges[b].path) {
        (Path::Over { support: s, .. }, Path::Over { support: t, .. }) => s == t,
        (Path::Upright { vertex: v }, Path::Upright { vertex: w }) => v == w,
        _ => false,
    };
    is_one && faces(a) == faces(b)
}
