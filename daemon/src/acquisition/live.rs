//! The range image that grows while the scanner moves.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use range_image::{Column, GridColumn};
use regrid::Regridder;
use relief_api::LiveColumn;
use scan_record::Header;
use scanner_protocol::ScanPlan;

use super::grid_file::GridFile;
use crate::config::Processing;
use crate::error::panic_text;
use crate::fit::Fit;
use crate::service::{KeptGrid, Service};

/// The regridding that runs along; a scan is kept even when this fails.
pub(super) struct Live<'a> {
    service: &'a Service,
    scan: &'a str,
    growing: Option<Growing>,
}

struct Growing {
    regridder: Regridder,
    fit: Fit,
    grid: KeptGrid,
    file: GridFile,
}

impl<'a> Live<'a> {
    /// One without any columns yet.
    pub(super) fn new(
        service: &'a Service,
        scan: &'a str,
        processing: &Processing,
        header: &Header,
        plan: &ScanPlan,
    ) -> Self {
        let growing = Growing::new(service, scan, processing, header, plan)
            .inspect_err(|problem| tracing::warn!(scan, %problem, "no live range image"))
            .ok();
        Self {
            service,
            scan,
            growing,
        }
    }

    /// None at all: the job regrids from the journal.
    pub(super) fn none(service: &'a Service, scan: &'a str) -> Self {
        Self {
            service,
            scan,
            growing: None,
        }
    }

    /// The grid columns that this column finished, for showing.
    pub(super) fn push(&mut self, column: Column) -> Vec<LiveColumn> {
        let Some(growing) = &mut self.growing else {
            return Vec::new();
        };
        let pushed = catch_unwind(AssertUnwindSafe(|| growing.push(column)));
        match pushed.unwrap_or_else(|panic| Err(defect(&*panic))) {
            Ok(finished) => finished
                .iter()
                .map(|column| LiveColumn::new(column.i, column.j_first, &column.z_mm))
                .collect(),
            Err(problem) => {
                // The job regrids from the journal and reports what is wrong.
                tracing::warn!(scan = self.scan, %problem, "the live range image ends here");
                self.growing = None;
                self.service.forget_grid(self.scan);
                Vec::new()
            }
        }
    }

    /// Distance of its nodes, millimetres; 0 if there is none.
    pub(super) fn pitch_mm(&self) -> f64 {
        self.growing
            .as_ref()
            .map_or(0.0, |growing| growing.grid.settings.pitch_mm)
    }

    /// Puts the rest of the grid aside for the job.
    pub(super) fn finish(mut self) {
        let Some(mut growing) = self.growing.take() else {
            return;
        };
        let rest = growing.regridder.finish();
        let written = rest
            .iter()
            .try_for_each(|column| growing.file.append(column))
            .and_then(|()| growing.file.finish());
        match written {
            Ok(()) => self.service.keep_grid(self.scan, growing.grid),
            Err(_) => self.service.forget_grid(self.scan),
        }
        tracing::debug!(scan = self.scan, "live range image finished");
    }
}

/// A defect of the regridding costs the live range image, and no scan.
fn defect(panic: &(dyn Any + Send)) -> String {
    let text = panic_text(panic);
    format!("{text}; this is a defect of the program, please report it")
}

/// One that nobody has finished is wanted by no job.
impl Drop for Live<'_> {
    fn drop(&mut self) {
        if self.growing.take().is_some() {
            self.service.forget_grid(self.scan);
        }
    }
}

impl Growing {
    fn new(
        service: &Service,
        scan: &str,
        processing: &Processing,
        header: &Header,
        plan: &ScanPlan,
    ) -> Result<Self, String> {
        let settings = processing
            .pipeline_settings(header.column_pitch_mm, header.sample_spacing_mm)
            .regrid;
        let most_samples = plan.columns as usize * usize::from(plan.samples);
        Ok(Self {
            regridder: Regridder::new(settings).map_err(|error| error.to_string())?,
            fit: Fit::new(&settings, most_samples),
            file: GridFile::create(&service.grid_path(scan), settings.pitch_mm)
                .map_err(|error| error.to_string())?,
            grid: KeptGrid { settings },
        })
    }

    /// The grid columns that this column finished.
    fn push(&mut self, column: Column) -> Result<Vec<GridColumn>, String> {
        self.fit.add(&column);
        if self.fit.is_missed() {
            let (problem, hint) = self.fit.told().unwrap_or_default();
            return Err(format!("{problem}; {hint}"));
        }
        let finished = self.regridder.push(column).map_err(|e| e.to_string())?;
        for column in &finished {
            self.file.append(column).map_err(|e| e.to_string())?;
        }
        if !finished.is_empty() {
            // Before anybody is told of them: who has just begun to look on reads the others here.
            self.file.show().map_err(|e| e.to_string())?;
        }
        Ok(finished)
    }
}
