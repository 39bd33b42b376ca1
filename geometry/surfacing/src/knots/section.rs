//! The reference sections: those with the most relief (Koo & Lee, section 4.3).

use crate::grid::HeightGrid;

/// A section along a grid line: z at successive nodes, NaN where masked.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Index of the row (section in XZ) or column (in YZ).
    pub line: usize,
    /// z at its nodes, millimetres.
    pub z_mm: Vec<f64>,
    /// Length of the polyline through its nodes, millimetres. Gaps do not count.
    pub length_mm: f64,
}

/// The section in XZ and the one in YZ of which the polyline through the nodes is longest;
/// of equally long ones the first.
#[must_use]
pub fn longest_sections(grid: &HeightGrid) -> (Section, Section) {
    let rows = (0..grid.rows()).map(|j| (j, grid.row(j)));
    let columns = (0..grid.columns()).map(|i| (i, grid.column(i).to_vec()));
    (
        longest(rows, grid.pitch_mm()),
        longest(columns, grid.pitch_mm()),
    )
}

fn longest(lines: impl Iterator<Item = (usize, Vec<f64>)>, pitch_mm: f64) -> Section {
    let mut best = Section {
        line: 0,
        z_mm: Vec::new(),
        length_mm: -1.0,
    };
    for (line, z_mm) in lines {
        let steps = z_mm.windows(2).map(|pair| match pair {
            [a, b] if !(a.is_nan() || b.is_nan()) => {
                let rise = b - a;
                (pitch_mm * pitch_mm + rise * rise).sqrt()
            }
            _ => 0.0,
        });
        let length_mm = steps.sum();
        if length_mm > best.length_mm {
            best = Section {
                line,
                z_mm,
                length_mm,
            };
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_section_with_the_bump_is_the_reference() {
        let z: Vec<f64> = (0..10 * 12)
            .map(|n| if n == 4 * 12 + 7 { 5.0 } else { 0.0 })
            .collect();
        let grid = HeightGrid::new(1.0, [0.0; 2], 10, 12, z).unwrap();
        let (xz, yz) = longest_sections(&grid);
        assert_eq!((xz.line, yz.line), (7, 4));
        let bump = 2.0 * 26.0_f64.sqrt();
        assert!((xz.length_mm - (7.0 + bump)).abs() < 1e-12);
        assert!((yz.length_mm - (9.0 + bump)).abs() < 1e-12);
    }
}
