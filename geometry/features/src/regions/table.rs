//! The table, where the part leaves it whole all around.

use range_image::{RangeImage, RegionMap};

/// Of the frame of the image the table takes at least this share of so many sides. A part that lies
/// along the columns, on a table of which nothing is seen, fills the image from side to side: of two
/// sides it has all ...
const LEAST_OF_SIDE: f64 = 0.3;
const LEAST_SIDES: usize = 3;
/// ... and of its borders with others at least this share rises from it.
const LEAST_RISING: f64 = 0.9;

/// Whether a region takes so much of the frame of the image that it may be what surrounds the part,
/// and no ledge of it.
pub(super) fn surrounds(map: &RegionMap, label: u16) -> bool {
    let (columns, rows) = (map.columns(), map.rows());
    let along = (0..columns).flat_map(|c| [(c, 0), (c, rows - 1)]);
    let frame = along.chain((0..rows).flat_map(|r| [(0, r), (columns - 1, r)]));
    let own = frame.filter(|(c, r)| map.label(*c, *r) == label).count();
    own as f64 >= SURROUNDS * (2 * (columns + rows)) as f64
}

/// Least share of the frame for that.
const SURROUNDS: f64 = 0.15;

/// The region that lies around and below all others, if one does: a part that is cut by none of
/// the view's sides stands on it.
pub(super) fn table(image: &RangeImage, map: &RegionMap) -> Option<u16> {
    let (columns, rows) = (image.columns(), image.rows());
    let mut of_sides = vec![[0_usize; 4]; usize::from(map.regions()) + 1];
    let mut rising = vec![[0_usize; 2]; of_sides.len()];
    let mut across = |a: (usize, usize), b: (usize, usize)| {
        let (la, lb) = (map.label(a.0, a.1), map.label(b.0, b.1));
        let (Some(za), Some(zb)) = (image.z_mm(a.0, a.1), image.z_mm(b.0, b.1)) else {
            return;
        };
        if la != lb && la != 0 && lb != 0 {
            rising[usize::from(la)][usize::from(zb > za)] += 1;
            rising[usize::from(lb)][usize::from(za > zb)] += 1;
        }
    };
    for column in 0..columns {
        for row in 0..rows {
            if column + 1 < columns {
                across((column, row), (column + 1, row));
            }
            if row + 1 < rows {
                across((column, row), (column, row + 1));
            }
            let at_sides = [
                column == 0,
                column + 1 == columns,
                row == 0,
                row + 1 == rows,
            ];
            let own = &mut of_sides[usize::from(map.label(column, row))];
            for (count, is_at) in own.iter_mut().zip(at_sides) {
                *count += usize::from(is_at);
            }
        }
    }
    let all = |label: u16| of_sides[usize::from(label)].iter().sum::<usize>();
    let label = (1..=map.regions()).max_by_key(|l| all(*l))?;
    let [falls, rises] = rising[usize::from(label)];
    let sides = of_sides[usize::from(label)]
        .iter()
        .zip([rows, rows, columns, columns])
        .filter(|(own, length)| **own as f64 >= LEAST_OF_SIDE * *length as f64)
        .count();
    let is_around = sides >= LEAST_SIDES;
    let is_below = rises > 0 && rises as f64 >= LEAST_RISING * (rises + falls) as f64;
    (is_around && is_below).then_some(label)
}
