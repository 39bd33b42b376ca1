//! Work that shows on standard error how far it is, and that Ctrl-C ends.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use deliverables::write_atomically;
use range_image::Monitor;

use crate::failure::Failure;
use crate::progress::Progress;

/// Shows on standard error how far it is; ends it on Ctrl-C.
pub(crate) struct Shown {
    stop: AtomicBool,
    bar: Mutex<Option<Progress>>,
}

impl Monitor for Shown {
    fn is_cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn progress(&self, fraction: f64) {
        if let Ok(mut bar) = self.bar.lock()
            && let Some(bar) = bar.as_mut()
        {
            bar.at(fraction, "");
        }
    }
}

impl Shown {
    /// Begins the next part of the work.
    pub(crate) fn begin(&self, title: &str) {
        self.end("done");
        if let Ok(mut bar) = self.bar.lock() {
            *bar = Some(Progress::share(title));
        }
    }

    fn end(&self, message: &str) {
        if let Ok(mut bar) = self.bar.lock()
            && let Some(bar) = bar.take()
        {
            bar.finish(message);
        }
    }
}

/// Does work on a thread of its own, which is asked to end on Ctrl-C; `what` stands for it where it
/// broke off.
pub(crate) async fn work<T: Send + 'static>(
    what: &str,
    work: impl FnOnce(&Shown) -> Result<T, Failure> + Send + 'static,
) -> Result<T, Failure> {
    let shown = Arc::new(Shown {
        stop: AtomicBool::new(false),
        bar: Mutex::new(None),
    });
    let worker = Arc::clone(&shown);
    let mut work = tokio::task::spawn_blocking(move || {
        let done = work(&worker);
        worker.end(if done.is_ok() { "done" } else { "failed" });
        done
    });
    let joined = tokio::select! {
        joined = &mut work => joined,
        _ = tokio::signal::ctrl_c() => {
            shown.stop.store(true, Ordering::Relaxed);
            work.await
        }
    };
    joined.map_err(|error| Failure::at(format!("{what} broke off"), &error))?
}

/// Draws pictures into a directory, which is made if it is not there; each comes as PNG with its name.
pub(crate) fn pictures(
    directory: &Path,
    draw: impl FnOnce() -> io::Result<Vec<(String, Vec<u8>)>>,
) -> Result<Vec<PathBuf>, Failure> {
    let cannot =
        |error: io::Error| Failure::at(format!("cannot draw into {}", directory.display()), &error);
    fs::create_dir_all(directory).map_err(cannot)?;
    let put = |(name, png): (String, Vec<u8>)| {
        let path = directory.join(name);
        write_atomically::<io::Error>(&path, |sink| sink.write_all(&png))
            .map_err(|error| Failure::at(format!("cannot draw {}", path.display()), &error))?;
        Ok(path)
    };
    draw().map_err(cannot)?.into_iter().map(put).collect()
}
