//! Whether so little room is left that somebody is to be told.

use relief_api::DiskRoom;

use crate::service::{Service, lock};

/// What has been told of the room on the disks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Low {
    /// There is enough.
    #[default]
    No,
    /// There is not, and the disk did not even keep that this is to be told.
    Untold,
    /// There is not, and that is told.
    Told,
}

impl Low {
    /// As it is with so much free, and whether that is still to be told. There is enough again only
    /// once there is a tenth more than the limit: what goes to and fro is told once.
    fn next(self, free_bytes: u64, low_bytes: u64) -> Self {
        match self {
            Self::No if free_bytes < low_bytes => Self::Untold,
            Self::No => Self::No,
            _ if free_bytes >= low_bytes.saturating_add(low_bytes / 10) => Self::No,
            other => other,
        }
    }
}

impl Service {
    /// Tells once that little room is left, by the last look, until there is enough again.
    pub(super) fn tell_if_low(&self, low: &mut Low) {
        let storage = self.config().storage;
        let measured = *lock(&self.measured);
        let places = [
            (self.scans_dir(), measured.scans_free_bytes),
            (self.spool.root(), measured.results_free_bytes),
        ];
        let known = places
            .into_iter()
            .filter_map(|(folder, free)| Some((folder, free?)));
        let Some((folder, free_bytes)) = known.min_by_key(|(_, free_bytes)| *free_bytes) else {
            return;
        };
        let low_bytes = storage.low_bytes();
        let before = std::mem::replace(low, low.next(free_bytes, low_bytes));
        if *low != Low::Untold {
            return;
        }
        let disk = DiskRoom {
            folder: folder.display().to_string(),
            free_bytes,
            low_bytes,
            reserve_bytes: storage.reserve_bytes(),
        };
        let told = self.tell_of_disk(&disk);
        if before == Low::No {
            tracing::warn!(
                folder = disk.folder,
                free_bytes,
                "little room is left on the disk"
            );
            if let Err(error) = &told {
                tracing::error!(%error, "nobody is told yet that little room is left");
            }
        }
        if told.is_ok() {
            *low = Low::Told;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn little_room_is_news_once_until_there_is_a_tenth_more() {
        let mut low = Low::default();
        let mut told = 0;
        for free_bytes in [100, 99, 99, 101, 98, 109, 99, 110, 100, 99, 1_000] {
            low = low.next(free_bytes, 100);
            if low == Low::Untold {
                told += 1;
                low = Low::Told;
            }
        }
        assert_eq!((told, low), (2, Low::No));
        // What the disk did not keep stays to be told.
        assert_eq!(Low::Untold.next(99, 100), Low::Untold);
        // Without a limit nothing is.
        assert_eq!(Low::No.next(0, 0), Low::No);
    }
}
