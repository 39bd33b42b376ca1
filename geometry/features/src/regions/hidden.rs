//! What walls hide: runs of nodes without a region between a higher surface and a lower one.

use range_image::RangeImage;

use super::{NONE, OUTSIDE, Regions, UNKNOWN_MM};

/// Gives each unlabelled node to the lower of the regions at the two ends of its run along the
/// column, or along the row if that is shorter, where these are of different heights: a ray that
/// passes an edge falls on what lies beyond. Beyond the frame lies what surrounds the part.
pub(super) fn hidden(image: &RangeImage, divided: &mut Regions, step_mm: f64) {
    let (columns, rows) = (divided.columns, divided.rows);
    // For each node the shortest run that tells something, and what it tells.
    let mut told: Vec<(u32, u16)> = vec![(u32::MAX, NONE); divided.labels.len()];
    for column in 0..columns {
        let line: Vec<usize> = (0..rows).map(|row| column * rows + row).collect();
        runs(image, divided, &line, step_mm, &mut told);
    }
    for row in 0..rows {
        let line: Vec<usize> = (0..columns).map(|column| column * rows + row).collect();
        runs(image, divided, &line, step_mm, &mut told);
    }
    for (label, (_, own)) in divided.labels.iter_mut().zip(told) {
        if *label == NONE && own != NONE {
            *label = own;
        }
    }
}

fn runs(
    image: &RangeImage,
    divided: &Regions,
    line: &[usize],
    step_mm: f64,
    told: &mut [(u32, u16)],
) {
    let mut start = 0;
    while start < line.len() {
        if divided.labels[line[start]] != NONE {
            start += 1;
            continue;
        }
        let mut end = start;
        while end < line.len() && divided.labels[line[end]] == NONE {
            end += 1;
        }
        let at = |index: Option<usize>| match index.and_then(|k| line.get(k)) {
            Some(&node) => {
                let z_mm = divided.height_mm(image, node);
                (divided.labels[node], z_mm.unwrap_or(UNKNOWN_MM))
            }
            None => (OUTSIDE, UNKNOWN_MM),
        };
        let (one, other) = (at(start.checked_sub(1)), at(Some(end)));
        let length = u32::try_from(end - start).unwrap_or(u32::MAX);
        if (one.1 - other.1).abs() > step_mm {
            let lower = if one.1 < other.1 { one.0 } else { other.0 };
            for node in &line[start..end] {
                if length < told[*node].0 {
                    told[*node] = (length, lower);
                }
            }
        }
        start = end;
    }
}
