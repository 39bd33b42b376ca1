//! Progress on standard error: bars on a terminal, plain lines elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A plain line is told at most this often.
const LINE_EVERY: Duration = Duration::from_secs(2);

/// Tells how far something is.
pub(crate) struct Progress {
    title: String,
    how: How,
}

enum How {
    Bar(ProgressBar),
    Lines {
        total: u64,
        told_at: Instant,
        done: bool,
    },
}

impl Progress {
    /// Something counted, such as columns; the total may still be unknown (0).
    pub(crate) fn counted(title: &str, total: u64, unit: &str) -> Self {
        let template =
            format!("{{prefix:>8}} {{bar:36.cyan/blue}} {{pos}}/{{len}} {unit}  {{msg}}");
        Self::new(title, total, &template)
    }

    /// Something measured in shares of one, with a message that says what it is at.
    pub(crate) fn share(title: &str) -> Self {
        Self::new(
            title,
            1000,
            "{prefix:>8} {bar:36.cyan/blue} {percent:>3} %  {msg}",
        )
    }

    fn new(title: &str, total: u64, template: &str) -> Self {
        let how = if std::io::stderr().is_terminal() {
            let bar =
                ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr_with_hz(15));
            // A template that does not parse still leaves a usable bar.
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style.progress_chars("\u{2501}\u{2578}\u{2500}"));
            }
            bar.set_prefix(title.to_owned());
            bar.tick();
            How::Bar(bar)
        } else {
            How::Lines {
                total,
                told_at: Instant::now(),
                done: false,
            }
        };
        Self {
            title: title.to_owned(),
            how,
        }
    }

    /// `done` of `total` are through.
    pub(crate) fn count(&mut self, done: u64, total: u64, message: &str) {
        let line = format!("{done}/{total}");
        self.update(done, total, message, &line);
    }

    /// This share, 0 to 1, is through.
    pub(crate) fn at(&mut self, share: f64, message: &str) {
        let done = (share.clamp(0.0, 1.0) * 1000.0) as u64;
        let line = format!("{:.0} %", share.clamp(0.0, 1.0) * 100.0);
        self.update(done, 1000, message, &line);
    }

    fn update(&mut self, now: u64, of: u64, message: &str, line: &str) {
        match &mut self.how {
            How::Bar(bar) => {
                bar.set_length(of);
                bar.set_position(now);
                if bar.message() != message {
                    bar.set_message(message.to_owned());
                }
            }
            How::Lines {
                total,
                told_at,
                done,
            } => {
                *total = of;
                let finished = now >= of && of > 0;
                if (finished && !*done) || told_at.elapsed() >= LINE_EVERY {
                    eprintln!("{}", format!("{}: {line} {message}", self.title).trim_end());
                    *told_at = Instant::now();
                    *done = finished;
                }
            }
        }
    }

    /// Tells something worth a line of its own.
    pub(crate) fn note(&self, message: &str) {
        match &self.how {
            How::Bar(bar) => bar.println(format!("{}: {message}", self.title)),
            How::Lines { .. } => eprintln!("{}: {message}", self.title),
        }
    }

    /// Leaves the bar where it is, or says how it ended.
    pub(crate) fn finish(self, message: &str) {
        match self.how {
            How::Bar(bar) => bar.finish_with_message(message.to_owned()),
            How::Lines { .. } => eprintln!("{}: {message}", self.title),
        }
    }

    /// Ends without success; the bar stays where it was.
    pub(crate) fn abandon(self, message: &str) {
        match self.how {
            How::Bar(bar) => bar.abandon_with_message(message.to_owned()),
            How::Lines { .. } => eprintln!("{}: {message}", self.title),
        }
    }
}
