//! Where things are. Patterns are for the server's router, functions for clients.

/// [`crate::Status`].
pub const STATUS: &str = "/v1/status";
/// The scans; a new one is posted here.
pub const SCANS: &str = "/v1/scans";
/// Says what a scan would come to.
pub const SCAN_PREVIEW: &str = "/v1/scans/preview";
/// Pattern of one scan.
pub const SCAN: &str = "/v1/scans/{scan}";
/// Pattern of the abort of one scan.
pub const SCAN_ABORT: &str = "/v1/scans/{scan}/abort";
/// Pattern of the pause of one scan.
pub const SCAN_PAUSE: &str = "/v1/scans/{scan}/pause";
/// Pattern of letting one paused scan go on.
pub const SCAN_RESUME: &str = "/v1/scans/{scan}/resume";
/// Pattern of a scan's rerun.
pub const SCAN_RERUN: &str = "/v1/scans/{scan}/rerun";
/// Pattern of a scan's journal.
pub const SCAN_JOURNAL: &str = "/v1/scans/{scan}/journal";
/// The scanners.
pub const SCANNERS: &str = "/v1/scanners";
/// Pattern of one scanner.
pub const SCANNER: &str = "/v1/scanners/{scanner}";
/// Pattern of the abort of a scanner's scan.
pub const SCANNER_ABORT: &str = "/v1/scanners/{scanner}/abort";
/// Pattern of the pause of a scanner's scan.
pub const SCANNER_PAUSE: &str = "/v1/scanners/{scanner}/pause";
/// Pattern of letting a scanner's paused scan go on.
pub const SCANNER_RESUME: &str = "/v1/scanners/{scanner}/resume";
/// Pattern of the log of a scanner's laser.
pub const SCANNER_LASER: &str = "/v1/scanners/{scanner}/laser";
/// Aborts whatever scan is running, on every scanner.
pub const ABORT: &str = "/v1/abort";
/// Pauses the running scan; refused where several run.
pub const PAUSE: &str = "/v1/pause";
/// Lets the paused scan go on; refused where several are paused.
pub const RESUME: &str = "/v1/resume";
/// The jobs.
pub const JOBS: &str = "/v1/jobs";
/// Pattern of one job.
pub const JOB: &str = "/v1/jobs/{job}";
/// Pattern of a job's retry.
pub const JOB_RETRY: &str = "/v1/jobs/{job}/retry";
/// Pattern of a job's cancellation.
pub const JOB_CANCEL: &str = "/v1/jobs/{job}/cancel";
/// Pattern of one folder of the spool.
pub const SPOOL: &str = "/v1/spool/{result}";
/// Pattern of one file of the spool.
pub const SPOOL_FILE: &str = "/v1/spool/{result}/{file}";
/// Pattern of acknowledging a result.
pub const SPOOL_ACK: &str = "/v1/spool/{result}/ack";
/// The log of the lasers.
pub const LASER: &str = "/v1/laser";
/// The tokens; on the socket only.
pub const TOKENS: &str = "/v1/tokens";
/// Pattern of a token's revocation.
pub const TOKEN_REVOKE: &str = "/v1/tokens/{token}/revoke";
/// The webhooks.
pub const WEBHOOKS: &str = "/v1/webhooks";
/// Pattern of a webhook's log.
pub const WEBHOOK_DELIVERIES: &str = "/v1/webhooks/{webhook}/deliveries";
/// Pattern of a webhook's test.
pub const WEBHOOK_TEST: &str = "/v1/webhooks/{webhook}/test";
/// The hooks.
pub const HOOKS: &str = "/v1/hooks";
/// Pattern of a hook's log.
pub const HOOK_RUNS: &str = "/v1/hooks/{hook}/runs";
/// Pattern of a hook's test.
pub const HOOK_TEST: &str = "/v1/hooks/{hook}/test";
/// Workers elsewhere.
pub const FLEET: &str = "/v1/fleet";
/// The uploads.
pub const UPLOADS: &str = "/v1/uploads";
/// Pattern of an upload's log.
pub const UPLOAD_RUNS: &str = "/v1/uploads/{upload}/runs";
/// Pattern of an upload's test.
pub const UPLOAD_TEST: &str = "/v1/uploads/{upload}/test";
/// Pattern of a scan's range image.
pub const SCAN_IMAGE: &str = "/v1/scans/{scan}/image";
/// Pattern of trying other settings on a scan's range image.
pub const SCAN_REGRID: &str = "/v1/scans/{scan}/regrid";
/// Links that hold for a short time.
pub const TICKETS: &str = "/v1/tickets";
/// For Prometheus.
pub const METRICS: &str = "/v1/metrics";
/// All of this for programs.
pub const OPENAPI: &str = "/v1/openapi.json";
/// The event stream.
pub const EVENTS: &str = "/v1/events";

