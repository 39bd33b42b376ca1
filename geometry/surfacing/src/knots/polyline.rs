//! Knots where a polyline needs its vertices (Koo & Lee, Figure 5, 2).

use crate::axis::Breaks;
use crate::grid::HeightGrid;
use crate::knots::{Knots, Section, longest_sections};

/// Nodes that remain of a section when those within `tolerance_mm` of the polyline through
/// the remaining ones are left out (Douglas & Peucker 1973). Gaps separate polylines.
#[must_use]
pub fn simplified(z_mm: &[f64], pitch_mm: f64, tolerance_mm: f64) -> Vec<usize> {
    let mut kept = Vec::new();
    let mut start = 0;
    while start < z_mm.len() {
        if z_mm[start].is_nan() {
            start += 1;
            continue;
        }
        let run = z_mm[start..].iter().take_while(|z| !z.is_nan()).count();
        let last = start + run - 1;
        kept.push(start);
        let mut open = vec![(start, last)];
        while let Some((from, to)) = open.pop() {
            let run_mm = (to - from) as f64 * pitch_mm;
            let rise_mm = z_mm[to] - z_mm[from];
            let length_mm = (run_mm * run_mm + rise_mm * rise_mm).sqrt();
            let off = |k: usize| {
                let along = (k - from) as f64 * pitch_mm;
                ((z_mm[k] - z_mm[from]) * run_mm - rise_mm * along).abs() / length_mm
            };
            let farthest = (from + 1..to).max_by(|&a, &b| off(a).total_cmp(&off(b)));
            match farthest {
                Some(k) if off(k) > tolerance_mm => open.extend([(k, to), (from, k)]),
                _ if to > from => kept.push(to),
                _ => {}
            }
        }
        start = last + 1;
    }
    kept.sort_unstable();
    kept.dedup();
    kept
}

/// Knots at the vertices of both reference sections.
pub(crate) fn place(grid: &HeightGrid, tolerance_mm: f64) -> Knots {
    let (xz, yz) = longest_sections(grid);
    let knots = |section: &Section, nodes: usize| {
        let vertices = simplified(&section.z_mm, grid.pitch_mm(), tolerance_mm);
        Breaks::new(nodes, vertices.iter().map(|&k| k as f64).collect()).solvable()
    };
    Knots {
        u: knots(&xz, grid.columns()),
        v: knots(&yz, grid.rows()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_stand_where_the_line_turns() {
        let z: Vec<f64> = (0..21)
            .map(|k| f64::from(if k < 8 { k } else { 16 - k }) * 0.5)
            .collect();
        assert_eq!(simplified(&z, 1.0, 0.01), [0, 8, 20]);
        let mut holed = z;
        holed[12] = f64::NAN;
        assert_eq!(simplified(&holed, 1.0, 0.01), [0, 8, 11, 13, 20]);
    }

    #[test]
    fn no_node_lies_farther_off_than_the_tolerance() {
        let z: Vec<f64> = (0..200)
            .map(|k| libm::sin(f64::from(k) * 0.07) * 4.0)
            .collect();
        let kept = simplified(&z, 0.5, 0.05);
        assert!(kept.len() > 8 && kept.len() < 60, "{}", kept.len());
        for pair in kept.windows(2) {
            for k in pair[0]..pair[1] {
                let share = (k - pair[0]) as f64 / (pair[1] - pair[0]) as f64;
                let chord = z[pair[0]] + share * (z[pair[1]] - z[pair[0]]);
                // Along the normal no more than along z.
                let slope = (z[pair[1]] - z[pair[0]]) / ((pair[1] - pair[0]) as f64 * 0.5);
                let off = (z[k] - chord).abs() / (1.0 + slope * slope).sqrt();
                assert!(off <= 0.05 + 1e-12, "{off} at {k}");
            }
        }
    }
}
