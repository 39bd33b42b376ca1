//! Faces turned so that neighbours run along their edge opposite ways.
//!
//! Some programs write a face whose loops run the wrong way round, as a fillet around an axis of
//! which the surface's other part would be meant. Its neighbours tell: each edge between two faces
//! is run along once each way.

use crate::{Body, Face};

/// The body with such faces mended.
pub(crate) fn oriented(body: &Body) -> Body {
    let mut body = body.clone();
    // Each time the face that is wrong along the most edges: its neighbours may be right then.
    for _ in 0..body.faces.len() {
        let shared = shared(&body).into_iter().enumerate();
        let wrong = shared.filter(|(_, [right, wrong])| *right == 0 && *wrong > 0);
        let Some((face, _)) =
            wrong.max_by_key(|(face, [_, wrong])| (*wrong, core::cmp::Reverse(*face)))
        else {
            break;
        };
        turn(&mut body.faces[face]);
    }
    body
}

/// Of each face how many of its edges another one runs along the other way, and the same way.
fn shared(body: &Body) -> Vec<[usize; 2]> {
    let mut uses: Vec<Vec<(usize, bool)>> = vec![Vec::new(); body.edges.len()];
    for (k, face) in body.faces.iter().enumerate() {
        for use_ in face.loops.iter().flatten() {
            if let Some(of_edge) = uses.get_mut(use_.edge) {
                of_edge.push((k, use_.is_reversed));
            }
        }
    }
    let mut shared: Vec<[usize; 2]> = vec![[0; 2]; body.faces.len()];
    for of_edge in &uses {
        if let [(a, a_is_reversed), (b, b_is_reversed)] = of_edge.as_slice()
            && a != b
        {
            let is_wrong = usize::from(a_is_reversed == b_is_reversed);
            shared[*a][is_wrong] += 1;
            shared[*b][is_wrong] += 1;
        }
    }
    shared
}

fn turn(face: &mut Face) {
    for border in &mut face.loops {
        border.reverse();
        border
            .iter_mut()
            .for_each(|use_| use_.is_reversed = !use_.is_reversed);
    }
    // Loops around an axis part the surface in two, either of which may be the face. Others go
    // around it, whichever way: there the outside is the other side.
    if face.surface.periods() == [None; 2] {
        face.same_sense = !face.same_sense;
    }
}
