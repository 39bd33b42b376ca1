//! A scanner in memory: a gable roof of two planes, delivered when the test says so.

use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::Duration;

use scanner_driver::protocol::{
    Activity, Calibration, Faults, Head, Identity, Limits, ScanPlan, text,
};
use scanner_driver::{
    DeviceStatus, InterruptedScan, LineCounts, Pause, RawColumn, RawSample, ScanInfo, ScanStream,
    Scanner, ScannerError, StreamControl, StreamItem,
};

use crate::rig::GUARD;

/// Micrometres per count, of table and profile.
const COUNT_UM: u32 = 1;
pub(crate) const COLUMNS: u32 = 60;
pub(crate) const SAMPLES: u16 = 60;
const PITCH_UM: i32 = 500;

/// Called with each acknowledged column.
type OnAcknowledge = Box<dyn Fn(u32) + Send + Sync>;

/// Called when a scan is about to start.
type OnStart = Box<dyn Fn() + Send>;

#[derive(Default)]
struct State {
    /// Columns that may still be delivered; `None` for any number.
    permits: Option<u32>,
    aborted: bool,
    homed: bool,
    /// What every call answers instead.
    trouble: Option<ScannerError>,
    /// A fault after this many columns of a scan.
    fault_after: Option<u32>,
    laser_on: bool,
    /// The serial number of another scanner that has been plugged in.
    other: Option<&'static str>,
    /// Nothing that is asked for comes back.
    hung: bool,
    /// A pause after this many columns of a scan, until somebody lets it go on.
    pause_after: Option<(u32, Pause)>,
    is_paused: bool,
    /// Columns are being delivered.
    is_scanning: bool,
    /// Somebody wants them to stop.
    pause_asked: bool,
}

/// The scanner, and the test's hand on it.
#[derive(Default)]
pub(crate) struct FakeScanner {
    state: Mutex<State>,
    changed: Condvar,
    on_acknowledge: Mutex<Option<OnAcknowledge>>,
    on_start: Mutex<Option<OnStart>>,
    acknowledged: Mutex<Vec<u32>>,
    taken_up: Mutex<Vec<InterruptedScan>>,
    this: std::sync::OnceLock<std::sync::Weak<FakeScanner>>,
}

