//! What is checked, by the way to the device.

pub(crate) mod bulk;
pub(crate) mod gadgets;
pub(crate) mod network;
pub(crate) mod serial;
pub(crate) mod udev;

use std::path::Path;
use std::time::Instant;

use anyhow::{Result, ensure};

use crate::scan::LIMIT;

/// A name, and what must succeed.
pub(crate) type Check = (&'static str, fn() -> Result<()>);

/// Waits until a path is there, or is not.
pub(crate) fn wait_for_path(path: &str, there: bool) -> Result<()> {
    let start = Instant::now();
    while Path::new(path).exists() != there {
        ensure!(
            start.elapsed() < LIMIT,
            "{path} {} within {LIMIT:?}",
            if there { "did not come" } else { "did not go" }
        );
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    Ok(())
}
