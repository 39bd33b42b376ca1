//! Unit normals from planes fitted to the nodes around (Shim & Lee 1995, section II.2).

use crate::grid::{Grid, Links};
use range_image::RangeImage;

/// Half the side of the 5 x 5 window.
const REACH: usize = 2;
/// Number of nodes in a full window.
const FULL: usize = (2 * REACH + 1) * (2 * REACH + 1);

/// Which nodes of the 5 x 5 window take part in the plane of its middle node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Window {
    /// All that have a value.
    Plain,
    /// Those that can be reached from the middle within the window without crossing a jump
    /// of z that is greater than this, in millimetres square to the surface.
    WithinSteps {
        /// The jump, millimetres.
        step_mm: f64,
    },
}

/// The unit normals of a range image, pointing to the camera's side (z positive).
#[derive(Debug, Clone, PartialEq)]
pub struct Normals {
    columns: usize,
    rows: usize,
    /// NaN where there is none.
    pub(crate) raw: Vec<[f64; 3]>,
}

impl Normals {
    /// The normal at a node, in the part frame; `None` where the node is masked, outside the
    /// image, or its window holds no three nodes off a line.
    #[must_use]
    pub fn at(&self, column: usize, row: usize) -> Option<[f64; 3]> {
        if column >= self.columns || row >= self.rows {
            return None;
        }
        self.of_node(column * self.rows + row)
    }

    /// All normals column by column, upwards within a column; NaN where there is none.
    #[must_use]
    pub fn raw(&self) -> &[[f64; 3]] {
        &self.raw
    }

    pub(crate) fn of_node(&self, node: usize) -> Option<[f64; 3]> {
        let normal = self.raw[node];
        (!normal[2].is_nan()).then_some(normal)
    }
}

/// Fits a plane to the 5 x 5 nodes around every node and gives their unit normals.
#[must_use]
pub fn normals(image: &RangeImage, window: Window) -> Normals {
    let grid = Grid::new(image);
    match window {
        Window::Plain => of_grid(&grid, None),
        Window::WithinSteps { step_mm } => of_grid(&grid, Some(&Links::new(&grid, step_mm))),
    }
}

/// As [`normals`]; windows end at steps where links are given.
pub(crate) fn of_grid(grid: &Grid<'_>, links: Option<&Links>) -> Normals {
    let mut raw = Vec::with_capacity(grid.nodes());
    for node in 0..grid.nodes() {
        let plane = if grid.is_valid(node) {
            plane(grid, links, node)
        } else {
            None
        };
        raw.push(plane.map_or([f64::NAN; 3], |[a, b]| {
            let (a, b) = (a / grid.pitch_mm, b / grid.pitch_mm);
            let length = libm::sqrt(a * a + b * b + 1.0);
            [-a / length, -b / length, 1.0 / length]
        }));
    }
    Normals {
        columns: grid.columns,
        rows: grid.rows,
        raw,
    }
}

/// Rise of the window's plane per column and per row, millimetres.
fn plane(grid: &Grid<'_>, links: Option<&Links>, node: usize) -> Option<[f64; 2]> {
    let (column, row) = grid.column_row(node);
    let (columns, rows) = grid.window(node, REACH);
    let mut values = [[f64::NAN; 2 * REACH + 1]; 2 * REACH + 1];
    let mut step = false;
    let mut count = 0;
    let z0 = grid.z_mm[node];
    for c in columns.clone() {
        for r in rows.clone() {
            let k = c * grid.rows + r;
            let z = grid.z_mm[k] - z0;
            values[c + REACH - column][r + REACH - row] = z;
            count += usize::from(!z.is_nan());
            step |= links.is_some_and(|links| links.begins_step(k));
        }
    }
    if let Some(links) = links.filter(|_| step) {
        keep_reachable(grid, links, node, &mut values);
        count = values.iter().flatten().filter(|z| !z.is_nan()).count();
    }
    if count == FULL {
        // Sums of u, v and uv vanish, and those of their squares are 50.
        let mut rise = [0.0; 2];
        for (u, line) in (-2..=2).map(f64::from).zip(&values) {
            for (v, z) in (-2..=2).map(f64::from).zip(line) {
                rise[0] += u * z;
                rise[1] += v * z;
            }
        }
        return Some(rise.map(|r| r / 50.0));
    }
    slanted(&values, count)
}

/// The plane through a window with gaps, by the normal equations about its centroid.
fn slanted(values: &[[f64; 5]; 5], count: usize) -> Option<[f64; 2]> {
    let mut sum = [0.0; 3];
    let mut product = [0.0; 5];
    for (u, line) in (-2..=2).map(f64::from).zip(values) {
        for (v, &z) in (-2..=2).map(f64::from).zip(line) {
            if !z.is_nan() {
                for (sum, value) in sum.iter_mut().zip([u, v, z]) {
                    *sum += value;
                }
                for (sum, value) in product.iter_mut().zip([u * u, u * v, v * v, u * z, v * z]) {
                    *sum += value;
                }
            }
        }
    }
    let n = count as f64;
    let [su, sv, sz] = sum;
    let [uu, uv, vv, uz, vz] = product;
    let (uu, uv, vv) = (uu - su * su / n, uv - su * sv / n, vv - sv * sv / n);
    let (uz, vz) = (uz - su * sz / n, vz - sv * sz / n);
    let determinant = uu * vv - uv * uv;
    // In whole numbers of pitches the determinant of nodes on a line is 0 but for rounding.
    (count >= 3 && determinant > 1e-6).then(|| {
        [
            (uz * vv - vz * uv) / determinant,
            (vz * uu - uz * uv) / determinant,
        ]
    })
}

/// Masks the values that no chain of links inside the window joins to its middle.
fn keep_reachable(grid: &Grid<'_>, links: &Links, node: usize, values: &mut [[f64; 5]; 5]) {
    let (column, row) = grid.column_row(node);
    let mut reached = [[false; 5]; 5];
    reached[REACH][REACH] = true;
    let mut stack = [node; FULL];
    let mut height = 1;
    while height > 0 {
        height -= 1;
        for next in links.linked(stack[height]) {
            let (c, r) = grid.column_row(next);
            if c.abs_diff(column) > REACH || r.abs_diff(row) > REACH {
                continue;
            }
            let seen = &mut reached[c + REACH - column][r + REACH - row];
            if !*seen {
                *seen = true;
                stack[height] = next;
                height += 1;
            }
        }
    }
    for (line, reached) in values.iter_mut().zip(reached) {
        for (z, reached) in line.iter_mut().zip(reached) {
            if !reached {
                *z = f64::NAN;
            }
        }
    }
}
