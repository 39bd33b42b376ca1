//! The way of a scan's columns to its reader.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use super::ScanNumber;
use crate::recovery::{Progress, Recovery};
use crate::scanner::StreamItem;

/// A scan, and whoever reads it.
pub(super) struct Stream {
    pub(super) number: ScanNumber,
    pub(super) scan: Recovery,
    /// `None` once the end has been sent; acknowledgements still come after it.
    items: Option<SyncSender<StreamItem>>,
    /// What the reader has had no room for.
    unsent: VecDeque<StreamItem>,
    credits: usize,
}

/// More columns are under way than there was credit for.
#[derive(Debug)]
pub(super) struct Overflow;

impl Stream {
    pub(super) fn new(
        number: ScanNumber,
        scan: Recovery,
        credits: u16,
    ) -> (Self, Receiver<StreamItem>) {
        let credits = usize::from(credits);
        // Every column in flight, and the end: there is room unless word of pauses takes it.
        let (sender, items) = sync_channel(credits + 1);
        let stream = Self {
            number,
            scan,
            items: Some(sender),
            unsent: VecDeque::new(),
            credits,
        };
        (stream, items)
    }

    /// Passes on what has come of the scan, as far as the reader takes it.
    pub(super) fn pass_on(&mut self) -> Result<(), Overflow> {
        while let Some(progress) = self.scan.next_progress() {
            let item = match progress {
                Progress::Column(column) => StreamItem::Column(column),
                Progress::Paused(pause) => StreamItem::Paused(pause),
                Progress::Resumed => StreamItem::Resumed,
                Progress::Over(result) => StreamItem::End(result),
            };
            // Of a pause only the latest word counts.
            if is_word(&item) && self.unsent.back().is_some_and(is_word) {
                self.unsent.pop_back();
            }
            self.unsent.push_back(item);
        }
        let Some(items) = &self.items else {
            self.unsent.clear();
            return Ok(());
        };
        while let Some(item) = self.unsent.pop_front() {
            let last = matches!(item, StreamItem::End(_));
            match items.try_send(item) {
                Ok(()) if last => {
                    self.items = None;
                    return Ok(());
                }
                Ok(()) => {}
                Err(TrySendError::Full(item)) => {
                    self.unsent.push_front(item);
                    break;
                }
                // The reader has gone; its closing of the scan is on the way.
                Err(TrySendError::Disconnected(_)) => {
                    self.items = None;
                    return Ok(());
                }
            }
        }
        let columns = self.unsent.iter().filter(|item| !is_word(item)).count();
        if columns > self.credits + 1 {
            return Err(Overflow);
        }
        Ok(())
    }
}

fn is_word(item: &StreamItem) -> bool {
    matches!(item, StreamItem::Paused(_) | StreamItem::Resumed)
}
