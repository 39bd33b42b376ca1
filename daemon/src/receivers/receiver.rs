//! Who is told, whatever the way to it.

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use relief_api::{DeliveryAttempt, ScannerState, WebhookEvent, WebhookKind};

use super::words::printable;
use crate::config::Retry;
use crate::error::panic_text;
use crate::ids::now;
use crate::store::Message;

/// What becomes of a message after an attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It was taken.
    Delivered,
    /// It was not, and may be later.
    Again,
    /// The receiver wants no more.
    Gone,
}

/// A way to a receiver: what each kind has of its own.
pub(super) trait Way: Send + Sync {
    /// Tries to deliver a message once, for about as long as its timeout at most, and notes what
    /// came of it. Its own thread and whoever asks for a test may call this at the same time.
    fn deliver(&self, message: &Message, attempt: &mut DeliveryAttempt) -> Verdict;

    /// Shows how the scanners are, to a receiver that keeps that for others. Waits for nobody.
    fn show(&self, _scanners: &[ScannerState]) {}

    /// The service ends: a receiver to which a connection is kept may be told.
    fn close(&self) {}
}

/// What is known of a receiver of any kind.
#[derive(Debug, Clone)]
pub(super) struct Settings {
    /// Its name; no two receivers of any kind have the same.
    pub(super) name: String,
    pub(super) kind: WebhookKind,
    /// Where it is, as it is shown to everybody: without secrets.
    pub(super) shown: String,
    /// What it is told of.
    pub(super) events: Vec<WebhookEvent>,
    /// How long an attempt may take.
    pub(super) timeout: Duration,
    /// When a message is tried again.
    pub(super) retry: Retry,
}

/// Who is told, and how.
pub(super) struct Receiver {
    pub(super) settings: Settings,
    way: Box<dyn Way>,
}

impl fmt::Debug for Receiver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Receiver")
            .field("settings", &self.settings)
            .finish_non_exhaustive()
    }
}

impl Receiver {
    pub(super) fn new(settings: Settings, way: impl Way + 'static) -> Self {
        Self {
            settings,
            way: Box::new(way),
        }
    }

    /// As [`Way::show`].
    pub(super) fn show(&self, scanners: &[ScannerState]) {
        self.way.show(scanners);
    }

    /// As [`Way::close`].
    pub(super) fn close(&self) {
        self.way.close();
    }

    /// Tries to deliver a message once, and waits for what comes of it.
    ///
    /// A defect that an answer sets off costs this attempt and nothing else: no receiver may end
    /// the service, and the scans with it.
    pub(super) fn attempt(&self, message: &Message) -> (DeliveryAttempt, Verdict) {
        let mut attempt = DeliveryAttempt {
            at: now(),
            milliseconds: 0,
            status: None,
            error: None,
            answer: None,
        };
        let begun = Instant::now();
        let tried = catch_unwind(AssertUnwindSafe(|| self.way.deliver(message, &mut attempt)));
        let verdict = tried.unwrap_or_else(|panic| {
            attempt.error = Some(format!(
                "the attempt ended unexpectedly: {}; this is a defect of the program: please \
                 report it",
                printable(panic_text(&*panic).as_bytes())
            ));
            Verdict::Again
        });
        attempt.milliseconds = u64::try_from(begun.elapsed().as_millis()).unwrap_or(u64::MAX);
        (attempt, verdict)
    }
}
