//! The service on a full screen.
//!
//! ```text
//! service --> link --+
//!                    +--> Board (what is shown) --> screen (how)
//! keys --------------+
//! ```
//!
//! [`board::Board`] knows neither clock nor terminal: it is told what happened and when.

mod actions;
mod board;
mod colours;
mod keys;
mod link;
mod picture;
mod rate;
mod screen;
#[cfg(test)]
mod tests;

use std::time::{Duration, Instant};

use jiff::tz::TimeZone;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event as terminal_events;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval};

use crate::failure::Failure;
use crate::service::Client;
use board::{Board, Now};
use colours::Depth;
use keys::Wish;
use link::Word;

/// The screen is drawn at most this often.
const DRAW_EVERY: Duration = Duration::from_millis(100);
/// Words of the service that wait to be shown; the service has a buffer of its own before it.
const WAITING: usize = 256;

/// Shows the service until the user has seen enough.
pub(super) async fn run(client: Client) -> Result<(), Failure> {
    // What cannot be reached at all is told as every other command does.
    let events = client.events().await?;
    let terminal = ratatui::try_init().map_err(Failure::Output)?;
    let shown = show(terminal, client, events).await;
    ratatui::try_restore().map_err(Failure::Output)?;
    shown
}

async fn show(
    mut terminal: DefaultTerminal,
    client: Client,
    events: crate::service::Events,
) -> Result<(), Failure> {
    let (words, mut heard) = mpsc::channel(WAITING);
    let link = tokio::spawn(link::keep(client.clone(), events, words.clone()));
    let mut keys = pressed();
    let listen = |kind| signal(kind).map_err(Failure::Output);
    let mut ended = [
        listen(SignalKind::terminate())?,
        listen(SignalKind::interrupt())?,
        listen(SignalKind::hangup())?,
    ];
    let mut board = Board::default();
    let depth = Depth::of(|name| std::env::var(name).ok());
    let start = Instant::now();
    let mut tick = interval(DRAW_EVERY);
    tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let end = loop {
        tokio::select! {
            word = heard.recv() => {
                if let Some(word) = word {
                    board.hear(word, &now(start));
                }
            }
            key = keys.recv() => match key {
                Some(Ok(key)) => match board.press(&key) {
                    Some(Wish::Quit) => break Ok(()),
                    Some(Wish::Act(action)) => {
                        let (client, words) = (client.clone(), words.clone());
                        tokio::spawn(async move {
                            let answer = actions::act(&client, &action).await;
                            // Nobody listens any more once the screen is gone.
                            let _ = words.send(Word::Answer(answer)).await;
                        });
                    }
                    None => {}
                },
                Some(Err(error)) => break Err(Failure::Output(error)),
                None => break Ok(()),
            },
            () = any(&mut ended) => break Ok(()),
            _ = tick.tick() => {
                let now = now(start);
                if let Err(error) = terminal.draw(|frame| screen::draw(frame, &board, &now, depth)) {
                    break Err(Failure::Output(error));
                }
            }
        }
    };
    link.abort();
    end
}

fn now(start: Instant) -> Now {
    let clock = jiff::Timestamp::now().to_zoned(TimeZone::system());
    Now {
        s: start.elapsed().as_secs_f64(),
        clock: clock.strftime("%H:%M:%S").to_string(),
    }
}

async fn any([one, another, third]: &mut [Signal; 3]) {
    tokio::select! {
        _ = one.recv() => {}
        _ = another.recv() => {}
        _ = third.recv() => {}
    }
}

/// What the terminal says. Its library waits for that in a thread, which the process's end ends.
fn pressed() -> mpsc::Receiver<std::io::Result<terminal_events::Event>> {
    let (told, keys) = mpsc::channel(16);
    std::thread::spawn(move || {
        loop {
            let event = terminal_events::read();
            let is_over = event.is_err();
            if told.blocking_send(event).is_err() || is_over {
                break;
            }
        }
    });
    keys
}
