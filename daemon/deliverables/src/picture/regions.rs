//! The regions in colours over the shaded part, with borders and numbers.

use colorous::TABLEAU10;
use pipeline::{BackgroundKind, NodeRole, Outcome};
use range_image::{RangeImage, RegionMap};

use super::borders;
use super::canvas::{Canvas, Mask, Rgb, TEXT_HEIGHT, Weight, text_width};
use super::plot::{FAINT, INK, PAPER, Plot, dimmed, shade};

const LEGEND_GAP: usize = 24;
const LEGEND_ROOM: usize = 380;
const LEGEND_LINE: usize = 22;
/// Least height that the legend gets, pixels.
const LEGEND_HEIGHT: usize = 300;
/// Nodes of a removed table, back plane or fixture.
const BACKGROUND: Rgb = [186, 190, 196];
/// Nodes that no region took: a colour that no region has.
const CRUMB: Rgb = [255, 0, 170];

/// A line of the legend.
#[derive(Debug, Clone, PartialEq)]
pub struct RegionNote {
    /// Label of the region, as in the region map.
    pub label: u16,
    /// What is said about it beside its colour.
    pub text: String,
}

/// Regions as colours over the shaded surface; the trim loops and their vertices on top.
pub(super) fn draw(
    image: &RangeImage,
    outcome: &Outcome,
    notes: &[RegionNote],
    name: &str,
) -> Canvas {
    let (regions, model) = (&outcome.regions, &outcome.reconstruction.model);
    let subtitle = format!(
        "regions: {}, trimmed faces: {}, edges: {}",
        regions.regions(),
        model.faces.len(),
        model.edges.len()
    );
    let mut plot = Plot::new(image, name, &subtitle, LEGEND_ROOM, LEGEND_HEIGHT);
    let rows = image.rows();
    plot.paint(image, |column, row| {
        let role = outcome.roles.get(column * rows + row)?;
        let label = regions.label(column, row);
        let same = |c: usize, r: usize| regions.label(c, r) == label;
        // Colours of the legend must be known again in the picture.
        let light = 0.62 + 0.44 * shade(image, column, row, same);
        match role {
            NodeRole::Masked => None,
            NodeRole::Part => Some(dimmed(colour(label), light.min(1.05))),
            NodeRole::Filled => Some(hatched(colour(label), column, row)),
            NodeRole::Background => Some(dimmed(BACKGROUND, (0.4 + 0.6 * light).min(1.05))),
            NodeRole::Crumb => Some(CRUMB),
        }
    });
    borders::draw(&mut plot, image, model);
    plot.axes(image);
    numbers(&mut plot, image, regions);
    let height = plot.height().max(LEGEND_HEIGHT);
    legend(&mut plot, &listed(notes), &others(outcome), height);
    plot.canvas
}

/// What was closed and not measured: the region's colour and white in turn, node by node.
fn hatched(own: Rgb, column: usize, row: usize) -> Rgb {
    if (column + row) % 2 == 0 { own } else { PAPER }
}

/// A colour of its own for each region: a tested palette first, then hues by the golden
/// ratio, which keeps successive ones far apart.
fn colour(label: u16) -> Rgb {
    if let Some(colour) = usize::from(label)
        .checked_sub(1)
        .and_then(|k| TABLEAU10.get(k))
    {
        return [colour.r, colour.g, colour.b].map(|c| super::canvas::mix(c, 255, 0.12));
    }
    let sixth = (f64::from(label) * 0.618_033_988_749_895).fract() * 6.0;
    [5.0, 3.0, 1.0].map(|offset: f64| {
        let k = (offset + sixth) % 6.0;
        let strength = k.min(4.0 - k).clamp(0.0, 1.0);
        (225.0 - 130.0 * strength).round() as u8
    })
}

