//! How much of what was measured around a node agrees with it.

use colorous::CIVIDIS;
use range_image::RangeImage;

use super::canvas::Canvas;
use super::plot::Plot;
use super::scale::{LEAST_PLOT, ROOM, Scale};

/// The share of each node's window that lies in the node's surface, as colour; `None`
/// where the image says nothing of it.
pub(super) fn draw(image: &RangeImage, name: &str) -> Option<Canvas> {
    let mut shares: Vec<f64> = image.qualities().map(|q| q.inlier_share()).collect();
    if shares.is_empty() {
        return None;
    }
    shares.sort_by(f64::total_cmp);
    let median = shares.get(shares.len() / 2).copied().unwrap_or(0.0);
    let minority = shares.partition_point(|&share| share < 0.5) as f64 / shares.len() as f64;
    let subtitle = format!(
        "samples around a node that lie in its surface: median {:.0} %, under half at {:.1} %",
        100.0 * median,
        100.0 * minority
    );
    let scale = Scale {
        heading: "inliers (%)",
        low: 0.0,
        high: 100.0,
        open: false,
        colour: &|share| {
            let colour = CIVIDIS.eval_continuous(share);
            [colour.r, colour.g, colour.b]
        },
    };
    let mut plot = Plot::new(image, name, &subtitle, ROOM, LEAST_PLOT);
    plot.paint(image, |column, row| {
        let quality = image.quality(column, row)?;
        Some(scale.of(100.0 * quality.inlier_share()))
    });
    scale.draw(&mut plot);
    plot.axes(image);
    Some(plot.canvas)
}
