//! `relief scan`.

mod preview;

use relief_api::{Job, PlanRequest, Priority, Scan, StartScan, path};
use serde::Serialize;

use super::part::PartArgs;
use super::priority;
use super::regularize::RegularizeArgs;
use super::setting::{self, Setting};
use crate::failure::Failure;
use crate::follow;
use crate::output;
use crate::service::EndpointArgs;

/// Start a scan
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Names the deliverables
    #[arg(long, value_name = "NAME", default_value = "scan")]
    name: String,
    /// Who measures; carried into the report
    #[arg(
        long,
        value_name = "TEXT",
        default_value = "",
        hide_default_value = true
    )]
    operator: String,
    /// The part measured, such as its number; carried into the report
    #[arg(
        long,
        value_name = "TEXT",
        default_value = "",
        hide_default_value = true
    )]
    part: String,
    /// Anything else; carried into the report
    #[arg(
        long,
        value_name = "TEXT",
        default_value = "",
        hide_default_value = true
    )]
    note: String,
    /// Which scanner; needed where the service has several
    #[arg(
        long,
        value_name = "NAME",
        default_value = "",
        hide_default_value = true
    )]
    scanner: String,
    /// Whether its job goes before others that wait, or after them: high, normal or low
    #[arg(long, value_name = "PRIORITY", default_value = "normal", value_parser = priority::parse)]
    priority: Priority,
    /// Stay until the deliverables are published
    #[arg(long)]
    wait: bool,
    /// Show what the scan would be and begin nothing
    #[arg(long, conflicts_with = "wait")]
    preview: bool,
    /// A processing setting that differs, keyed as in the configuration, such as
    /// regrid.neighbours=25; may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = setting::parse)]
    settings: Vec<Setting>,
    #[command(flatten)]
    regularize: RegularizeArgs,
    #[command(flatten)]
    plan: PlanArgs,
    #[command(flatten)]
    processed: PartArgs,
    #[command(flatten)]
    endpoint: EndpointArgs,
}

/// What to measure, where it differs from the configured plan.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "What to measure, if not as configured")]
struct PlanArgs {
    /// x of the first column, millimetres
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    x_first_mm: Option<f64>,
    /// x beyond which no column lies, millimetres
    #[arg(
        long,
        value_name = "MM",
        allow_negative_numbers = true,
        conflicts_with = "columns"
    )]
    x_last_mm: Option<f64>,
    /// Distance of neighbouring columns, millimetres
    #[arg(long, value_name = "MM")]
    column_pitch_mm: Option<f64>,
    /// Number of columns
    #[arg(long, value_name = "N")]
    columns: Option<u32>,
    /// Angle of the lowest ray, degrees
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    angle_first_deg: Option<f64>,
    /// Angle of the highest ray, degrees
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    angle_last_deg: Option<f64>,
    /// Least y that matters, millimetres, instead of an angle
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    y_first_mm: Option<f64>,
    /// Greatest y that matters, millimetres, instead of an angle
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    y_last_mm: Option<f64>,
    /// Rays in a column
    #[arg(long, value_name = "N")]
    samples: Option<u16>,
    /// Exposure of a sample, microseconds
    #[arg(long, value_name = "US")]
    exposure_us: Option<u32>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Told {
    scan: Scan,
    #[serde(skip_serializing_if = "Option::is_none")]
    job: Option<Job>,
}

impl Args {
    fn request(self) -> Result<StartScan, Failure> {
        let plan = self.plan;
        let mut settings = setting::overrides(self.settings)?;
        self.regularize.add_to(&mut settings);
        self.processed.add_to(&mut settings);
        Ok(StartScan {
            name: self.name,
            part: self.part,
            operator: self.operator,
            note: self.note,
            scanner: self.scanner,
            priority: self.priority,
            plan: PlanRequest {
                x_first_mm: plan.x_first_mm,
                x_last_mm: plan.x_last_mm,
                pitch_mm: plan.column_pitch_mm,
                columns: plan.columns,
                angle_first_deg: plan.angle_first_deg,
                angle_last_deg: plan.angle_last_deg,
                y_first_mm: plan.y_first_mm,
                y_last_mm: plan.y_last_mm,
                samples: plan.samples,
                exposure_us: plan.exposure_us,
            },
            settings,
        })
    }
}

pub(crate) async fn run(args: Args, json: bool) -> Result<(), Failure> {
    let client = args.endpoint.client()?;
    let (wait, preview) = (args.wait, args.preview);
    let request = args.request()?;
    if preview {
        return preview::show(&client, &request, json).await;
    }
    // Listening begins before the scan, so that none of its events is missed.
    let events = if wait {
        Some(client.events().await?)
    } else {
        None
    };
    let scan: Scan = client.post(path::SCANS, &request).await?;
    let told = match events {
        None => Told { scan, job: None },
        Some(events) => {
            let followed = follow::scan(&client, events, &scan.id).await?;
            Told {
                scan: followed.scan,
                job: Some(followed.job),
            }
        }
    };
    output::either(json, &told, |told| {
        match told.job.as_ref().and_then(|job| job.directory.as_ref()) {
            Some(directory) => directory.clone(),
            None => told.scan.id.clone(),
        }
    })
}
