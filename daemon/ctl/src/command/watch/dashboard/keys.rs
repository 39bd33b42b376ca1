//! What keys ask for.

use ratatui::crossterm::event::{Event, KeyCode, KeyEventKind, KeyModifiers};
use relief_api::{Scan, ScanState};

use super::actions::Action;
use super::board::Board;

/// What a key comes to beside what is shown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Wish {
    /// Enough seen.
    Quit,
    /// Something is to be asked of the service.
    Act(Action),
}

/// A question that y answers with yes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Question {
    pub(super) text: String,
    action: Action,
}

impl Board {
    /// A key was pressed, or the terminal says something else.
    pub(super) fn press(&mut self, event: &Event) -> Option<Wish> {
        let Event::Key(key) = event else {
            // A size is asked for when the screen is drawn.
            return None;
        };
        if key.kind == KeyEventKind::Release {
            return None;
        }
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return (key.code == KeyCode::Char('c')).then_some(Wish::Quit);
        }
        if let Some(question) = self.question.take() {
            if matches!(key.code, KeyCode::Char('y' | 'Y')) {
                return Some(Wish::Act(question.action));
            }
            self.note = Some(Ok("nothing was done".to_owned()));
            return None;
        }
        if self.shows_help {
            self.shows_help = false;
            return None;
        }
        self.note = None;
        match key.code {
            KeyCode::Char('q' | 'Q') => return Some(Wish::Quit),
            KeyCode::Char('?' | 'h') => self.shows_help = true,
            KeyCode::Tab | KeyCode::Right => self.select_next(1),
            KeyCode::BackTab | KeyCode::Left => self.select_next(-1),
            KeyCode::Char('p' | 'P') => return self.pause(),
            KeyCode::Char('r' | 'R') => self.ask_to_resume(),
            KeyCode::Char('a' | 'A') => self.ask_to_abort(),
            _ => {}
        }
        None
    }

    fn pause(&mut self) -> Option<Wish> {
        match self.under_way() {
            Some(scan) if scan.state == ScanState::Paused => {
                self.note = Some(Err(format!("{} is paused already", scan.id)));
                None
            }
            Some(scan) => Some(Wish::Act(Action::Pause(scan.id))),
            None => self.no_scan(),
        }
    }

    fn ask_to_resume(&mut self) {
        match self.under_way() {
            Some(scan) if scan.state == ScanState::Paused => {
                let reason = scan.reason.unwrap_or_else(|| "paused".to_owned());
                self.question = Some(Question {
                    text: format!(
                        "The LASER COMES ON and the table moves. Have you looked at the scanner, and \
                         may {} go on ({reason})? [y/n]",
                        scan.id
                    ),
                    action: Action::Resume(scan.id),
                });
            }
            Some(scan) => self.note = Some(Err(format!("{} is not paused", scan.id))),
            None => {
                self.no_scan();
            }
        }
    }

    fn ask_to_abort(&mut self) {
        match self.under_way() {
            Some(scan) => {
                self.question = Some(Question {
                    text: format!(
                        "Abort {} after {} of {} columns? [y/n]",
                        scan.id, scan.columns, scan.columns_planned
                    ),
                    action: Action::Abort(scan.id),
                });
            }
            None => {
                self.no_scan();
            }
        }
    }

    fn under_way(&self) -> Option<Scan> {
        let scan = self.selected()?.scan.as_ref()?;
        (!scan.state.is_over()).then(|| scan.clone())
    }

    fn no_scan(&mut self) -> Option<Wish> {
        self.note = Some(Err("no scan is under way on this scanner".to_owned()));
        None
    }
}
