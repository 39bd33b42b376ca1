//! Sections of a range image: its rows.

use range_image::RangeImage;

use crate::section::{LEAST_POINTS, Section};

/// Neighbouring nodes belong together if z changes by no more than this from one to the next,
/// pitches: a surface that turns from the camera by 79 degrees.
const STEEPEST: f64 = 5.0;

/// A run goes on over so many nodes that are missing, if z is near enough beyond them.
const MISSING: usize = 3;

/// A run goes on another if they overlap by this part of the shorter one.
const LEAST_OVERLAP: f64 = 0.5;

/// Sections, and how many nodes of the rows looked at are in none.
#[derive(Debug, Clone, PartialEq)]
pub struct Cut {
    /// Open sections, from the lowest row up.
    pub sections: Vec<Section>,
    /// Nodes in them.
    pub nodes: usize,
    /// Nodes in the same rows that are not, beyond a gap of more than three nodes or a step.
    pub left_out: usize,
}

/// A run of nodes in a row without a gap or a step.
#[derive(Debug, Clone, Copy)]
struct Run {
    from: usize,
    to: usize,
}

impl Run {
    fn length(self) -> usize {
        self.to - self.from
    }

    fn overlap(self, other: Self) -> usize {
        let (from, to) = (self.from.max(other.from), self.to.min(other.to));
        to.saturating_sub(from)
    }

    fn goes_on(self, other: Self) -> bool {
        let shorter = self.length().min(other.length());
        self.overlap(other) as f64 >= LEAST_OVERLAP * shorter as f64
    }
}

/// Cuts a range image into its rows, every so many of them: of each row a run of nodes without a gap
/// or a step, so that each goes on that of the row below and they have as many nodes as can be.
#[must_use]
pub fn cut(image: &RangeImage, every_rows: usize) -> Cut {
    let every = every_rows.max(1);
    let rows: Vec<usize> = (0..image.rows()).step_by(every).collect();
    let runs: Vec<Vec<Run>> = rows.iter().map(|row| runs(image, *row)).collect();
    let taken = chain(&runs);
    let section = |(k, run): &(usize, Run)| {
        let row = rows[*k];
        let place = |column: usize| {
            let z_mm = image.z_mm(column, row)?;
            Some([image.x_mm(column), image.y_mm(row), z_mm])
        };
        Section {
            name: format!("the row at y = {:.2} mm", image.y_mm(row)),
            points: (run.from..run.to).filter_map(place).collect(),
            is_closed: false,
            is_directed: true,
        }
    };
    let sections: Vec<Section> = taken.iter().map(section).collect();
    let nodes: usize = sections.iter().map(|section| section.points.len()).sum();
    let of_row = |row: &usize| {
        (0..image.columns())
            .filter(|c| image.z_mm(*c, *row).is_some())
            .count()
    };
    let all: usize = rows.iter().map(of_row).sum();
    Cut {
        sections,
        nodes,
        left_out: all - nodes,
    }
}

/// The runs of neighbouring rows that go on each other and have the most nodes together: for each run
/// the best that ends with it follows from those of the row below.
fn chain(runs: &[Vec<Run>]) -> Vec<(usize, Run)> {
    let mut best: Vec<Vec<(usize, Option<usize>)>> = Vec::with_capacity(runs.len());
    for (k, of_row) in runs.iter().enumerate() {
        let ending = |run: &Run| {
            let below = k.checked_sub(1).map(|k| runs[k].iter().zip(&best[k]));
            let below = below.into_iter().flatten().enumerate();
            let before = below.filter(|(_, (other, _))| run.goes_on(**other));
            let before = before.max_by_key(|(_, (_, (nodes, _)))| *nodes);
            match before {
                Some((which, (_, (nodes, _)))) => (nodes + run.length(), Some(which)),
                None => (run.length(), None),
            }
        };
        best.push(of_row.iter().map(ending).collect());
    }
    let ends = best.iter().enumerate();
    let ends = ends.flat_map(|(k, of_row)| (0..of_row.len()).map(move |which| (k, which)));
    let mut at = ends.max_by_key(|(k, which)| best[*k][*which].0);
    let mut taken = Vec::new();
    while let Some((k, which)) = at {
        taken.push((k, runs[k][which]));
        at = best[k][which]
            .1
            .and_then(|before| Some((k.checked_sub(1)?, before)));
    }
    taken.reverse();
    taken
}

