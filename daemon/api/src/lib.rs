//! The HTTP types of the Relief service, shared by server and clients.
//!
//! The service speaks HTTP/1.1 on a Unix socket, and on a loopback address if configured;
//! there every request needs a token (`Authorization: Bearer TOKEN`).
//! Bodies are JSON; errors are [`Problem`] (`application/problem+json`); events are
//! server-sent events whose data is one [`Event`] each.
//!
//! | method and path | request | reply |
//! | --- | --- | --- |
//! | `GET /v1/status` | | [`Status`] |
//! | `GET /v1/scanners` | | [`ScannerList`] |
//! | `GET /v1/scanners/{scanner}` | | [`ScannerSummary`] |
//! | `POST /v1/scanners/{scanner}/abort` | | the scan that was running there: [`Scan`] |
//! | `POST /v1/scanners/{scanner}/resume` | | the scan that was paused there: [`Scan`] |
//! | `GET /v1/scanners/{scanner}/laser` | | [`LaserLog`], the latest 1000 |
//! | `GET /v1/laser` | | [`LaserLog`], the latest 1000 of all scanners |
//! | `GET /v1/scans` | | [`ScanList`], newest first |
//! | `POST /v1/scans` | [`StartScan`] | 202 [`Scan`] |
//! | `GET /v1/scans/{scan}` | | [`Scan`] |
//! | `POST /v1/scans/preview` | [`StartScan`] | what it would come to, with nothing moved: [`ScanPreview`] |
//! | `POST /v1/scans/{scan}/abort` | | [`Scan`] |
//! | `POST /v1/scans/{scan}/rerun` | [`Rerun`] | 202 [`Job`] |
//! | `GET /v1/scans/{scan}/journal` | | the kept raw columns, a `.scan` file |
//! | `POST /v1/scans/{scan}/resume` | | [`Scan`] |
//! | `POST /v1/abort` | | the scans that were running, on every scanner: [`Aborted`] |
//! | `POST /v1/resume` | | the scan that was paused: [`Scan`] |
//! | `GET /v1/jobs` | | [`JobList`], newest first |
//! | `GET /v1/jobs/{job}` | | [`Job`] |
//! | `POST /v1/jobs/{job}/retry` | | 202 [`Job`] |
//! | `POST /v1/jobs/{job}/cancel` | | [`Job`] |
//! | `GET /v1/spool/{result}` | | [`SpoolEntry`] |
//! | `GET /v1/spool/{result}/{file}` | | the file |
//! | `GET /v1/tokens` | | [`TokenList`], oldest first; on the socket only, as the next two |
//! | `POST /v1/tokens` | [`CreateToken`] | 201 [`NewToken`] |
//! | `POST /v1/tokens/{token}/revoke` | | [`Token`] |
//! | `GET /v1/webhooks` | | [`WebhookList`] |
//! | `GET /v1/webhooks/{webhook}/deliveries` | | [`DeliveryList`], newest first |
//! | `POST /v1/webhooks/{webhook}/test` | | the message, and what came back: [`Delivery`] |
//! | `GET /v1/events` | | server-sent [`Event`]s, first [`Event::Status`] |
//!
//! Within `/v1`, fields and event kinds are only ever added; clients ignore those they do
//! not know.

mod event;
mod job;
mod laser;
pub mod path;
mod preview;
mod problem;
mod scan;
mod status;
mod token;
mod webhook;

pub use event::{Event, LiveColumn};
pub use job::{Job, JobId, JobList, JobState, Rerun, SpoolEntry, SpoolFile, StageTiming};
pub use laser::{LaserEntry, LaserLog, LaserState};
pub use preview::ScanPreview;
pub use problem::Problem;
pub use scan::{
    Aborted, Interruption, MAX_NAME_CHARS, PlanRequest, Scan, ScanList, ScanState,
    SettingOverrides, StartScan,
};
pub use status::{
    CalibrationStatus, ScannerLink, ScannerList, ScannerStatus, ScannerSummary, Status,
    StorageStatus, THE_SCANNER,
};
pub use token::{CreateToken, MAX_TOKEN_NAME_CHARS, NewToken, Token, TokenList};
pub use webhook::{
    Delivery, DeliveryAttempt, DeliveryList, DeliveryState, Webhook, WebhookData, WebhookEvent,
    WebhookList, WebhookMessage,
};
