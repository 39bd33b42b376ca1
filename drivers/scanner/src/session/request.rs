//! Requests: one open at a time, repeated until it is answered.

use std::collections::VecDeque;
use std::time::Duration;

use scanner_protocol::commands::Heartbeat;
use scanner_protocol::{Faults, Frame, Message, Request, ScanPlan};

use super::event::Ticket;
use super::scan::Taken;

/// What a request is for, and so what to do with its reply.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Purpose {
    Hello,
    Nameplate,
    Calibration,
    Limits,
    Heartbeat,
    Status(Ticket),
    Home(Ticket),
    /// Homing for a scan that is to go on; what a person has seen to.
    HomeAgain(Ticket, Faults),
    Move(Ticket, i32),
    Laser(Ticket),
    ClearFaults(Ticket),
    /// Clearing faults, to try again what was refused for them.
    Recover(Box<Purpose>),
    Scan(Ticket, u16, ScanPlan),
    Continue(Box<GoOn>),
    CloseScan,
    Abort(Option<Ticket>),
}

/// A scan to be taken up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct GoOn {
    pub(super) ticket: Ticket,
    pub(super) scan_id: u16,
    pub(super) plan: ScanPlan,
    pub(super) taken: Taken,
}

impl Purpose {
    /// What the device is asked to do, to follow "refused to".
    pub(super) fn verb(&self) -> &'static str {
        match self {
            Self::Hello => "open a session",
            Self::Nameplate | Self::Calibration | Self::Limits => "identify itself",
            Self::Heartbeat | Self::Status(_) => "tell its status",
            Self::Home(_) | Self::HomeAgain(..) => "home the table",
            Self::Move(..) => "move the table",
            Self::Laser(_) => "switch the laser",
            Self::ClearFaults(_) | Self::Recover(_) => "clear its faults",
            Self::Scan(..) => "scan",
            Self::Continue(_) => "take the scan up again",
            Self::CloseScan => "close the scan",
            Self::Abort(_) => "abort",
        }
    }

    /// What is awaited, to follow "no".
    pub(super) fn awaited(&self) -> &'static str {
        match self {
            Self::Hello => "answer to the greeting",
            Self::Nameplate | Self::Calibration | Self::Limits => "identification",
            Self::Heartbeat | Self::Status(_) => "status",
            Self::Home(_) | Self::HomeAgain(..) => "answer to the homing command",
            Self::Move(..) => "answer to the move command",
            Self::Laser(_) => "answer to the laser command",
            Self::ClearFaults(_) | Self::Recover(_) => "answer to the clearing of faults",
            Self::Scan(..) => "answer to the scan command",
            Self::Continue(_) => "answer to the taking up of the scan",
            Self::CloseScan => "answer to the closing of the scan",
            Self::Abort(_) => "answer to the abort command",
        }
    }

    /// Who waits for the outcome.
    pub(super) fn ticket(&self) -> Option<Ticket> {
        match self {
            Self::Status(ticket)
            | Self::Home(ticket)
            | Self::HomeAgain(ticket, _)
            | Self::Move(ticket, _)
            | Self::Laser(ticket)
            | Self::ClearFaults(ticket)
            | Self::Scan(ticket, ..) => Some(*ticket),
            Self::Abort(ticket) => *ticket,
            Self::Recover(refused) => refused.ticket(),
            Self::Continue(go_on) => Some(go_on.ticket),
            _ => None,
        }
    }

    /// Whether it begins something in which the table moves.
    pub(super) fn starts_motion(&self) -> bool {
        matches!(
            self,
            Self::Home(_) | Self::HomeAgain(..) | Self::Move(..) | Self::Scan(..)
        )
    }

    /// The faults that a person has seen to, of those that need one: whoever starts something
    /// new has seen all.
    pub(super) fn attended(&self) -> Faults {
        match self {
            Self::HomeAgain(_, attended) => *attended,
            Self::Continue(_) => Faults::NONE,
            _ => Faults::ATTENDED,
        }
    }

    /// Whether it belongs to opening the session.
    pub(super) fn is_opening(&self) -> bool {
        matches!(
            self,
            Self::Hello | Self::Nameplate | Self::Calibration | Self::Limits
        )
    }
}

/// A request made and not yet answered.
#[derive(Debug)]
pub(super) struct Open {
    pub(super) tag: u16,
    pub(super) kind: u8,
    pub(super) purpose: Purpose,
    frame: Frame,
    attempts: u32,
    due: Duration,
}

/// The open request, those that wait for it, and an abort beside them.
#[derive(Debug, Default)]
pub(super) struct Requests {
    next_tag: u16,
    /// Heartbeats are many, and count by themselves: so the tags of the others last.
    next_heartbeat: u16,
    queue: VecDeque<Open>,
    open: Option<Open>,
    abort: Option<Open>,
    retries: u64,
}

/// What is due at a time.
#[derive(Debug)]
pub(super) enum Due {
    /// A frame is to be sent.
    Send(Frame),
    /// A request has been sent often enough without an answer.
    GivenUp(Purpose),
}

