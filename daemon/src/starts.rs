//! Requests to start a scan that may come more than once.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

use deliverables::hexadecimal;
use jiff::{SignedDuration, Timestamp};
use relief_api::{RequestMark, Scan, StartScan};
use sha2::{Digest, Sha256};

use crate::error::ServiceError;
use crate::service::{Service, lock};

/// For how long a key is known.
const KNOWN_FOR: SignedDuration = SignedDuration::from_hours(24);
/// Scans that are looked through at a time.
const PAGE: usize = 100;

/// Keys of requests that are just being done.
#[derive(Debug, Default)]
pub(crate) struct UnderWay(Mutex<BTreeSet<String>>);

/// A key for which nobody else starts a scan meanwhile.
struct Held<'a> {
    keys: &'a UnderWay,
    key: &'a str,
}

impl UnderWay {
    fn hold<'a>(&'a self, key: &'a str) -> Result<Held<'a>, ServiceError> {
        if lock(&self.0).insert(key.to_owned()) {
            Ok(Held { keys: self, key })
        } else {
            Err(ServiceError::RequestUnderWay)
        }
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        lock(&self.keys.0).remove(self.key);
    }
}

impl Service {
    /// Starts a scan, unless a request with this key has started one: then that is the answer.
    pub(crate) fn start_scan_once(
        self: &Arc<Self>,
        request: &StartScan,
        key: String,
    ) -> Result<Scan, ServiceError> {
        let held = key.clone();
        let _held = self.starts.hold(&held)?;
        let wishes = serde_json::to_vec(request).unwrap_or_default();
        let mark = RequestMark {
            key,
            sha256: hexadecimal(&Sha256::digest(&wishes)),
        };
        match self.started_by(&mark.key)? {
            None => self.start_scan(request, Some(mark)),
            Some(scan) if scan.request.as_ref() == Some(&mark) => Ok(scan),
            Some(scan) => Err(ServiceError::KeyUsed { scan: scan.id }),
        }
    }

    /// The scan that a request with this key has started lately.
    fn started_by(&self, key: &str) -> Result<Option<Scan>, ServiceError> {
        let oldest = Timestamp::now() - KNOWN_FOR;
        let mut before = None;
        loop {
            let page = self.scans_part(before, Some(PAGE))?;
            for scan in page.scans {
                if scan
                    .started_at
                    .parse()
                    .is_ok_and(|at: Timestamp| at < oldest)
                {
                    return Ok(None);
                }
                if scan.request.as_ref().is_some_and(|mark| mark.key == key) {
                    return Ok(Some(scan));
                }
            }
            match page.next {
                Some(next) => before = Some(next),
                None => return Ok(None),
            }
        }
    }
}
