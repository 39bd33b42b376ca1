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
//! | `POST /v1/scanners/{scanner}/pause` | | the scan that was running there: [`Scan`] |
//! | `POST /v1/scanners/{scanner}/resume` | | the scan that was paused there: [`Scan`] |
//! | `GET /v1/scanners/{scanner}/laser` | | [`LaserLog`], the latest 1000 |
//! | `GET /v1/laser` | | [`LaserLog`], the latest 1000 of all scanners |
//! | `GET /v1/scans` | [`Part`] in the query | [`ScanList`], newest first |
//! | `POST /v1/scans` | [`StartScan`], `Idempotency-Key` | 202 [`Scan`] |
//! | `GET /v1/scans/{scan}` | | [`Scan`] |
//! | `POST /v1/scans/preview` | [`StartScan`] | what it would come to, with nothing moved: [`ScanPreview`] |
//! | `POST /v1/scans/{scan}/abort` | | [`Scan`] |
//! | `POST /v1/scans/{scan}/rerun` | [`Rerun`] | 202 [`Job`] |
//! | `GET /v1/scans/{scan}/image` | [`ImageRequest`] in the query | the range image so far: [`ScanImage`] |
//! | `POST /v1/scans/{scan}/regrid` | [`Regrid`] | what it would be otherwise, with nothing changed: [`RegridImage`] |
//! | `GET /v1/scans/{scan}/journal` | | the kept raw columns, a `.scan` file |
//! | `POST /v1/scans/{scan}/pause` | | [`Scan`] |
//! | `POST /v1/scans/{scan}/resume` | | [`Scan`] |
//! | `POST /v1/abort` | | the scans that were running, on every scanner: [`Aborted`] |
//! | `POST /v1/pause` | | the scan that was running: [`Scan`] |
//! | `POST /v1/resume` | | the scan that was paused: [`Scan`] |
//! | `GET /v1/jobs` | [`Part`] in the query | [`JobList`], newest first |
//! | `GET /v1/jobs/{job}` | | [`Job`] |
//! | `POST /v1/jobs/{job}/retry` | | 202 [`Job`] |
//! | `POST /v1/jobs/{job}/cancel` | | [`Job`] |
//! | `GET /v1/spool/{result}` | | [`SpoolEntry`] |
//! | `POST /v1/spool/{result}/ack` | | who has it since when: [`Job`] |
//! | `GET /v1/spool/{result}/{file}` | | the file |
//! | `GET /v1/tokens` | | [`TokenList`], oldest first; on the socket only, as the next two |
//! | `POST /v1/tokens` | [`CreateToken`] | 201 [`NewToken`] |
//! | `POST /v1/tokens/{token}/revoke` | | [`Token`] |
//! | `GET /v1/webhooks` | | [`WebhookList`] |
//! | `GET /v1/webhooks/{webhook}/deliveries` | | [`DeliveryList`], newest first |
//! | `POST /v1/webhooks/{webhook}/test` | | the message, and what came back: [`Delivery`] |
//! | `GET /v1/hooks` | | [`HookList`] |
//! | `GET /v1/hooks/{hook}/runs` | | [`HookRuns`], newest first |
//! | `POST /v1/hooks/{hook}/test` | | the run for the newest result: [`Delivery`] |
//! | `GET /v1/uploads` | | [`UploadList`] |
//! | `GET /v1/uploads/{upload}/runs` | | [`UploadRuns`], newest first |
//! | `POST /v1/uploads/{upload}/test` | | the copy of the newest result: [`Delivery`] |
//! | `GET /v1/fleet` | | [`Fleet`] |
//! | `POST /v1/tickets` | [`CreateTicket`] | 201 [`Ticket`] |
//! | `GET /v1/metrics` | | for Prometheus, as text |
//! | `GET /v1/openapi.json` | | this table for programs (OpenAPI 3.1) |
//! | `GET /v1/events` | | server-sent [`Event`]s, first [`Event::Status`] |
//!
//! Within `/v1`, fields and event kinds are only ever added; clients ignore those they do
//! not know.

mod event;
mod fleet;
mod hook;
mod image;
mod job;
mod laser;
mod list;
mod object;
pub mod path;
mod preview;
mod problem;
mod scan;
mod status;
mod ticket;
mod token;
mod upload;
mod webhook;

pub use event::{Event, LiveColumn};
pub use fleet::{Fleet, FleetBench, FleetJobs, FleetWorker};
pub use hook::{Hook, HookList, HookRuns};
pub use image::{DEFAULT_NODES, ImageRequest, MAX_NODES, Regrid, RegridImage, ScanImage};
pub use job::{Job, JobId, JobList, JobState, Priority, Rerun, SpoolEntry, SpoolFile, StageTiming};
pub use laser::{LaserEntry, LaserLog, LaserState};
pub use list::{MAX_LIMIT, Part};
pub use preview::ScanPreview;
pub use problem::Problem;
pub use scan::{
    Aborted, Interruption, MAX_NAME_CHARS, PlanRequest, RequestMark, Scan, ScanList, ScanState,
    SettingOverrides, StartScan,
};
pub use status::{
    CalibrationStatus, ScannerLink, ScannerList, ScannerStatus, ScannerSummary, Status,
    StorageStatus, THE_SCANNER,
};
pub use ticket::{CreateTicket, Ticket};
pub use token::{CreateToken, MAX_TOKEN_NAME_CHARS, NewToken, Token, TokenList};
pub use upload::{Upload, UploadList, UploadRuns};
pub use webhook::{
    Delivery, DeliveryAttempt, DeliveryList, DeliveryState, DiskRoom, ScannerState, Webhook,
    WebhookData, WebhookEvent, WebhookKind, WebhookList, WebhookMessage,
};