impl Requests {
    /// No requests yet.
    pub(super) fn new(first_tag: u16) -> Self {
        Self {
            next_tag: first_tag,
            next_heartbeat: first_tag,
            ..Self::default()
        }
    }

    /// The tag of the next request, heartbeats aside.
    pub(super) fn next_tag(&self) -> u16 {
        self.next_tag
    }

    /// Queues a request. An abort overtakes all others.
    pub(super) fn push<R: Request>(&mut self, request: &R, purpose: Purpose) {
        let counter = if R::KIND == Heartbeat::KIND {
            &mut self.next_heartbeat
        } else {
            &mut self.next_tag
        };
        let tag = *counter;
        *counter = tag.wrapping_add(1);
        let open = Open {
            tag,
            kind: R::KIND,
            frame: Frame::new(tag, request),
            attempts: 0,
            due: Duration::ZERO,
            purpose,
        };
        if matches!(open.purpose, Purpose::Abort(_)) {
            self.abort = Some(open);
        } else {
            self.queue.push_back(open);
        }
    }

    /// Whether nothing is open or waiting.
    pub(super) fn is_idle(&self) -> bool {
        self.open.is_none() && self.queue.is_empty() && self.abort.is_none()
    }

    /// Whether a scan has been asked for and not yet answered.
    pub(super) fn has_scan(&self) -> bool {
        self.open
            .iter()
            .chain(&self.queue)
            .any(|open| match &open.purpose {
                Purpose::Recover(refused) => matches!(**refused, Purpose::Scan(..)),
                purpose => matches!(purpose, Purpose::Scan(..) | Purpose::Continue(_)),
            })
    }

    /// Whether the closing of a scan has been asked for and not yet answered.
    pub(super) fn has_close(&self) -> bool {
        let mut open = self.open.iter().chain(&self.queue);
        open.any(|open| open.purpose == Purpose::CloseScan)
    }

    /// A column is safe: a scan that the device is being asked to take up counts from there.
    pub(super) fn acknowledge(&mut self, column: u32) {
        for open in self.open.iter_mut().chain(&mut self.queue) {
            if let Purpose::Continue(go_on) = &mut open.purpose {
                let taken = &mut go_on.taken;
                taken.acknowledged.add(column, taken.handed);
            }
        }
    }

    pub(super) fn retries(&self) -> u64 {
        self.retries
    }

    /// The next thing due now, if any. To be called until it says `None`.
    pub(super) fn due(&mut self, now: Duration, timeout: Duration, attempts: u32) -> Option<Due> {
        if self.open.is_none() {
            self.open = self.queue.pop_front();
        }
        for slot in [&mut self.abort, &mut self.open] {
            let Some(open) = slot else { continue };
            if now < open.due {
                continue;
            }
            if open.attempts >= attempts {
                return slot.take().map(|open| Due::GivenUp(open.purpose));
            }
            self.retries += u64::from(open.attempts > 0);
            open.attempts += 1;
            open.due = now + timeout;
            return Some(Due::Send(open.frame.clone()));
        }
        None
    }

    /// The request that a reply belongs to.
    ///
    /// `request_kind` is the kind of the request it answers.
    pub(super) fn answered(&mut self, tag: u16, request_kind: u8) -> Option<Purpose> {
        [&mut self.abort, &mut self.open]
            .into_iter()
            .find_map(|slot| {
                slot.take_if(|open| {
                    open.attempts > 0 && open.tag == tag && open.kind == request_kind
                })
            })
            .map(|open| open.purpose)
    }

    /// Drops every request but an abort, and says what they were for.
    pub(super) fn clear(&mut self) -> Vec<Purpose> {
        self.open
            .take()
            .into_iter()
            .chain(self.queue.drain(..))
            .map(|open| open.purpose)
            .collect()
    }

    /// Drops the abort, and says who waits for it.
    pub(super) fn clear_abort(&mut self) -> Option<Purpose> {
        self.abort.take().map(|open| open.purpose)
    }

    /// When something will be due, if nothing comes before.
    pub(super) fn deadline(&self) -> Option<Duration> {
        if self.open.is_none() && !self.queue.is_empty() {
            return Some(Duration::ZERO);
        }
        [&self.open, &self.abort]
            .into_iter()
            .flatten()
            .map(|open| open.due)
            .min()
    }
}

#[cfg(test)]
mod tests {
    use scanner_protocol::commands::Home;

    use super::*;

    #[test]
    fn heartbeats_use_up_no_tags_of_others() {
        let mut requests = Requests::new(u16::MAX);
        requests.push(&Home {}, Purpose::Home(Ticket(1)));
        for _ in 0..3 {
            requests.push(&Heartbeat {}, Purpose::Heartbeat);
        }
        requests.push(&Home {}, Purpose::Home(Ticket(2)));
        let tags: Vec<u16> = requests.queue.iter().map(|open| open.tag).collect();
        assert_eq!(tags, [u16::MAX, u16::MAX, 0, 1, 0]);
        assert_eq!(requests.next_tag(), 1);
    }
}
