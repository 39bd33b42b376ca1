//! Where a device's columns come from: the simulated optics, or a recording.

use scanner_protocol::{Calibration, Head as WireHead, Limits, RejectReason, ScanPlan};

use crate::Vec3;
use crate::preset::{COLUMNS_MAX, SAMPLES_MAX, TABLE_MM};
use crate::replay::Replay;
use crate::scanner::{Column, HeadKind, Scanner, Sweep};

/// What a device measures with.
#[derive(Debug, Clone)]
pub enum Source {
    /// Simulated optics, and the scan that covers the object.
    Simulated {
        /// Optics, mechanics, noise and scene.
        scanner: Box<Scanner>,
        /// The scan to propose.
        proposed: Sweep,
    },
    /// A recorded scan.
    Replay(Replay),
}

/// What a scan that was asked for comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Accepted {
    /// Columns that will come.
    pub columns: u32,
    /// Nominal distance between neighbouring samples, micrometres.
    pub spacing_um: u32,
    /// Whether laterals are evenly spaced.
    pub uniform: bool,
    /// For recordings: the first of the file's columns.
    first: u32,
}

/// Why a scan is refused: the reason, and its detail.
pub type Refusal = (RejectReason, u32);

impl Source {
    /// What counts mean.
    #[must_use]
    pub fn calibration(&self) -> Calibration {
        match self {
            Self::Simulated { scanner, .. } => Calibration {
                table_count_pm: scanner.mechanics.count_nm.saturating_mul(1000),
                table_origin_nm: scanner.table_origin_nm,
                head: match scanner.head.kind {
                    HeadKind::Polar {
                        angle_count_nrad,
                        range_count_nm,
                    } => WireHead::Polar {
                        camera_y_nm: nanometres(scanner.optics.camera_y_mm),
                        camera_z_nm: nanometres(scanner.optics.camera_z_mm),
                        angle_count_prad: angle_count_nrad.saturating_mul(1000),
                        range_count_pm: range_count_nm.saturating_mul(1000),
                    },
                    HeadKind::Cartesian { count_nm, .. } => WireHead::Cartesian {
                        count_pm: count_nm.saturating_mul(1000),
                    },
                },
            },
            Self::Replay(replay) => replay.calibration(),
        }
    }

    /// What the device can do, but for the pace and the dead-man time, which are the device's.
    #[must_use]
    pub fn limits(&self) -> Limits {
        let proposed = self.proposed();
        let (table, lateral, columns) = match self {
            Self::Simulated { scanner, .. } => {
                let reach = match scanner.head.kind {
                    // Half a right angle to either side.
                    HeadKind::Polar {
                        angle_count_nrad, ..
                    } => 785_398_163.0 / f64::from(angle_count_nrad),
                    HeadKind::Cartesian { count_nm, .. } => 1e9 / f64::from(count_nm),
                };
                let middle = match scanner.head.kind {
                    HeadKind::Polar { .. } => 0.0,
                    HeadKind::Cartesian { count_nm, .. } => {
                        scanner.optics.camera_y_mm * 1e6 / f64::from(count_nm)
                    }
                };
                (
                    (0, (TABLE_MM / scanner.mechanics.count_mm()) as i32),
                    ((middle - reach) as i32, (middle + reach) as i32),
                    COLUMNS_MAX,
                )
            }
            Self::Replay(replay) => (
                replay.table_counts(),
                replay.lateral_counts(),
                replay.columns().max(proposed.columns),
            ),
        };
        Limits {
            table_min_counts: table.0,
            table_max_counts: table.1,
            lateral_min_counts: lateral.0,
            lateral_max_counts: lateral.1,
            max_line_rate_millihz: 0,
            max_columns: columns,
            max_samples: match self {
                Self::Simulated { .. } => SAMPLES_MAX as u16,
                Self::Replay(_) => scanner_protocol::MAX_COLUMN_SAMPLES,
            },
            max_credits: 0,
            min_exposure_us: 10,
            max_exposure_us: 100_000,
            min_dead_man_ms: 0,
            max_dead_man_ms: 0,
            proposed,
        }
    }

    /// The scan to propose to a host without wishes.
    #[must_use]
    pub fn proposed(&self) -> ScanPlan {
        match self {
            Self::Simulated { proposed, .. } => ScanPlan {
                first_table_counts: proposed.first_table_counts,
                pitch_counts: proposed.pitch_counts,
                columns: proposed.columns,
                first_angle_counts: proposed.first_lateral_counts,
                angle_step_counts: proposed.lateral_step_counts,
                samples: u16::try_from(proposed.samples).unwrap_or(u16::MAX),
                exposure_us: 0,
            },
            Self::Replay(replay) => replay.proposed(),
        }
    }

