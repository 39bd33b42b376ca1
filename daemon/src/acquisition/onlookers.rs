//! Showing a scan to whoever looks on: on a thread of its own, so that the journal does not wait
//! for the range image, nor the range image for the disk.

use std::sync::mpsc::{Receiver, SyncSender};

use range_image::Calibration;
use relief_api::Event;
use scan_record::RawColumn;

use super::live::Live;
use crate::service::Service;
use crate::station::Station;

/// Something for those who look on.
pub(super) enum Shown {
    /// A column that is safe.
    Column {
        column: RawColumn,
        /// Columns that are safe with it.
        kept: u32,
    },
    /// Somebody waits until all before this has been shown: what is told next comes behind it.
    Awaited(SyncSender<()>),
}

/// The range image that grows, and those who are told.
pub(super) struct Onlookers<'a> {
    service: &'a Service,
    station: &'a Station,
    id: &'a str,
    calibration: Calibration,
    live: Live<'a>,
}

impl<'a> Onlookers<'a> {
    pub(super) fn new(
        service: &'a Service,
        station: &'a Station,
        id: &'a str,
        calibration: Calibration,
        live: Live<'a>,
    ) -> Self {
        Self {
            service,
            station,
            id,
            calibration,
            live,
        }
    }

    /// Shows all that is kept, until no more is.
    pub(super) fn show_all(&mut self, kept: &Receiver<Shown>) {
        let pulse = self
            .service
            .liveness
            .begin(self.station.loop_name("scan-live"));
        loop {
            pulse.rest();
            let Ok(shown) = kept.recv() else { return };
            pulse.work(self.station.longest_wait);
            match shown {
                Shown::Column { column, kept } => self.show(&column, kept),
                // Who has gone does not wait.
                Shown::Awaited(waiting) => drop(waiting.send(())),
            }
        }
    }

    fn show(&mut self, column: &RawColumn, kept: u32) {
        let live = self.live.push(column.calibrated(&self.calibration));
        self.service.metrics.column_shown(self.station.name());
        if self.service.hub.has_listeners() {
            let scan = self.station.active_scan();
            self.service.hub.tell(Event::Column {
                scan: self.id.to_owned(),
                scanner: self.station.name().to_owned(),
                columns: kept,
                columns_planned: scan.map_or(0, |scan| scan.columns_planned),
                samples: column.samples.len() as u32,
                x_mm: self.calibration.x_mm(column.table_counts),
                pitch_mm: self.live.pitch_mm(),
                live,
            });
        }
    }

    /// Puts the range image aside for the job: the scan is complete.
    pub(super) fn finish(self) {
        self.live.finish();
    }
}
