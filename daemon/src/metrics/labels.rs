//! Labels of metrics.

use prometheus_client::encoding::EncodeLabelSet;
use relief_api::{JobState, ScanState};

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct OfScanner {
    scanner: String,
}

impl OfScanner {
    pub(super) fn new(scanner: &str) -> Self {
        Self {
            scanner: scanner.to_owned(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct ScanEnd {
    scanner: String,
    state: &'static str,
}

impl ScanEnd {
    pub(super) fn new(scanner: &str, state: ScanState) -> Self {
        Self {
            scanner: scanner.to_owned(),
            state: state.as_str(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct OfState {
    state: &'static str,
}

impl OfState {
    pub(super) fn new(state: JobState) -> Self {
        Self {
            state: state.as_str(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct OfStage {
    stage: String,
}

impl OfStage {
    pub(super) fn new(stage: &str) -> Self {
        Self {
            stage: stage.to_owned(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct OfEvent {
    scanner: String,
    event: &'static str,
}

impl OfEvent {
    pub(super) fn new(scanner: &str, event: &'static str) -> Self {
        Self {
            scanner: scanner.to_owned(),
            event,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct OfPlace {
    pub(super) place: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct OfWebhook {
    pub(super) webhook: String,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct OfVersion {
    pub(super) version: &'static str,
}
