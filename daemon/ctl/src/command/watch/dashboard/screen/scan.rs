//! The scan of the chosen scanner: how far it is, and its range image.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Gauge, Paragraph};
use relief_api::{Scan, ScanState};

use super::{BAD, FAINT, name};
use crate::command::watch::dashboard::board::{Board, Now, Station};
use crate::command::watch::dashboard::colours::Depth;
use crate::command::watch::dashboard::rate::duration;

pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, board: &Board, now: &Now, depth: Depth) {
    let station = board.selected();
    let title = station.map_or_else(String::new, |station| {
        format!(" Scan on {} ", name(station))
    });
    let block = Block::bordered().title(title);
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let Some((station, scan)) = station.and_then(|s| Some((s, s.scan.as_ref()?))) else {
        frame.render_widget(Paragraph::new("no scan under way").style(FAINT), inner);
        return;
    };
    let reason = u16::from(scan.reason.is_some());
    let [told, why, gauge, figures, scale, picture] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(reason),
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Min(0),
    ])
    .areas(inner);
    frame.render_widget(Paragraph::new(head(scan)), told);
    if let Some(reason) = &scan.reason {
        frame.render_widget(Paragraph::new(reason.as_str()).style(BAD), why);
    }
    let planned = scan.columns_planned.max(1);
    let share = (f64::from(scan.columns) / f64::from(planned)).clamp(0.0, 1.0);
    let bar = Gauge::default()
        .ratio(share)
        .label(format!("{:.0} %", share * 100.0))
        .gauge_style(Style::new().fg(Color::Cyan).bg(Color::DarkGray))
        .use_unicode(true);
    frame.render_widget(bar, gauge);
    frame.render_widget(Paragraph::new(pace(station, scan, now)), figures);
    if station.is_pictured() {
        if let Some(heights) = station.picture.z_mm() {
            frame.render_widget(legend(heights, scale.width, depth), scale);
        }
        station.picture.draw(picture, frame.buffer_mut(), depth);
    } else if !scan.state.is_over() {
        let told = "the range image shows from the next column on";
        frame.render_widget(Paragraph::new(told).style(FAINT), scale);
    }
}

fn head(scan: &Scan) -> Line<'_> {
    let style = match scan.state {
        ScanState::Scanning => Style::new().fg(Color::Cyan),
        ScanState::Complete => Style::new().fg(Color::Green),
        ScanState::Starting => Style::new(),
        _ => BAD,
    };
    let state = match scan.state {
        ScanState::Paused if scan.needs_person => "PAUSED until a person looks (r)",
        ScanState::Paused => "PAUSED",
        state => state.as_str(),
    };
    let name = if scan.name.is_empty() {
        &scan.id
    } else {
        &scan.name
    };
    Line::from(vec![
        Span::styled(state, style),
        Span::from(format!("  {name}  ")),
        Span::styled(scan.id.as_str(), FAINT),
    ])
}

/// Columns, how fast they come, and how long the rest takes.
fn pace(station: &Station, scan: &Scan, now: &Now) -> String {
    let mut told = format!("{} of {} columns", scan.columns, scan.columns_planned);
    if scan.state != ScanState::Scanning || !station.is_pictured() {
        return told;
    }
    if let Some(rate) = station.rate.per_second(now.s) {
        let left = f64::from(scan.columns_planned.saturating_sub(scan.columns));
        told += &format!(", {} left, {rate:.1} columns/s", duration(left / rate));
    }
    if let Some((samples, x_mm)) = station.last_column {
        told += &format!(", x {x_mm:.1} mm, {samples} samples");
    }
    told
}

/// The heights that the colours stand for.
fn legend([low, high]: [f64; 2], width: u16, depth: Depth) -> Line<'static> {
    let ends = [format!("z {low:.1} "), format!(" {high:.1} mm")];
    let taken: usize = ends.iter().map(String::len).sum();
    let bar = usize::from(width).saturating_sub(taken).min(32);
    let [before, behind] = ends;
    let mut spans = vec![Span::from(before)];
    if depth != Depth::Mono {
        spans.extend((0..bar).map(|k| {
            let share = k as f64 / bar.max(2) as f64;
            Span::styled(" ", Style::new().bg(depth.colour(share)))
        }));
    } else {
        spans.push(Span::from("\u{2591} to \u{2588}"));
    }
    spans.push(Span::from(behind));
    Line::from(spans)
}
