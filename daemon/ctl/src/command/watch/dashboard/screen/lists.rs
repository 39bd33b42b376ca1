//! Scanners, jobs, results and the log.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Row, Table};
use relief_api::{JobState, LaserState, ScannerLink};

use super::{BAD, FAINT, name};
use crate::command::watch::dashboard::board::{Board, Station, Work};

/// Cells of the bar of a stage.
const BAR: usize = 10;

pub(super) fn scanners(frame: &mut Frame<'_>, area: Rect, board: &Board) {
    let room = usize::from(area.height.saturating_sub(2)).max(1);
    // The chosen one is always there.
    let first = (board.chosen() + 1).saturating_sub(room);
    let stations = board.stations.iter().enumerate().skip(first);
    let rows = stations.map(|(index, station)| row(station, index == board.chosen()));
    let widths = [
        Constraint::Length(1),
        Constraint::Max(16),
        Constraint::Length(11),
        Constraint::Length(13),
        Constraint::Fill(1),
    ];
    let table = Table::new(rows, widths).block(Block::bordered().title(" Scanners "));
    frame.render_widget(table, area);
}

fn row(station: &Station, is_chosen: bool) -> Row<'_> {
    let (link, link_style) = match station.status.link {
        ScannerLink::Unknown => ("not asked", Style::new()),
        ScannerLink::Ready => ("ready", Style::new().fg(Color::Green)),
        ScannerLink::Scanning => ("scanning", Style::new().fg(Color::Cyan)),
        ScannerLink::Trouble => ("TROUBLE", BAD),
    };
    let (laser, laser_style) = match station.laser() {
        LaserState::On => (
            "LASER ON",
            Style::new().fg(Color::White).bg(Color::Red).bold(),
        ),
        LaserState::Off => ("laser off", Style::new().fg(Color::Green)),
        LaserState::Unknown => ("laser ?", Style::new().fg(Color::Yellow)),
    };
    let told = match (&station.status.problem, &station.status.model) {
        (Some(problem), _) => Span::styled(problem.as_str(), BAD),
        (None, Some(model)) => Span::from(format!("{model} at {}", station.status.endpoint)),
        (None, None) => Span::from(station.status.endpoint.as_str()),
    };
    Row::new([
        Span::from(if is_chosen { ">" } else { " " }),
        Span::from(name(station)).bold(),
        Span::styled(link, link_style),
        Span::styled(laser, laser_style),
        told,
    ])
}

/// Jobs, and below them results.
pub(super) fn jobs(frame: &mut Frame<'_>, area: Rect, board: &Board) {
    let results = (board.published.len() as u16 + 2).clamp(3, (area.height / 3).max(3));
    let [above, below] =
        Layout::vertical([Constraint::Min(0), Constraint::Length(results)]).areas(area);
    let lines: Vec<Line<'_>> = board.works.iter().map(work).collect();
    let block = Block::bordered().title(" Jobs ");
    frame.render_widget(Paragraph::new(lines).block(block), above);
    let lines: Vec<Line<'_>> = board
        .published
        .iter()
        .map(|text| Line::from(text.as_str()))
        .collect();
    let block = Block::bordered().title(" Results ");
    frame.render_widget(Paragraph::new(lines).block(block), below);
}

fn work(work: &Work) -> Line<'_> {
    let job = &work.job;
    let style = match job.state {
        JobState::Queued => Style::new(),
        JobState::Running => Style::new().fg(Color::Cyan),
        JobState::Done => Style::new().fg(Color::Green),
        JobState::Failed | JobState::Cancelled => BAD,
    };
    let mut spans = vec![
        Span::from(format!("{} ", job.id)).bold(),
        Span::styled(job.state.as_str(), style),
    ];
    match (&work.stage, &job.error) {
        (Some((stage, fraction)), _) => {
            let full = (fraction.clamp(0.0, 1.0) * BAR as f64).round() as usize;
            let bar = "\u{2588}".repeat(full) + &"\u{2591}".repeat(BAR - full.min(BAR));
            spans.push(Span::from(format!(
                " {stage} {bar} {:.0} %",
                fraction * 100.0
            )));
        }
        (None, Some(error)) => spans.push(Span::styled(format!(" {error}"), BAD)),
        (None, None) => {}
    }
    spans.push(Span::styled(format!(" {}", job.name), FAINT));
    Line::from(spans)
}

pub(super) fn log(frame: &mut Frame<'_>, area: Rect, board: &Board) {
    let room = usize::from(area.height.saturating_sub(1));
    let latest = board.log.iter().skip(board.log.len().saturating_sub(room));
    let lines = latest.map(|told| {
        let style = if told.is_bad { BAD } else { Style::new() };
        Line::from(vec![
            Span::styled(format!("{} ", told.clock), FAINT),
            Span::styled(told.text.as_str(), style),
        ])
    });
    let block = Block::new()
        .borders(ratatui::widgets::Borders::TOP)
        .title(" Events ");
    frame.render_widget(Paragraph::new(lines.collect::<Vec<_>>()).block(block), area);
}