/// For each region the node farthest from its border, counted in steps along the grid.
fn middles(image: &RangeImage, regions: &RegionMap) -> Vec<(u16, (usize, usize))> {
    let (columns, rows) = (image.columns(), image.rows());
    let mut depth = vec![0_u32; columns * rows];
    let index = |c: usize, r: usize| c * rows + r;
    let step = |depth: &mut [u32], c: usize, r: usize, neighbours: [Option<(usize, usize)>; 2]| {
        let label = regions.label(c, r);
        let mut least = depth.get(index(c, r)).copied().unwrap_or(0);
        for neighbour in neighbours {
            let beyond = match neighbour {
                Some((c, r)) if c < columns && r < rows && regions.label(c, r) == label => {
                    depth.get(index(c, r)).copied().unwrap_or(0)
                }
                _ => 0,
            };
            least = least.min(beyond + 1);
        }
        if let Some(entry) = depth.get_mut(index(c, r)) {
            *entry = if label == 0 { 0 } else { least };
        }
    };
    depth.fill(u32::MAX - 1);
    for c in 0..columns {
        for r in 0..rows {
            let left = c.checked_sub(1).map(|c| (c, r));
            let below = r.checked_sub(1).map(|r| (c, r));
            step(&mut depth, c, r, [left, below]);
        }
    }
    for c in (0..columns).rev() {
        for r in (0..rows).rev() {
            step(&mut depth, c, r, [Some((c + 1, r)), Some((c, r + 1))]);
        }
    }
    plateau_centres(regions, columns, rows, &depth)
}

/// For each region, of its deepest nodes the one nearest to their common middle.
fn plateau_centres(
    regions: &RegionMap,
    columns: usize,
    rows: usize,
    depth: &[u32],
) -> Vec<(u16, (usize, usize))> {
    let mut deepest: Vec<(u32, Vec<(usize, usize)>)> =
        vec![(0, Vec::new()); usize::from(regions.regions())];
    for c in 0..columns {
        for r in 0..rows {
            let deep = depth.get(c * rows + r).copied().unwrap_or(0);
            let label = usize::from(regions.label(c, r));
            let Some(entry) = label.checked_sub(1).and_then(|k| deepest.get_mut(k)) else {
                continue;
            };
            if deep > entry.0 {
                *entry = (deep, vec![(c, r)]);
            } else if deep == entry.0 && deep > 0 {
                entry.1.push((c, r));
            }
        }
    }
    let centre = |nodes: &[(usize, usize)]| -> Option<(usize, usize)> {
        let count = nodes.len().max(1);
        let c = nodes.iter().map(|n| n.0).sum::<usize>() / count;
        let r = nodes.iter().map(|n| n.1).sum::<usize>() / count;
        nodes
            .iter()
            .copied()
            .min_by_key(|n| n.0.abs_diff(c).pow(2) + n.1.abs_diff(r).pow(2))
    };
    let labelled = (1..=regions.regions()).zip(deepest);
    labelled
        .filter_map(|(label, (_, nodes))| Some((label, centre(&nodes)?)))
        .collect()
}

/// The number of each region in a white lozenge at the region's middle.
fn numbers(plot: &mut Plot, image: &RangeImage, regions: &RegionMap) {
    let mut mask = Mask::like(&plot.canvas);
    let mut texts = Vec::new();
    for (label, (column, row)) in middles(image, regions) {
        let [x, y] = plot.place(image, image.x_mm(column), image.y_mm(row));
        let text = label.to_string();
        let half = text_width(&text) as f64 / 2.0;
        mask.stroke([x - half + 4.0, y], [x + half - 4.0, y], 11.0);
        let left = (x - half).round().max(0.0) as usize;
        let top = (y - TEXT_HEIGHT as f64 / 2.0).round().max(0.0) as usize;
        texts.push((left, top, text));
    }
    plot.canvas.stencil(&mask, PAPER);
    for (left, top, text) in texts {
        plot.canvas.text(left, top, &text, Weight::Bold, INK);
    }
}

/// A line of the legend, ready to be drawn.
struct Entry {
    colour: Rgb,
    text: String,
}

