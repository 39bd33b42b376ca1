//! The frame of a scan: what ends there, and what lies further out than something else.

use range_image::{RangeImage, RegionMap};

/// What the scanner looked at, as far as that is known. Where it reaches farther than what
/// was measured, that ends by itself and is not cut off.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct View {
    /// x of the first and last column, millimetres.
    pub x_mm: Option<(f64, f64)>,
    /// y of the lowest and highest place, millimetres.
    pub y_mm: Option<(f64, f64)>,
}

impl View {
    /// What is left of it within limits, such as those of a region of interest.
    #[must_use]
    pub fn within(self, x_mm: (f64, f64), y_mm: (f64, f64)) -> Self {
        let narrowed = |known: Option<(f64, f64)>, limits: (f64, f64)| {
            known.map(|(low, high)| (low.max(limits.0), high.min(limits.1)))
        };
        Self {
            x_mm: narrowed(self.x_mm, x_mm),
            y_mm: narrowed(self.y_mm, y_mm),
        }
    }
}

/// A side of the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
    Bottom,
    Top,
}

pub(super) const SIDES: [Side; 4] = [Side::Left, Side::Right, Side::Bottom, Side::Top];

impl Side {
    pub(super) fn as_str(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
            Self::Bottom => "bottom",
            Self::Top => "top",
        }
    }

    fn is_low(self) -> bool {
        matches!(self, Self::Left | Self::Bottom)
    }
}

/// How far from the frame, in nodes, something may end and still be cut off by it.
const SLACK_NODES: usize = 2;
/// The same as a share of the image: the rays of a fan do not end on one line.
const SLACK_SHARE: f64 = 0.02;
/// The same where the view is known, in nodes: support of nodes ends before the samples do.
const VIEW_SLACK_NODES: f64 = 4.0;

/// The ends of one row or column of the grid: of all that is labelled, and of the rest that
/// is no background.
#[derive(Debug, Clone, Copy)]
struct Line {
    all: Span,
    rest: Option<Span>,
}

#[derive(Debug, Clone, Copy)]
struct Span {
    first: usize,
    last: usize,
    first_label: u16,
    last_label: u16,
}

impl Span {
    fn at(place: usize, label: u16) -> Self {
        Self {
            first: place,
            last: place,
            first_label: label,
            last_label: label,
        }
    }

    fn widen(&mut self, place: usize, label: u16) {
        if place < self.first {
            (self.first, self.first_label) = (place, label);
        }
        if place >= self.last {
            (self.last, self.last_label) = (place, label);
        }
    }

    fn end(&self, side: Side) -> (usize, u16) {
        if side.is_low() {
            (self.first, self.first_label)
        } else {
            (self.last, self.last_label)
        }
    }
}

/// Rows and columns of an image with what lies outermost on each.
pub(super) struct Lines<'a> {
    image: &'a RangeImage,
    view: &'a View,
    rows: Vec<Option<Line>>,
    columns: Vec<Option<Line>>,
    is_background: Box<dyn Fn(u16) -> bool + 'a>,
}

impl<'a> Lines<'a> {
    pub(super) fn new(
        image: &'a RangeImage,
        map: &RegionMap,
        view: &'a View,
        is_background: impl Fn(u16) -> bool + 'a,
    ) -> Self {
        let mut rows: Vec<Option<Line>> = vec![None; image.rows()];
        let mut columns: Vec<Option<Line>> = vec![None; image.columns()];
        let grow = |line: &mut Option<Line>, place: usize, label: u16, rest: bool| {
            let line = line.get_or_insert(Line {
                all: Span::at(place, label),
                rest: None,
            });
            line.all.widen(place, label);
            if rest {
                let span = line.rest.get_or_insert(Span::at(place, label));
                span.widen(place, label);
            }
        };
        for (column, along) in columns.iter_mut().enumerate() {
            for (row, across) in rows.iter_mut().enumerate() {
                let label = map.label(column, row);
                if label != 0 {
                    let rest = !is_background(label);
                    grow(along, row, label, rest);
                    grow(across, column, label, rest);
                }
            }
        }
        Self {
            image,
            view,
            rows,
            columns,
            is_background: Box::new(is_background),
        }
    }

    fn across(&self, side: Side) -> impl Iterator<Item = &Line> {
        let lines = match side {
            Side::Left | Side::Right => &self.rows,
            Side::Bottom | Side::Top => &self.columns,
        };
        lines.iter().flatten()
    }

    /// Share of the lines that end at this side of the frame, and in background.
    pub(super) fn reached(&self, side: Side) -> f64 {
        self.reached_by(side, &self.is_background)
    }

    /// The same for some of the labels.
    pub(super) fn reached_by(&self, side: Side, of: impl Fn(u16) -> bool) -> f64 {
        let Some(frame) = Frame::at(self.image, self.view, side) else {
            return 0.0;
        };
        let lines = self.across(side).count();
        let ends = self.across(side).map(|line| line.all.end(side));
        let reached = ends.filter(|&(place, label)| frame.cuts(place) && of(label));
        reached.count() as f64 / lines.max(1) as f64
    }

    /// Of the lines that hold something of the rest, the share with background further out.
    pub(super) fn enclosed(&self, side: Side) -> f64 {
        let (mut lines, mut enclosed) = (0_usize, 0_usize);
        for line in self.across(side) {
            let Some(rest) = line.rest else { continue };
            lines += 1;
            enclosed += usize::from(rest.end(side).0 != line.all.end(side).0);
        }
        enclosed as f64 / lines.max(1) as f64
    }
}

/// Where a side of the frame lies.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    side: Side,
    nodes: usize,
}

impl Frame {
    /// `None` where the view is known to reach farther than the image.
    pub(super) fn at(image: &RangeImage, view: &View, side: Side) -> Option<Self> {
        let (known, nodes) = match side {
            Side::Left | Side::Right => (view.x_mm, image.columns()),
            Side::Bottom | Side::Top => (view.y_mm, image.rows()),
        };
        let last = nodes.checked_sub(1)?;
        if let Some((low, high)) = known {
            let place_mm = |place: usize| match side {
                Side::Left | Side::Right => image.x_mm(place),
                Side::Bottom | Side::Top => image.y_mm(place),
            };
            let gap_mm = if side.is_low() {
                place_mm(0) - low
            } else {
                high - place_mm(last)
            };
            if gap_mm > VIEW_SLACK_NODES * image.pitch_mm() {
                return None;
            }
        }
        Some(Self { side, nodes })
    }

    /// Whether what ends at this column or row is cut off.
    pub(super) fn cuts(self, place: usize) -> bool {
        let slack = SLACK_NODES.max((SLACK_SHARE * self.nodes as f64) as usize);
        let from_frame = if self.side.is_low() {
            place
        } else {
            self.nodes.saturating_sub(place + 1)
        };
        from_frame <= slack
    }

    /// The column or row number of a node that counts against this side.
    pub(super) fn place(self, column: usize, row: usize) -> usize {
        match self.side {
            Side::Left | Side::Right => column,
            Side::Bottom | Side::Top => row,
        }
    }
}