/// The runs of a row that are long enough for a section.
fn runs(image: &RangeImage, row: usize) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let mut before: Option<(usize, f64)> = None;
    for column in 0..image.columns() {
        let Some(z_mm) = image.z_mm(column, row) else {
            continue;
        };
        let goes_on = before.is_some_and(|(last, last_z_mm)| {
            let apart = column - last;
            let farthest_mm = STEEPEST * image.pitch_mm() * apart as f64;
            apart <= MISSING + 1 && (z_mm - last_z_mm).abs() <= farthest_mm
        });
        match runs.last_mut().filter(|_| goes_on) {
            Some(run) => run.to = column + 1,
            None => runs.push(Run {
                from: column,
                to: column + 1,
            }),
        }
        before = Some((column, z_mm));
    }
    let nodes = |run: &Run| {
        (run.from..run.to)
            .filter(|c| image.z_mm(*c, row).is_some())
            .count()
    };
    runs.retain(|run| nodes(run) >= LEAST_POINTS);
    runs
}

#[cfg(test)]
mod tests {
    use range_image::Lattice;

    use super::*;

    #[test]
    fn rows_go_on_as_far_as_they_hang_together() {
        let lattice = Lattice { pitch_mm: 0.5 };
        let mut image = RangeImage::masked(lattice, 0, 0, 40, 12);
        for row in 0..12 {
            for column in 5..30 {
                // A step at column 20 in row 6, and nothing in row 9.
                let z = if row == 6 && column >= 20 { 40.0 } else { 1.0 };
                let is_there = row != 9 && !(row == 3 && column < 12);
                image.set_z_mm(column, row, is_there.then_some(z));
            }
        }
        let found = cut(&image, 3);
        let lengths: Vec<usize> = found.sections.iter().map(|own| own.points.len()).collect();
        // Rows 0, 3 and 6, of which the longer part; row 9 is empty, so that the body
        // ends there.
        assert_eq!(lengths, [25, 18, 15]);
        assert_eq!((found.nodes, found.left_out), (58, 10));
        assert_eq!(found.sections[1].name, "the row at y = 1.50 mm");
        assert_eq!(found.sections[1].points[0], [6.0, 1.5, 1.0]);
    }

    #[test]
    fn gaps_of_three_nodes_are_bridged_and_what_hardly_overlaps_does_not_go_on() {
        let lattice = Lattice { pitch_mm: 0.5 };
        let mut image = RangeImage::masked(lattice, 0, 0, 40, 3);
        for column in 0..24 {
            // Three nodes are missing in the first row, four in the second.
            let is_there = |row: usize| !(10..13 + row).contains(&column);
            for row in [0, 1] {
                image.set_z_mm(column, row, is_there(row).then_some(1.0));
            }
        }
        // The third row begins where the second ends.
        for column in 20..38 {
            image.set_z_mm(column, 2, Some(1.0));
        }
        let found = cut(&image, 1);
        let lengths: Vec<usize> = found.sections.iter().map(|own| own.points.len()).collect();
        assert_eq!(lengths, [21, 10]);
        assert_eq!(found.left_out, 10 + 18);
    }

    #[test]
    fn the_body_is_where_most_nodes_hang_together() {
        let lattice = Lattice { pitch_mm: 0.5 };
        let mut image = RangeImage::masked(lattice, 0, 0, 60, 8);
        for row in 0..8 {
            // One wide row to the left, and eight narrow ones to the right.
            let wide = if row == 4 { 0..30 } else { 0..0 };
            for column in wide.chain(40..50) {
                image.set_z_mm(column, row, Some(1.0));
            }
        }
        let found = cut(&image, 1);
        assert_eq!(
            (found.sections.len(), found.nodes, found.left_out),
            (8, 80, 30)
        );
    }
}