fn listed(notes: &[RegionNote]) -> Vec<Entry> {
    let entry = |note: &RegionNote| Entry {
        colour: colour(note.label),
        text: format!("{:>3}  {}", note.label, note.text),
    };
    notes.iter().map(entry).collect()
}

/// What is no region: the background, and crumbs.
fn others(outcome: &Outcome) -> Vec<Entry> {
    let mut entries = Vec::new();
    for kind in [
        BackgroundKind::Table,
        BackgroundKind::BackPlane,
        BackgroundKind::Fixture,
    ] {
        let of_kind = outcome.background.regions.iter().filter(|r| r.kind == kind);
        let nodes: usize = of_kind.map(|region| region.nodes).sum();
        if nodes > 0 {
            entries.push(Entry {
                colour: BACKGROUND,
                text: format!("{kind}, {nodes} nodes, left out"),
            });
        }
    }
    if let Some(filling) = outcome.filling.as_ref().filter(|f| !f.filled.is_empty()) {
        entries.push(Entry {
            colour: PAPER,
            text: format!("chequered: {} nodes of closed holes", filling.filled.len()),
        });
    }
    let crumbs = &outcome.crumbs;
    if !crumbs.is_empty() {
        let nodes: usize = crumbs.iter().map(|crumb| crumb.nodes).sum();
        let plural = if crumbs.len() == 1 { "" } else { "s" };
        entries.push(Entry {
            colour: CRUMB,
            text: format!("{} crumb{plural}, {nodes} nodes", crumbs.len()),
        });
    }
    entries
}

/// The regions as far as there is room, then what is no region, which is always told.
fn legend(plot: &mut Plot, regions: &[Entry], others: &[Entry], height: usize) {
    let (left, top) = (plot.right() + LEGEND_GAP, plot.top());
    let lines = (height / LEGEND_LINE).saturating_sub(others.len());
    let shown = if regions.len() > lines {
        lines.saturating_sub(1)
    } else {
        regions.len()
    };
    let mut y = top;
    for entry in regions.iter().take(shown) {
        draw_entry(plot, left, y, entry);
        y += LEGEND_LINE;
    }
    if shown < regions.len() {
        let text = format!("and {} smaller ones", regions.len() - shown);
        plot.canvas.text(left, y, &text, Weight::Regular, FAINT);
        y += LEGEND_LINE;
    }
    for entry in others {
        draw_entry(plot, left, y, entry);
        y += LEGEND_LINE;
    }
}

fn draw_entry(plot: &mut Plot, left: usize, y: usize, entry: &Entry) {
    plot.canvas.fill(left, y + 1, 16, 16, entry.colour);
    plot.canvas.frame(left, y + 1, 16, 16, FAINT);
    plot.canvas
        .text(left + 24, y, &entry.text, Weight::Regular, INK);
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Lattice;

    #[test]
    fn a_regions_number_stands_in_its_thickest_part() {
        // Region 1 is a bar three nodes thick with a block seven thick at its end.
        let mut image = RangeImage::masked(Lattice { pitch_mm: 1.0 }, 0, 0, 20, 9);
        let mut labels = vec![0; 20 * 9];
        for c in 0..20 {
            for r in 0..9 {
                image.set_z_mm(c, r, Some(0.0));
                let inside = if c < 12 {
                    (3..6).contains(&r)
                } else {
                    (1..8).contains(&r)
                };
                labels[c * 9 + r] = u16::from(inside);
            }
        }
        let regions = RegionMap::new(&image, labels);
        let middles = middles(&image, &regions);
        assert_eq!(middles.len(), 1);
        let (label, (c, r)) = middles[0];
        assert_eq!((label, r), (1, 4));
        // Columns 13 to 16 are four steps from the nearest node outside; the middle wins.
        assert_eq!(c, 14);
    }

    #[test]
    fn the_first_thirty_regions_have_colours_of_their_own() {
        let colours: std::collections::BTreeSet<Rgb> = (1..=30).map(colour).collect();
        assert_eq!(colours.len(), 30);
    }
}
