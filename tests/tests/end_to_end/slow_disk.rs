//! A disk that is slow makes the table wait, and nothing is lost.

use std::io;
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, PoisonError};

use anyhow::Result;
use relief_tests::rig::{GUARD, Rig, journal_columns, small_house};
use scanner_protocol::Activity;
use sim_scanner::device::Event;
use storage::{Deed, HinderedDisk, Hindrance};

/// Syncs of journals that may still be done; `None` for any number.
#[derive(Debug, Clone, Default)]
struct Gate(Arc<(Mutex<Option<u32>>, Condvar)>);

impl Gate {
    fn change(&self, change: impl FnOnce(&mut Option<u32>)) {
        let (allowed, changed) = &*self.0;
        change(&mut allowed.lock().unwrap_or_else(PoisonError::into_inner));
        changed.notify_all();
    }

    /// One more than what was allowed before.
    fn allow_one(&self) {
        self.change(|allowed| *allowed = Some(allowed.unwrap_or_default() + 1));
    }

    fn allow_all(&self) {
        self.change(|allowed| *allowed = None);
    }

    fn pass(&self) {
        let (allowed, changed) = &*self.0;
        let closed = |allowed: &mut Option<u32>| *allowed == Some(0);
        let held = allowed.lock().unwrap_or_else(PoisonError::into_inner);
        let mut allowed = changed
            .wait_while(held, closed)
            .unwrap_or_else(PoisonError::into_inner);
        *allowed = allowed.map(|syncs| syncs - 1);
    }
}

impl Hindrance for Gate {
    fn before(&self, deed: Deed, path: &Path) -> io::Result<()> {
        if deed == Deed::SyncFile && path.extension().is_some_and(|e| e == "scan") {
            self.pass();
        }
        Ok(())
    }
}

/// Columns that the scanner may send ahead of their acknowledgement.
const CREDITS: u32 = 16;
/// Most columns that share a sync.
const SYNC_COLUMNS: u32 = 4;

#[tokio::test(flavor = "multi_thread")]
async fn a_slow_disk_makes_the_table_wait_and_loses_nothing() -> Result<()> {
    let gate = Gate::default();
    let disk = Arc::new(HinderedDisk(gate.clone()));
    let rig = Rig::start_on(&small_house(), disk, |config| {
        config.scanner.credits = Some(CREDITS);
        config.journal.sync_columns = SYNC_COLUMNS;
    })
    .await?;
    let quick = rig.scan_to_result(&super::named("quick")).await?.scan;
    let quick = journal_columns(&rig.journal(&quick.id).await?)?;

    let mut control = rig.control()?;
    // The header is synced, and then the disk takes its time, again and again.
    gate.allow_one();
    control.skip_events();
    let mut events = rig.client().events().await?;
    let scan = rig.scan(&super::named("slow")).await?;
    let mut sent = 0;
    for syncs in 0..4 {
        let waited = control.wait_for(
            GUARD,
            |event| matches!(event, Event::OutOfCredit(columns) if *columns > sent),
        )?;
        if let Event::OutOfCredit(columns) = waited {
            sent = columns;
        }
        // The table stands where the disk lets it: so many columns are safe at most.
        assert!(sent <= syncs * SYNC_COLUMNS + CREDITS, "{sent} columns");
        assert_eq!(control.snapshot().activity, Activity::Waiting);
        gate.allow_one();
    }
    gate.allow_all();
    let scan = events.scan_complete(&scan.id).await?;
    assert_eq!(scan.columns as usize, quick.len());
    let slow = journal_columns(&rig.journal(&scan.id).await?)?;
    assert!(slow == quick, "the columns of the slow scan are others");
    rig.end().await
}
