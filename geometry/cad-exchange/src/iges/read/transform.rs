//! Transformation matrices, entity 124.

use std::collections::HashMap;

use super::error::ReadError;
use super::file::{Entity, File};

/// Longest chain of matrices; a longer one bites its tail.
const MAX_CHAIN: usize = 32;

/// Three rows of a rotation and a shift: `p' = R p + T`.
pub(super) type Matrix = [[f64; 4]; 3];

/// Matrices to model space, by the pointers to them: each is read once, however many
/// entities it moves.
#[derive(Debug, Default)]
pub(super) struct Known(HashMap<i64, Matrix>);

impl Known {
    /// The matrix that takes an entity to model space; `None` where it is there already.
    pub(super) fn of(&mut self, file: &File, entity: &Entity) -> Result<Option<Matrix>, ReadError> {
        if entity.transformation == 0 {
            return Ok(None);
        }
        if let Some(known) = self.0.get(&entity.transformation) {
            return Ok(Some(*known));
        }
        let total = chain(file, entity)?;
        self.0.insert(entity.transformation, total);
        Ok(Some(total))
    }
}

/// The product of an entity's matrix and those that this one refers to.
fn chain(file: &File, entity: &Entity) -> Result<Matrix, ReadError> {
    let mut total: Option<Matrix> = None;
    let mut current = entity;
    for _ in 0..MAX_CHAIN {
        let matrix = file
            .entity(current.transformation)
            .filter(|matrix| matrix.entity == 124)
            .ok_or_else(|| {
                let pointer = current.transformation;
                file.defect(
                    current,
                    format!("D{pointer} is not a transformation matrix (124)"),
                )
            })?;
        let values: [f64; 12] = file.record(matrix)?.reals("an element of the matrix")?;
        let mut next = [[0.0; 4]; 3];
        for (row, values) in next.iter_mut().zip(values.chunks(4)) {
            row.copy_from_slice(values);
        }
        let product = total.map_or(next, |inner| after(&next, &inner));
        if matrix.transformation == 0 {
            return Ok(product);
        }
        total = Some(product);
        current = matrix;
    }
    Err(file.defect(
        entity,
        "its transformation matrices refer to each other in a circle",
    ))
}

/// The point taken along.
pub(super) fn apply(matrix: &Matrix, point: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = point;
    matrix.map(|row| row[0] * x + row[1] * y + row[2] * z + row[3])
}

/// First `inner`, then `outer`.
fn after(outer: &Matrix, inner: &Matrix) -> Matrix {
    let column = |k: usize| [inner[0][k], inner[1][k], inner[2][k]];
    outer.map(|row| {
        let dot = |c: [f64; 3]| row[0] * c[0] + row[1] * c[1] + row[2] * c[2];
        [
            dot(column(0)),
            dot(column(1)),
            dot(column(2)),
            dot(column(3)) + row[3],
        ]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_after_the_other() {
        let turn = [
            [0.0, -1.0, 0.0, 1.0],
            [1.0, 0.0, 0.0, 2.0],
            [0.0, 0.0, 1.0, 3.0],
        ];
        let shift = [
            [1.0, 0.0, 0.0, 10.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
        ];
        let point = [5.0, 6.0, 7.0];
        assert_eq!(apply(&turn, point), [-5.0, 7.0, 10.0]);
        for (outer, inner) in [(turn, shift), (shift, turn)] {
            let expected = apply(&outer, apply(&inner, point));
            assert_eq!(apply(&after(&outer, &inner), point), expected);
        }
    }
}
