//! How long each stage took.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use pipeline::{Observer, Stage};
use range_image::Monitor;

/// An observer that times the stages and passes everything on to another observer.
pub struct Stopwatch<'a> {
    inner: &'a dyn Observer,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    running: Option<(Stage, Instant)>,
    seconds: BTreeMap<String, f64>,
}

impl<'a> Stopwatch<'a> {
    /// A stopwatch at rest.
    #[must_use]
    pub fn new(inner: &'a dyn Observer) -> Self {
        Self {
            inner,
            state: Mutex::default(),
        }
    }

    /// Adds a duration in seconds that was measured elsewhere, such as `regrid` where
    /// columns are regridded as they come in.
    pub fn add(&self, name: &str, seconds: f64) {
        *self.state().seconds.entry(name.to_owned()).or_default() += seconds;
    }

    /// Ends the running stage, if any, and gives the seconds of every stage so far.
    #[must_use]
    pub fn read(&self) -> BTreeMap<String, f64> {
        let mut state = self.state();
        state.close();
        state.seconds.clone()
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // The state is sound after every statement, whoever panicked.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn close(&mut self) {
        if let Some((stage, since)) = self.running.take() {
            let seconds = since.elapsed().as_secs_f64();
            *self.seconds.entry(stage.as_str().to_owned()).or_default() += seconds;
        }
    }
}

impl Monitor for Stopwatch<'_> {
    fn is_cancelled(&self) -> bool {
        self.inner.is_cancelled()
    }

    fn progress(&self, fraction: f64) {
        self.inner.progress(fraction);
    }
}

impl Observer for Stopwatch<'_> {
    fn stage(&self, stage: Stage) {
        let mut state = self.state();
        state.close();
        state.running = Some((stage, Instant::now()));
        drop(state);
        self.inner.stage(stage);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use range_image::Unmonitored;

    #[test]
    fn every_stage_gets_an_entry_and_what_was_added_is_kept() {
        let watch = Stopwatch::new(&Unmonitored);
        watch.add("regrid", 1.5);
        watch.stage(Stage::Segment);
        watch.stage(Stage::Reconstruct);
        let read = watch.read();
        assert_eq!(
            read.keys().map(String::as_str).collect::<Vec<_>>(),
            ["reconstruct", "regrid", "segment"]
        );
        assert_eq!(read.get("regrid"), Some(&1.5));
        assert_eq!(watch.read(), read, "a stopwatch that was read stands still");
    }
}
