//! How it is shown.

mod lists;
mod scan;

use ratatui::Frame;
use ratatui::layout::{Alignment, Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Paragraph, Wrap};
use relief_api::LaserState;

use super::board::{Board, Line as Link, Now, Station};
use super::colours::Depth;
use super::rate::duration;

/// A screen that is smaller shows the lasers, and no more.
const LEAST: [u16; 2] = [48, 14];
const BAD: Style = Style::new().fg(Color::Red).add_modifier(Modifier::BOLD);
const FAINT: Style = Style::new().fg(Color::DarkGray);

const HELP: [&str; 9] = [
    "q, Ctrl-C    end the looking; scans and jobs go on",
    "Tab, arrows  next scanner",
    "p            pause the scan: laser off, table stopped",
    "r            let a paused scan go on (asks)",
    "a            abort the scan, keep its columns (asks)",
    "?            this",
    "",
    "Keys are for the scanner that is marked with >.",
    "",
];

/// Draws everything.
pub(super) fn draw(frame: &mut Frame<'_>, board: &Board, now: &Now, depth: Depth) {
    let area = frame.area();
    let stale_s = board.stale_s(now);
    let [banner, rest] = Layout::vertical([Constraint::Length(1), Constraint::Min(0)]).areas(area);
    frame.render_widget(lasers(board, stale_s), banner);
    if area.width < LEAST[0] || area.height < LEAST[1] {
        let told = format!(
            "The terminal is too small: {} x {} at least.",
            LEAST[0], LEAST[1]
        );
        frame.render_widget(Paragraph::new(told).wrap(Wrap { trim: true }), rest);
        return;
    }
    let warning = u16::from(stale_s.is_some());
    // What is asked has to be read as a whole, wrapped between words.
    let foot = board.question.as_ref().map_or(1, |question| {
        let letters = question.text.chars().count() as u16 + 1;
        (letters / (area.width - 16) + 1).min(6)
    });
    let scanners = board.stations.len().clamp(1, 4) as u16 + 2;
    let log = (rest.height / 5).clamp(3, 8);
    let [lost, head, list, middle, log, foot] = Layout::vertical([
        Constraint::Length(warning),
        Constraint::Length(1),
        Constraint::Length(scanners),
        Constraint::Min(3),
        Constraint::Length(log),
        Constraint::Length(foot),
    ])
    .areas(rest);
    if let (Some(seconds), Link::Gone { why, .. }) = (stale_s, &board.line) {
        let told = format!(
            " NO CONNECTION for {}: all below is OLD. Trying again. {why}",
            duration(seconds)
        );
        let style = Style::new().fg(Color::Black).bg(Color::Yellow).bold();
        frame.render_widget(Paragraph::new(told).style(style), lost);
    }
    frame.render_widget(service(board), head);
    lists::scanners(frame, list, board);
    let [left, right] =
        Layout::horizontal([Constraint::Percentage(60), Constraint::Percentage(40)]).areas(middle);
    scan::draw(frame, left, board, now, depth);
    lists::jobs(frame, right, board);
    lists::log(frame, log, board);
    if stale_s.is_some() {
        let old = Style::new().add_modifier(Modifier::DIM);
        for area in [head, list, middle, log] {
            frame.buffer_mut().set_style(area, old);
        }
    }
    frame.render_widget(footer(board), foot);
    if board.shows_help {
        help(frame, area);
    }
}

/// The line that nobody can overlook: which lasers are on.
fn lasers(board: &Board, stale_s: Option<f64>) -> Paragraph<'static> {
    let of = |state: LaserState| -> Vec<String> {
        let stations = board.stations.iter().filter(|s| s.laser() == state);
        stations.map(|station| name(station).to_owned()).collect()
    };
    let (on, unknown) = (of(LaserState::On), of(LaserState::Unknown));
    let named = |names: &[String]| {
        if board.stations.len() > 1 {
            format!(": {}", names.join(", "))
        } else {
            String::new()
        }
    };
    let bold = Style::new().add_modifier(Modifier::BOLD);
    let (told, style) = if stale_s.is_some() || board.stations.is_empty() {
        let told = if on.is_empty() {
            "LASER STATE NOT KNOWN".to_owned()
        } else {
            format!("LASER STATE NOT KNOWN, last ON{}", named(&on))
        };
        (told, bold.fg(Color::Black).bg(Color::Yellow))
    } else if !on.is_empty() {
        let sign = "\u{26a0}";
        let told = format!("{sign} LASER ON{} {sign}", named(&on));
        (told, bold.fg(Color::White).bg(Color::Red))
    } else if !unknown.is_empty() {
        let told = format!("LASER STATE NOT KNOWN{}", named(&unknown));
        (told, bold.fg(Color::Black).bg(Color::Yellow))
    } else {
        (
            "Laser off".to_owned(),
            Style::new().fg(Color::Black).bg(Color::Green),
        )
    };
    Paragraph::new(told)
        .style(style)
        .alignment(Alignment::Center)
}

fn service(board: &Board) -> Paragraph<'static> {
    let Some(status) = &board.service else {
        return Paragraph::new(" waiting for the service").style(FAINT);
    };
    let free = status.storage.as_ref().and_then(|storage| {
        let free = [storage.scans_free_bytes, storage.results_free_bytes];
        free.into_iter().flatten().min()
    });
    let free = free.map_or_else(String::new, |bytes| {
        format!(", {:.1} GB free", bytes as f64 * 1e-9)
    });
    Paragraph::new(format!(
        " reliefd {}, {} running and {} waiting jobs{free}, results in {}",
        status.version, status.jobs_running, status.jobs_queued, status.spool
    ))
}

fn footer(board: &Board) -> Paragraph<'static> {
    if let Some(question) = &board.question {
        let style = Style::new().fg(Color::Black).bg(Color::Yellow).bold();
        return Paragraph::new(format!(" {}", question.text))
            .style(style)
            .wrap(Wrap { trim: true });
    }
    match &board.note {
        Some(Ok(note)) => Paragraph::new(format!(" {note}")),
        Some(Err(note)) => Paragraph::new(format!(" {note}")).style(BAD),
        None => {
            let keys = [
                ("q", "quit"),
                ("p", "pause"),
                ("r", "resume"),
                ("a", "abort"),
                ("Tab", "scanner"),
                ("?", "help"),
            ];
            let spans = keys.into_iter().flat_map(|(key, does)| {
                [
                    Span::from(format!(" {key} ")).reversed(),
                    Span::from(format!(" {does}  ")),
                ]
            });
            Paragraph::new(Line::from_iter(spans))
        }
    }
}

fn help(frame: &mut Frame<'_>, area: Rect) {
    let [_, high, _] = Layout::vertical([
        Constraint::Fill(1),
        Constraint::Length(HELP.len() as u16 + 1),
        Constraint::Fill(1),
    ])
    .areas(area);
    let [_, place, _] = Layout::horizontal([
        Constraint::Fill(1),
        Constraint::Length(58.min(area.width)),
        Constraint::Fill(1),
    ])
    .areas(high);
    frame.render_widget(Clear, place);
    let block = Block::bordered().title(" Keys; any of them closes this ");
    frame.render_widget(Paragraph::new(HELP.join("\n")).block(block), place);
}

/// The name of a scanner; services with but one may give none.
fn name(station: &Station) -> &str {
    match station.status.name.as_str() {
        "" => relief_api::THE_SCANNER,
        name => name,
    }
}
