//! A pause that a person asks for.

use super::{Recovery, State};
use crate::error::ScannerError;

impl Recovery {
    /// A person wants the scan to stand still. It goes on only by [`Recovery::resume`], whatever
    /// else comes of what is under way; the next [`Recovery::poll`] closes the device's scan.
    ///
    /// # Errors
    /// [`ScannerError::NothingToPause`] if it is over; [`ScannerError::CannotPause`] if it could
    /// not go on afterwards.
    pub fn pause(&mut self) -> Result<(), ScannerError> {
        if self.state == State::Over {
            return Err(ScannerError::NothingToPause);
        }
        if self.settings.is_none() {
            return Err(ScannerError::CannotPause(
                "it could not go on afterwards, since `resume` is off".to_owned(),
            ));
        }
        if self.needs_person() {
            return Ok(());
        }
        self.tell(ScannerError::PausedOnRequest, true);
        self.state = match self.state {
            State::Running | State::Refused => State::Refused,
            // Only their answers tell what there is to be stopped.
            under_way @ (State::Homing(_) | State::Continuing(_)) => under_way,
            _ => State::Attended,
        };
        Ok(())
    }

    /// Whether a pause has been asked for that the device has yet to be told of.
    #[must_use]
    pub fn is_stopping(&self) -> bool {
        self.needs_person() && matches!(self.state, State::Continuing(_) | State::Refused)
    }
}
