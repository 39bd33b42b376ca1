//! The device behind a pair of pipes in memory, on a thread of its own: what all other ways are
//! compared with.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::Result;
use scanner_driver::ScannerError;
use scanner_driver::transport::Transport;
use scanner_driver::transport::memory::{MemoryTransport, pair};
use scanner_protocol::Activity;
use sim_scanner::control::LineUse;
use sim_scanner::device::{Device, DeviceSettings};
use sim_scanner::source::Source;

use crate::Attached;

/// Longest sleep of a device that nothing is due for.
const NAP: Duration = Duration::from_millis(5);

type Account = Arc<Mutex<(LineUse, u64)>>;

/// A device that sends this, in this process.
///
/// # Errors
/// None; as the other ways.
pub fn memory(source: Source, device: DeviceSettings) -> Result<Attached> {
    let (ours, theirs) = pair();
    let account = Account::default();
    let ended = Arc::new(AtomicBool::new(false));
    let served = {
        let (account, ended) = (Arc::clone(&account), Arc::clone(&ended));
        std::thread::spawn(move || serve(source, device, theirs, &account, &ended))
    };
    let mut ours = Some(ours);
    let connect = move || match ours.take() {
        Some(transport) => Ok(Box::new(transport) as Box<dyn Transport>),
        None => Err(ScannerError::NoSuchPort {
            port: "memory".to_owned(),
        }),
    };
    Ok(Attached {
        connector: Box::new(("memory".to_owned(), connect)),
        account: Box::new(move || *lock(&account)),
        device: Box::new(Served {
            ended,
            thread: Some(served),
        }),
    })
}

fn lock(account: &Account) -> MutexGuard<'_, (LineUse, u64)> {
    account.lock().unwrap_or_else(PoisonError::into_inner)
}

struct Served {
    ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Served {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It has only itself to look after.
            let _ = thread.join();
        }
    }
}

/// As the endpoint on a pseudo-terminal does, until either side hangs up.
fn serve(
    source: Source,
    settings: DeviceSettings,
    mut line: MemoryTransport,
    account: &Account,
    ended: &AtomicBool,
) {
    let start = Instant::now();
    let mut device = Device::new(source, settings, 1, Duration::ZERO);
    let mut pending: Vec<u8> = Vec::new();
    let mut buffer = [0; 4096];
    let mut sleep = Duration::ZERO;
    while !ended.load(Ordering::Relaxed) {
        let asleep = start.elapsed();
        let starved = device.snapshot(asleep).activity == Activity::Waiting;
        let unfetched = !pending.is_empty();
        // Either there is room for what is pending, or there is something to hear.
        let moved = if unfetched {
            line.write(&pending, NAP).map(|count| {
                pending.drain(..count);
                0
            })
        } else {
            line.read(&mut buffer, sleep)
        };
        let Ok(mut heard) = moved else { return };
        let now = start.elapsed();
        {
            let (line, _) = &mut *lock(account);
            let waited = now - asleep;
            if unfetched || starved {
                line.waited_for_host += waited;
            }
            if starved {
                line.waited_for_credit += waited;
            }
        }
        if unfetched {
            let Ok(more) = line.read(&mut buffer, Duration::ZERO) else {
                return;
            };
            heard = more;
        }
        device.receive(buffer.get(..heard).unwrap_or_default(), now);
        if !pending.is_empty() {
            device.guard(now);
            continue;
        }
        let poll = device.poll(now);
        pending = poll.bytes;
        {
            let (line, resent) = &mut *lock(account);
            line.to_host_bytes += pending.len() as u64;
            line.from_host_bytes += heard as u64;
            *resent = device.snapshot(now).frames_resent;
        }
        // What there is room for is no wait.
        match line.write(&pending, Duration::ZERO) {
            Ok(count) => drop(pending.drain(..count)),
            Err(_) => return,
        }
        sleep = poll
            .wake
            .map_or(NAP, |wake| wake.saturating_sub(start.elapsed()).min(NAP));
    }
}