impl FakeScanner {
    pub(crate) fn new() -> Arc<Self> {
        let scanner = Arc::new(Self::default());
        scanner.this.get_or_init(|| Arc::downgrade(&scanner));
        scanner
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.state.lock().unwrap());
        self.changed.notify_all();
    }

    /// From now on only this many columns are delivered.
    pub(crate) fn allow(&self, columns: u32) {
        self.change(|state| state.permits = Some(columns));
    }

    /// From now on columns flow freely.
    pub(crate) fn allow_all(&self) {
        self.change(|state| state.permits = None);
    }

    pub(crate) fn fail_with(&self, trouble: Option<ScannerError>) {
        self.change(|state| state.trouble = trouble);
    }

    pub(crate) fn fault_after(&self, columns: u32) {
        self.change(|state| state.fault_after = Some(columns));
    }

    /// The next scan stands still after this many columns.
    pub(crate) fn pause_after(&self, columns: u32, pause: Pause) {
        self.change(|state| state.pause_after = Some((columns, pause)));
    }

    /// What is to be told before this column, if the scan stands still there.
    fn pause_before(&self, index: u32) -> Option<Pause> {
        let mut state = self.state.lock().unwrap();
        let (_, pause) = state.pause_after.take_if(|(at, _)| *at == index)?;
        state.is_paused = true;
        Some(pause)
    }

    /// Waits until somebody lets the scan go on, or ends it.
    fn wait_for_resume(&self) {
        let state = self.state.lock().unwrap();
        let waiting = |state: &mut State| state.is_paused && !state.aborted;
        drop(self.changed.wait_while(state, waiting).unwrap());
    }

    /// Nothing comes back, not even an error, until what this gives is dropped.
    pub(crate) fn hang(self: &Arc<Self>) -> Hung {
        self.change(|state| state.hung = true);
        Hung(Arc::clone(self))
    }

    /// Another scanner is plugged in.
    pub(crate) fn swap(&self, serial: &'static str) {
        self.change(|state| state.other = Some(serial));
    }

    /// By hand, as for adjustment.
    pub(crate) fn switch_laser(&self, on: bool) {
        self.change(|state| state.laser_on = on);
    }

    pub(crate) fn laser_is_on(&self) -> bool {
        self.state.lock().unwrap().laser_on
    }

    /// Waits until the laser is off: the thread that delivers turns it off once it sees that
    /// nobody wants its columns, which may be after the scan has ended for the service.
    pub(crate) fn laser_goes_off(&self) {
        let state = self.state.lock().unwrap();
        let waited = self
            .changed
            .wait_timeout_while(state, GUARD, |state| state.laser_on);
        assert!(!waited.unwrap().1.timed_out(), "the laser stays on");
    }

    pub(crate) fn acknowledged(&self) -> Vec<u32> {
        self.acknowledged.lock().unwrap().clone()
    }

    /// The scans that it was asked to go on with.
    pub(crate) fn taken_up(&self) -> Vec<InterruptedScan> {
        self.taken_up.lock().unwrap().clone()
    }

    pub(crate) fn on_acknowledge(&self, hook: impl Fn(u32) + Send + Sync + 'static) {
        *self.on_acknowledge.lock().unwrap() = Some(Box::new(hook));
    }

    /// Called once, when the next scan is about to start or to go on.
    pub(crate) fn on_start(&self, hook: impl Fn() + Send + 'static) {
        *self.on_start.lock().unwrap() = Some(Box::new(hook));
    }

    /// The columns from this one on; behind others, after a pause.
    fn deliver(&self, plan: ScanPlan, first: u32, waits_for: Option<String>) -> ScanStream {
        let (sender, receiver) = sync_channel(4);
        let this = self.this.get().unwrap().clone();
        let scanner = this.upgrade().unwrap();
        scanner.change(|state| state.is_scanning = true);
        std::thread::spawn(move || {
            if first > 0 {
                let needs_person = waits_for.is_some();
                let pause = Pause {
                    cause: ScannerError::ProgramEnded { before: waits_for },
                    needs_person,
                    columns: first,
                };
                // First, so that whoever hears of the pause can end it.
                scanner.change(|state| state.is_paused = needs_person);
                let _ = sender.send(StreamItem::Paused(pause));
                scanner.wait_for_resume();
                let _ = sender.send(StreamItem::Resumed);
            }
            let end = (first..plan.columns).try_for_each(|index| {
                let stand_still = |pause| {
                    let tell = |item| sender.send(item).map_err(|_| ScannerError::Closed);
                    tell(StreamItem::Paused(pause))?;
                    scanner.wait_for_resume();
                    tell(StreamItem::Resumed)
                };
                if let Some(pause) = scanner.pause_before(index) {
                    stand_still(pause)?;
                }
                while !scanner.wait_for_leave(index)? {
                    stand_still(Pause {
                        cause: ScannerError::PausedOnRequest,
                        needs_person: true,
                        columns: index,
                    })?;
                    scanner.change(|state| state.laser_on = true);
                }
                sender
                    .send(StreamItem::Column(column(&plan, index)))
                    .map_err(|_| ScannerError::Closed)
            });
            scanner.change(|state| {
                state.laser_on = false;
                state.is_scanning = false;
            });
            let _ = sender.send(StreamItem::End(end));
        });
        let info = ScanInfo {
            columns: plan.columns,
            spacing_um: plan.angle_step_counts.unsigned_abs() * COUNT_UM,
            uniform: true,
        };
        ScanStream::new(info, receiver, Arc::new(Control(this)))
    }

    fn check(&self) -> Result<(), ScannerError> {
        match &self.answering().trouble {
            Some(trouble) => Err(trouble.clone()),
            None => Ok(()),
        }
    }

    /// Waits until the scanner answers.
    fn answering(&self) -> MutexGuard<'_, State> {
        let state = self.state.lock().unwrap();
        self.changed.wait_while(state, |state| state.hung).unwrap()
    }

    /// Waits for leave to deliver column `index`; `false` means that somebody wants a pause.
    fn wait_for_leave(&self, index: u32) -> Result<bool, ScannerError> {
        let mut state = self.state.lock().unwrap();
        loop {
            state = self.changed.wait_while(state, |state| state.hung).unwrap();
            if state.aborted {
                return Err(ScannerError::Aborted);
            }
            if state.fault_after.is_some_and(|after| index >= after) {
                return Err(ScannerError::Fault(Faults::TABLE_STALL));
            }
            if std::mem::take(&mut state.pause_asked) {
                state.is_paused = true;
                return Ok(false);
            }
            match &mut state.permits {
                None => return Ok(true),
                Some(0) => state = self.changed.wait(state).unwrap(),
                Some(permits) => {
                    *permits -= 1;
                    return Ok(true);
                }
            }
        }
    }
}

/// A scanner that does not answer; also a test that fails lets go of it.
pub(crate) struct Hung(Arc<FakeScanner>);

impl Drop for Hung {
    fn drop(&mut self) {
        self.0.change(|state| state.hung = false);
    }
}