/// One scan.
#[must_use]
pub fn scan(id: &str) -> String {
    format!("{SCANS}/{}", segment(id))
}

/// Abort of one scan.
#[must_use]
pub fn scan_abort(id: &str) -> String {
    scan(id) + "/abort"
}

/// Pause of one scan.
#[must_use]
pub fn scan_pause(id: &str) -> String {
    scan(id) + "/pause"
}

/// Letting one paused scan go on.
#[must_use]
pub fn scan_resume(id: &str) -> String {
    scan(id) + "/resume"
}

/// Rerun of one scan.
#[must_use]
pub fn scan_rerun(id: &str) -> String {
    scan(id) + "/rerun"
}

/// Journal of one scan.
#[must_use]
pub fn scan_journal(id: &str) -> String {
    scan(id) + "/journal"
}

/// Range image of one scan.
#[must_use]
pub fn scan_image(id: &str) -> String {
    scan(id) + "/image"
}

/// Trying other settings on the range image of one scan.
#[must_use]
pub fn scan_regrid(id: &str) -> String {
    scan(id) + "/regrid"
}

/// One scanner.
#[must_use]
pub fn scanner(name: &str) -> String {
    format!("{SCANNERS}/{}", segment(name))
}

/// Abort of a scanner's scan.
#[must_use]
pub fn scanner_abort(name: &str) -> String {
    scanner(name) + "/abort"
}

/// Pause of a scanner's scan.
#[must_use]
pub fn scanner_pause(name: &str) -> String {
    scanner(name) + "/pause"
}

/// Letting a scanner's paused scan go on.
#[must_use]
pub fn scanner_resume(name: &str) -> String {
    scanner(name) + "/resume"
}

/// Log of a scanner's laser.
#[must_use]
pub fn scanner_laser(name: &str) -> String {
    scanner(name) + "/laser"
}

/// One job.
#[must_use]
pub fn job(id: crate::JobId) -> String {
    format!("{JOBS}/{id}")
}

/// Retry of one job.
#[must_use]
pub fn job_retry(id: crate::JobId) -> String {
    job(id) + "/retry"
}

/// Cancellation of one job.
#[must_use]
pub fn job_cancel(id: crate::JobId) -> String {
    job(id) + "/cancel"
}

/// One folder of the spool.
#[must_use]
pub fn spool(result: &str) -> String {
    format!("/v1/spool/{}", segment(result))
}

/// One file of the spool.
#[must_use]
pub fn spool_file(result: &str, file: &str) -> String {
    format!("{}/{}", spool(result), segment(file))
}

/// Acknowledgement of one result.
#[must_use]
pub fn spool_ack(result: &str) -> String {
    spool(result) + "/ack"
}

/// Revocation of one token.
#[must_use]
pub fn token_revoke(name: &str) -> String {
    format!("{TOKENS}/{}/revoke", segment(name))
}

/// Log of a webhook.
#[must_use]
pub fn webhook_deliveries(name: &str) -> String {
    format!("{WEBHOOKS}/{}/deliveries", segment(name))
}

/// Test of a webhook.
#[must_use]
pub fn webhook_test(name: &str) -> String {
    format!("{WEBHOOKS}/{}/test", segment(name))
}

/// Log of a hook.
#[must_use]
pub fn hook_runs(name: &str) -> String {
    format!("{HOOKS}/{}/runs", segment(name))
}

/// Test of a hook.
#[must_use]
pub fn hook_test(name: &str) -> String {
    format!("{HOOKS}/{}/test", segment(name))
}

/// Log of an upload.
#[must_use]
pub fn upload_runs(name: &str) -> String {
    format!("{UPLOADS}/{}/runs", segment(name))
}

/// Test of an upload.
#[must_use]
pub fn upload_test(name: &str) -> String {
    format!("{UPLOADS}/{}/test", segment(name))
}

/// One segment of a path, escaped (RFC 3986, section 2.3).
fn segment(text: &str) -> String {
    use core::fmt::Write;
    text.bytes().fold(String::new(), |mut out, byte| {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            out.push(char::from(byte));
        } else {
            // Writing to a string cannot fail.
            let _ = write!(out, "%{byte:02X}");
        }
        out
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_fit_their_patterns_and_are_escaped() {
        assert_eq!(
            scan_abort("20261121T110830.123Z-house"),
            "/v1/scans/20261121T110830.123Z-house/abort"
        );
        assert_eq!(job_retry(7), "/v1/jobs/7/retry");
        assert_eq!(
            spool_file("a/../b", "x y.igs"),
            "/v1/spool/a%2F..%2Fb/x%20y.igs"
        );
    }
}