    /// Judges a plan against the limits.
    ///
    /// # Errors
    /// The reason to reject it.
    pub fn accept(&self, plan: &ScanPlan) -> Result<Accepted, Refusal> {
        let limits = self.limits();
        if plan.columns == 0
            || plan.samples == 0
            || plan.pitch_counts == 0
            || plan.angle_step_counts == 0
        {
            return Err((RejectReason::Zero, 0));
        }
        if plan.columns > limits.max_columns {
            return Err((RejectReason::TooManyColumns, limits.max_columns));
        }
        if plan.samples > limits.max_samples {
            let most = u32::from(limits.max_samples);
            return Err((RejectReason::TooManySamples, most));
        }
        let within = |first: i32, step: i32, places: u32, low: i32, high: i32| {
            let last = i64::from(first) + i64::from(step) * i64::from(places - 1);
            let bounds = i64::from(low)..=i64::from(high);
            bounds.contains(&i64::from(first)) && bounds.contains(&last)
        };
        if !within(
            plan.first_table_counts,
            plan.pitch_counts,
            plan.columns,
            limits.table_min_counts,
            limits.table_max_counts,
        ) {
            return Err((RejectReason::TableLimit, 0));
        }
        if !within(
            plan.first_angle_counts,
            plan.angle_step_counts,
            u32::from(plan.samples),
            limits.lateral_min_counts,
            limits.lateral_max_counts,
        ) {
            return Err((RejectReason::AngleLimit, 0));
        }
        let exposures = limits.min_exposure_us..=limits.max_exposure_us;
        if plan.exposure_us != 0 && !exposures.contains(&plan.exposure_us) {
            return Err((RejectReason::Exposure, 0));
        }
        Ok(match self {
            Self::Simulated { scanner, .. } => Accepted {
                columns: plan.columns,
                spacing_um: spacing_um(scanner, plan),
                uniform: matches!(scanner.head.kind, HeadKind::Polar { .. })
                    && scanner.head.fan_jitter == 0.0,
                first: 0,
            },
            Self::Replay(replay) => {
                let (first, columns) = replay.select(plan);
                if columns == 0 {
                    return Err((RejectReason::TableLimit, 0));
                }
                Accepted {
                    columns,
                    spacing_um: replay.spacing_um(),
                    uniform: replay.is_uniform(),
                    first,
                }
            }
        })
    }

    /// A column of an accepted scan; the same whenever it is asked for.
    #[must_use]
    pub fn column(&self, plan: &ScanPlan, accepted: Accepted, repeat: u64, index: u32) -> Column {
        match self {
            Self::Simulated { scanner, .. } => scanner.column(&sweep(plan), repeat, index),
            Self::Replay(replay) => replay.column(plan, accepted.first, accepted.columns, index),
        }
    }

    /// Where the table stands for a column.
    pub(crate) fn table_counts(&self, plan: &ScanPlan, accepted: Accepted, column: u32) -> i32 {
        match self {
            Self::Simulated { .. } => sweep(plan).table_counts(column),
            Self::Replay(replay) => {
                replay
                    .column(plan, accepted.first, accepted.columns, column)
                    .table_counts
            }
        }
    }

    /// How far the object stands from where the part frame has it, millimetres.
    pub(crate) fn part_offset_mm(&self) -> Vec3 {
        match self {
            Self::Simulated { scanner, .. } => scanner.part_offset_mm,
            Self::Replay(_) => Vec3::ZERO,
        }
    }

    /// Shifts what stands on the table against where it stood at first, as when somebody bumps
    /// into it. A recording does not care.
    pub(crate) fn set_part_offset_mm(&mut self, offset_mm: Vec3) {
        if let Self::Simulated { scanner, .. } = self {
            scanner.part_offset_mm = offset_mm;
        }
    }
}

fn nanometres(mm: f64) -> i64 {
    libm::round(mm * 1e6) as i64
}

fn sweep(plan: &ScanPlan) -> Sweep {
    Sweep {
        first_table_counts: plan.first_table_counts,
        pitch_counts: plan.pitch_counts,
        columns: plan.columns,
        first_lateral_counts: plan.first_angle_counts,
        lateral_step_counts: plan.angle_step_counts,
        samples: u32::from(plan.samples),
    }
}

fn spacing_um(scanner: &Scanner, plan: &ScanPlan) -> u32 {
    let step = f64::from(plan.angle_step_counts.unsigned_abs());
    let spacing_mm = match scanner.head.kind {
        HeadKind::Polar {
            angle_count_nrad, ..
        } => {
            let (near, far) = scanner.head.window_mm;
            step * f64::from(angle_count_nrad) / 1e9 * (near + far) / 2.0
        }
        HeadKind::Cartesian { count_nm, .. } => step * f64::from(count_nm) / 1e6,
    };
    libm::round(spacing_mm * 1e3) as u32
}