struct Control(std::sync::Weak<FakeScanner>);

impl StreamControl for Control {
    fn acknowledge(&self, column: u32) {
        if let Some(scanner) = self.0.upgrade() {
            scanner.acknowledged.lock().unwrap().push(column);
            if let Some(hook) = &*scanner.on_acknowledge.lock().unwrap() {
                hook(column);
            }
        }
    }

    fn close(&self) {
        if let Some(scanner) = self.0.upgrade() {
            scanner.change(|state| state.aborted = true);
        }
    }
}

impl Scanner for FakeScanner {
    fn identify(&self) -> Result<Identity, ScannerError> {
        self.check()?;
        Ok(Identity {
            model: text("Fake"),
            serial: text(self.state.lock().unwrap().other.unwrap_or("F-1")),
            firmware: text("0.1"),
            calibration: Calibration {
                table_count_pm: COUNT_UM * 1_000_000,
                table_origin_nm: 0,
                head: Head::Cartesian {
                    count_pm: COUNT_UM * 1_000_000,
                },
            },
            limits: Limits {
                table_min_counts: 0,
                table_max_counts: 100_000,
                lateral_min_counts: -20_000,
                lateral_max_counts: 20_000,
                max_line_rate_millihz: 0,
                max_columns: 10_000,
                max_samples: 1_000,
                max_credits: 64,
                min_exposure_us: 10,
                max_exposure_us: 10_000,
                min_dead_man_ms: 100,
                max_dead_man_ms: 10_000,
                proposed: ScanPlan {
                    first_table_counts: 0,
                    pitch_counts: PITCH_UM,
                    columns: COLUMNS,
                    first_angle_counts: -PITCH_UM * i32::from(SAMPLES) / 2,
                    angle_step_counts: PITCH_UM,
                    samples: SAMPLES,
                    exposure_us: 0,
                },
            },
        })
    }

    fn home(&self) -> Result<(), ScannerError> {
        self.check()?;
        self.change(|state| state.homed = true);
        Ok(())
    }

    fn status(&self) -> Result<DeviceStatus, ScannerError> {
        self.check()?;
        let state = self.state.lock().unwrap();
        Ok(DeviceStatus {
            activity: Activity::Idle,
            homed: state.homed,
            laser_on: state.laser_on,
            faults: Faults::NONE,
            table_counts: None,
            temperature_c: None,
            uptime: Duration::ZERO,
            line: LineCounts::default(),
        })
    }

    fn start_scan(&self, plan: &ScanPlan) -> Result<ScanStream, ScannerError> {
        self.check()?;
        let hook = self.on_start.lock().unwrap().take();
        if let Some(hook) = hook {
            hook();
        }
        self.change(|state| {
            assert!(state.homed, "the table was not homed");
            state.aborted = false;
            state.laser_on = true;
        });
        Ok(self.deliver(*plan, 0, None))
    }

    fn take_up_scan(&self, scan: InterruptedScan) -> Result<ScanStream, ScannerError> {
        let hook = self.on_start.lock().unwrap().take();
        if let Some(hook) = hook {
            hook();
        }
        self.change(|state| {
            state.homed = true;
            state.aborted = false;
            state.laser_on = true;
        });
        self.taken_up.lock().unwrap().push(scan.clone());
        Ok(self.deliver(scan.plan(), scan.columns(), scan.waits_for))
    }

    fn resume_scan(&self) -> Result<(), ScannerError> {
        self.change(|state| state.is_paused = false);
        Ok(())
    }

    fn pause_scan(&self) -> Result<(), ScannerError> {
        let mut state = self.answering();
        if !state.is_scanning {
            return Err(ScannerError::NothingToPause);
        }
        if !state.is_paused {
            state.pause_asked = true;
            state.laser_on = false;
            self.changed.notify_all();
        }
        Ok(())
    }

    fn abort(&self) -> Result<(), ScannerError> {
        drop(self.answering());
        self.change(|state| state.aborted = true);
        Ok(())
    }
}

/// A gable roof, its ridge along x at y = 0: z = 10 mm - |y| / 2.
fn column(plan: &ScanPlan, index: u32) -> RawColumn {
    RawColumn {
        index,
        table_counts: plan.first_table_counts + plan.pitch_counts * index as i32,
        samples: (0..i32::from(plan.samples))
            .map(|k| {
                let lateral_counts = plan.first_angle_counts + plan.angle_step_counts * k;
                RawSample {
                    lateral_counts,
                    range_counts: 10_000 - lateral_counts.abs() / 2,
                    intensity: 200,
                    saturated: false,
                }
            })
            .collect(),
        dropouts: 2,
    }
}
