//! Why a scan pauses, and who has to end the pause.

use std::fmt;

use scanner_protocol::{Faults, RejectReason};

use crate::error::ScannerError;

/// A scan that has stopped between two columns and can go on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pause {
    /// What stopped it, or keeps it from going on.
    pub cause: ScannerError,
    /// Whether it waits to be told to go on; otherwise it goes on as soon as it can.
    pub needs_person: bool,
    /// Columns that are there.
    pub columns: u32,
}

impl fmt::Display for Pause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.cause)?;
        let on_request = self.cause == ScannerError::PausedOnRequest;
        if on_request && self.needs_person {
            return f.write_str("; `relief resume` lets it go on");
        }
        let program_ended = match &self.cause {
            ScannerError::ProgramEnded { before } => Some(before),
            _ => None,
        };
        if program_ended.is_some_and(Option::is_some) && self.needs_person {
            // What was said before says also what to do.
            Ok(())
        } else if self.needs_person {
            f.write_str("; see to it, then let the scan go on with `relief resume`")
        } else if program_ended.is_some() || on_request {
            f.write_str("; the scan goes on by itself once its last columns are found unchanged")
        } else {
            f.write_str("; the scan goes on by itself once that is over")
        }
    }
}

/// What trouble means for a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Class {
    /// It can go on without anybody's help.
    ByItself,
    /// A person has to look first.
    NeedsPerson,
    /// It has ended.
    Final,
}

/// The faults that trouble tells of.
fn faults(error: &ScannerError) -> Faults {
    match error {
        ScannerError::Fault(faults) => *faults,
        ScannerError::Refused {
            reason: RejectReason::Faulted,
            detail,
            ..
        } => Faults(*detail),
        _ => Faults::NONE,
    }
}

/// Those of them that a person must have seen to.
pub(super) fn for_a_person(error: &ScannerError) -> Faults {
    faults(error).intersection(Faults::ATTENDED)
}

pub(super) fn class(error: &ScannerError) -> Class {
    match error {
        error if !for_a_person(error).is_empty() => Class::NeedsPerson,
        // The columns before and after would not be of one scale.
        error if faults(error).contains(Faults::CALIBRATION) => Class::Final,
        ScannerError::StoppedAtDevice | ScannerError::Moved { .. } => Class::NeedsPerson,
        ScannerError::Refused {
            reason: RejectReason::UnknownCommand | RejectReason::NotSupported,
            ..
        }
        | ScannerError::Aborted
        | ScannerError::Closed
        | ScannerError::Settings(_)
        | ScannerError::Version { .. } => Class::Final,
        _ => Class::ByItself,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(faults: Faults) -> ScannerError {
        ScannerError::Refused {
            command: "scan",
            reason: RejectReason::Faulted,
            detail: faults.0,
        }
    }

    #[test]
    fn what_endangers_people_or_the_frame_needs_a_person() {
        for faults in [
            Faults::LASER,
            Faults::LIMIT_SWITCH,
            Faults::INTERLOCK | Faults::DEAD_MAN,
            Faults::EMERGENCY_STOP,
        ] {
            assert_eq!(class(&ScannerError::Fault(faults)), Class::NeedsPerson);
            assert_eq!(class(&refused(faults)), Class::NeedsPerson);
        }
        for faults in [
            Faults::OVER_TEMPERATURE,
            Faults::TABLE_STALL,
            Faults::SUPPLY,
        ] {
            assert_eq!(class(&ScannerError::Fault(faults)), Class::ByItself);
            assert_eq!(class(&refused(faults)), Class::ByItself);
        }
        assert_eq!(class(&ScannerError::DeadMan), Class::ByItself);
        assert_eq!(class(&ScannerError::Aborted), Class::Final);
    }

    #[test]
    fn a_pause_says_who_ends_it() {
        let mut pause = Pause {
            cause: ScannerError::Fault(Faults::LASER),
            needs_person: true,
            columns: 4,
        };
        assert!(pause.to_string().contains("relief resume"));
        pause.needs_person = false;
        assert!(pause.to_string().contains("by itself"));
        pause.cause = ScannerError::PausedOnRequest;
        assert_eq!(
            pause.to_string(),
            "paused on request; the scan goes on by itself once its last columns are found unchanged"
        );
        pause.needs_person = true;
        assert_eq!(
            pause.to_string(),
            "paused on request; `relief resume` lets it go on"
        );
    }
}
