//! Messages to receivers: those that wait, and a log of the others. How a receiver is reached does
//! not matter here; the tables have the name of the first kind there was.
//!
//! A message is kept with the record that it tells of, both or neither, so that nothing that
//! has happened goes untold when the power fails.

use std::ops::RangeInclusive;

use redb::{Database, ReadableDatabase, ReadableTable, Table, TableDefinition, WriteTransaction};
use relief_api::{Delivery, DeliveryState, Job, Scan};
use serde::{Deserialize, Serialize};

use super::error::StoreError;
use super::record::{decode, encode};
use super::{JOBS, SCANS, Store};

/// A receiver's name, and a number that ascends for each receiver.
pub(super) type Key<'a> = (&'a str, u64);

/// Messages that wait to be delivered.
pub(super) const WAITING: TableDefinition<'_, Key<'_>, &[u8]> =
    TableDefinition::new("webhook_waiting");
/// What became of the others, in the order in which that was settled.
pub(super) const LOG: TableDefinition<'_, Key<'_>, &[u8]> = TableDefinition::new("webhook_log");

/// Messages that wait for one receiver at most: days of work of a scanner.
pub(crate) const MOST_WAITING: usize = 256;
/// Entries of a receiver's log.
pub(crate) const MOST_LOGGED: usize = 100;

/// A message as it is kept until it is delivered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Message {
    /// What became of it so far.
    pub(crate) delivery: Delivery,
    /// What it says, to the letter: JSON of a `WebhookMessage`.
    pub(crate) body: String,
}

/// A message that is about to be kept.
#[derive(Debug, Clone)]
pub(crate) struct Outgoing {
    pub(crate) receiver: String,
    pub(crate) message: Message,
}

/// A message that is kept, from now on or since earlier.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Added {
    pub(crate) receiver: String,
    pub(crate) number: u64,
    /// Numbers of those that had to make room for it.
    pub(crate) dropped: Vec<u64>,
}

/// All keys of a receiver.
fn all_of(receiver: &str) -> RangeInclusive<Key<'_>> {
    (receiver, 0)..=(receiver, u64::MAX)
}

/// Where a message is kept.
enum Place {
    /// Among those that wait, under this number.
    Waits(u64),
    /// In the log.
    Logged,
}

/// As much of a message that waits as tells which one it is.
#[derive(Deserialize)]
struct Waits {
    delivery: Known,
}

/// As much of an entry of the log.
#[derive(Deserialize)]
struct Known {
    id: String,
}

type Rows<'a> = Table<'a, Key<'static>, &'static [u8]>;

fn last(table: &Rows<'_>, receiver: &str) -> Result<u64, redb::Error> {
    let row = table.range(all_of(receiver))?.next_back().transpose()?;
    Ok(row.map_or(0, |(key, _)| key.value().1))
}

/// Puts what became of a message into the log, and takes the oldest out of it.
fn log(
    log: &mut Rows<'_>,
    waiting: &Rows<'_>,
    receiver: &str,
    delivery: &Delivery,
) -> Result<(), redb::Error> {
    let number = 1 + last(log, receiver)?.max(last(waiting, receiver)?);
    log.insert((receiver, number), encode(delivery).as_slice())?;
    let numbers: Vec<u64> = log
        .range(all_of(receiver))?
        .map(|row| Ok(row?.0.value().1))
        .collect::<Result<_, redb::Error>>()?;
    for number in &numbers[..numbers.len().saturating_sub(MOST_LOGGED)] {
        log.remove((receiver, *number))?;
    }
    Ok(())
}

impl Store {
    /// Where a message is, if it is kept already.
    fn place_of(
        &self,
        waiting: &Rows<'_>,
        logged: &Rows<'_>,
        receiver: &str,
        id: &str,
    ) -> Result<Option<Place>, redb::Error> {
        // What cannot be read is no reason to keep nothing more.
        for row in waiting.range(all_of(receiver))? {
            let (key, bytes) = row?;
            let waits = decode::<Waits>(&self.path, bytes.value());
            if waits.is_ok_and(|waits| waits.delivery.id == id) {
                return Ok(Some(Place::Waits(key.value().1)));
            }
        }
        for row in logged.range(all_of(receiver))? {
            let known = decode::<Known>(&self.path, row?.1.value());
            if known.is_ok_and(|known| known.id == id) {
                return Ok(Some(Place::Logged));
            }
        }
        Ok(None)
    }

    /// Whether this very message waits under this number, and not a later one of a receiver that
    /// was taken out and put in again.
    fn waits(
        &self,
        waiting: &Rows<'_>,
        receiver: &str,
        number: u64,
        id: &str,
    ) -> Result<bool, redb::Error> {
        let row = waiting.get((receiver, number))?;
        Ok(row.is_some_and(|bytes| {
            let waits = decode::<Waits>(&self.path, bytes.value());
            waits.is_ok_and(|waits| waits.delivery.id == id)
        }))
    }

    /// Keeps messages, but none a second time, where the record that it tells of is kept once
    /// more. What is kept with them is in the same transaction.
    fn add(
        &self,
        transaction: &WriteTransaction,
        outgoing: &[Outgoing],
    ) -> Result<Vec<Added>, redb::Error> {
        let mut added = Vec::new();
        for Outgoing { receiver, message } in outgoing {
            let mut waiting = transaction.open_table(WAITING)?;
            let mut logged = transaction.open_table(LOG)?;
            match self.place_of(&waiting, &logged, receiver, &message.delivery.id)? {
                // The disk may have kept it, and said that it had not: nobody has heard of it.
                Some(Place::Waits(number)) => {
                    added.push(Added {
                        receiver: receiver.clone(),
                        number,
                        dropped: Vec::new(),
                    });
                    continue;
                }
                Some(Place::Logged) => continue,
                None => {}
            }
            let number = 1 + last(&logged, receiver)?.max(last(&waiting, receiver)?);
            waiting.insert((receiver.as_str(), number), encode(message).as_slice())?;
            let numbers: Vec<u64> = waiting
                .range(all_of(receiver))?
                .map(|row| Ok(row?.0.value().1))
                .collect::<Result<_, redb::Error>>()?;
            let surplus = numbers.len().saturating_sub(MOST_WAITING);
            for number in &numbers[..surplus] {
                let row = waiting.remove((receiver.as_str(), *number))?;
                let kept = row.map(|bytes| decode::<Message>(&self.path, bytes.value()));
                // One that cannot be read is told when the service next starts.
                if let Some(Ok(Message { mut delivery, .. })) = kept {
                    delivery.state = DeliveryState::Dropped;
                    delivery.next_attempt_at = None;
                    log(&mut logged, &waiting, receiver, &delivery)?;
                }
            }
            added.push(Added {
                receiver: receiver.clone(),
                number,
                dropped: numbers[..surplus].to_vec(),
            });
        }
        Ok(added)
    }

    /// Keeps messages that tell of nothing that is kept.
    pub(crate) fn put_messages(&self, outgoing: &[Outgoing]) -> Result<Vec<Added>, StoreError> {
        self.with(|database| {
            let transaction = database.begin_write()?;
            let added = self.add(&transaction, outgoing)?;
            transaction.commit()?;
            Ok(added)
        })
    }

    /// Keeps a scan's record in place of any earlier one, and messages that tell of it.
    pub(crate) fn put_scan_telling(
        &self,
        scan: &Scan,
        outgoing: &[Outgoing],
    ) -> Result<Vec<Added>, StoreError> {
        let bytes = encode(scan);
        self.with(|database| {
            let transaction = database.begin_write()?;
            transaction
                .open_table(SCANS)?
                .insert(scan.id.as_str(), bytes.as_slice())?;
            let added = self.add(&transaction, outgoing)?;
            transaction.commit()?;
            Ok(added)
        })
    }

    /// Keeps a job's record in place of any earlier one, and messages that tell of it.
    pub(crate) fn put_job_telling(
        &self,
        job: &Job,
        outgoing: &[Outgoing],
    ) -> Result<Vec<Added>, StoreError> {
        let bytes = encode(job);
        self.with(|database| {
            let transaction = database.begin_write()?;
            transaction
                .open_table(JOBS)?
                .insert(job.id, bytes.as_slice())?;
            let added = self.add(&transaction, outgoing)?;
            transaction.commit()?;
            Ok(added)
        })
    }

    /// Keeps a new job under the next number, notes it on its scan, and keeps what `tell` makes
    /// of the scan as it is then: all or nothing.
    pub(crate) fn add_job(
        &self,
        mut job: Job,
        scan: &mut Scan,
        tell: impl FnOnce(&Scan) -> Vec<Outgoing>,
    ) -> Result<(Job, Vec<Added>), StoreError> {
        let mut noted = scan.clone();
        let kept = self.with(|database| {
            let transaction = database.begin_write()?;
            {
                let mut jobs = transaction.open_table(JOBS)?;
                job.id = jobs.last()?.map_or(1, |(id, _)| id.value() + 1);
                jobs.insert(job.id, encode(&job).as_slice())?;
                noted.jobs.push(job.id);
                transaction
                    .open_table(SCANS)?
                    .insert(noted.id.as_str(), encode(&noted).as_slice())?;
            }
            let added = self.add(&transaction, &tell(&noted))?;
            transaction.commit()?;
            Ok((job, noted, added))
        });
        let (job, noted, added) = kept?;
        *scan = noted;
        Ok((job, added))
    }

    /// Numbers of the messages that wait for a receiver, oldest first.
    pub(crate) fn waiting(&self, receiver: &str) -> Result<Vec<u64>, StoreError> {
        self.with(|database| {
            let table = database.begin_read()?.open_table(WAITING)?;
            let rows = table.range(all_of(receiver))?;
            rows.map(|row| Ok(row?.0.value().1)).collect()
        })
    }

    /// A message that waits; none if it does not any more.
    pub(crate) fn message(
        &self,
        receiver: &str,
        number: u64,
    ) -> Result<Option<Message>, StoreError> {
        let read = |database: &Database| -> Result<Option<Vec<u8>>, redb::Error> {
            let table = database.begin_read()?.open_table(WAITING)?;
            let row = table.get((receiver, number))?;
            Ok(row.map(|bytes| bytes.value().to_vec()))
        };
        let bytes = self.with(read)?;
        bytes.map(|bytes| decode(&self.path, &bytes)).transpose()
    }

    /// Keeps what became of a message that still waits. One that does not any more, since it had
    /// to make room, stays as it is.
    pub(crate) fn keep_attempt(
        &self,
        receiver: &str,
        number: u64,
        message: &Message,
    ) -> Result<(), StoreError> {
        self.with(|database| {
            let transaction = database.begin_write()?;
            {
                let mut waiting = transaction.open_table(WAITING)?;
                if self.waits(&waiting, receiver, number, &message.delivery.id)? {
                    waiting.insert((receiver, number), encode(message).as_slice())?;
                }
            }
            Ok(transaction.commit()?)
        })
    }

    /// Keeps how a message ended, which waits no more. One that had to make room, or whose receiver
    /// has gone, is told of already.
    pub(crate) fn end_message(
        &self,
        receiver: &str,
        number: u64,
        delivery: &Delivery,
    ) -> Result<(), StoreError> {
        self.with(|database| {
            let transaction = database.begin_write()?;
            {
                let mut waiting = transaction.open_table(WAITING)?;
                if self.waits(&waiting, receiver, number, &delivery.id)? {
                    waiting.remove((receiver, number))?;
                    let mut logged = transaction.open_table(LOG)?;
                    log(&mut logged, &waiting, receiver, delivery)?;
                }
            }
            Ok(transaction.commit()?)
        })
    }

    /// Keeps what became of a message that never waited.
    pub(crate) fn log_delivery(
        &self,
        receiver: &str,
        delivery: &Delivery,
    ) -> Result<(), StoreError> {
        self.with(|database| {
            let transaction = database.begin_write()?;
            {
                let waiting = transaction.open_table(WAITING)?;
                let mut logged = transaction.open_table(LOG)?;
                log(&mut logged, &waiting, receiver, delivery)?;
            }
            Ok(transaction.commit()?)
        })
    }

    /// All that is known of messages to a receiver, newest first.
    pub(crate) fn deliveries(&self, receiver: &str) -> Result<Vec<Delivery>, StoreError> {
        type Bytes = Vec<Vec<u8>>;
        let read = |database: &Database| -> Result<(Bytes, Bytes), redb::Error> {
            let transaction = database.begin_read()?;
            let rows = |table: TableDefinition<'_, Key<'static>, &'static [u8]>| {
                let table = transaction.open_table(table)?;
                let rows = table.range(all_of(receiver))?;
                rows.map(|row| Ok(row?.1.value().to_vec()))
                    .collect::<Result<Bytes, redb::Error>>()
            };
            Ok((rows(WAITING)?, rows(LOG)?))
        };
        let (waiting, logged) = self.with(read)?;
        let mut found = Vec::new();
        for bytes in waiting.iter().rev() {
            found.push(decode::<Message>(&self.path, bytes)?.delivery);
        }
        for bytes in logged.iter().rev() {
            found.push(decode::<Delivery>(&self.path, bytes)?);
        }
        // Times are of one length and in UTC. Of those made within one millisecond, whose order
        // this keeps, the later numbers are the newer ones, and what still waits is newer than
        // what has ended.
        found.sort_by(|a, b| b.created_at.cmp(&a.created_at));
        Ok(found)
    }

    /// Forgets what was kept for receivers that are not among these. Gives the names of those
    /// that messages waited for, and how many.
    pub(crate) fn forget_other_receivers(
        &self,
        known: &[&str],
    ) -> Result<Vec<(String, usize)>, StoreError> {
        self.with(|database| {
            let transaction = database.begin_write()?;
            let mut forgotten: Vec<(String, usize)> = Vec::new();
            for (definition, counts) in [(WAITING, true), (LOG, false)] {
                let mut table = transaction.open_table(definition)?;
                let all: Vec<(String, u64)> = table
                    .iter()?
                    .map(|row| {
                        let (key, _) = row?;
                        let (name, number) = key.value();
                        Ok((name.to_owned(), number))
                    })
                    .collect::<Result<_, redb::Error>>()?;
                for (name, number) in all {
                    if known.contains(&name.as_str()) {
                        continue;
                    }
                    table.remove((name.as_str(), number))?;
                    if !counts {
                        continue;
                    }
                    match forgotten.last_mut().filter(|(last, _)| *last == name) {
                        Some((_, count)) => *count += 1,
                        None => forgotten.push((name, 1)),
                    }
                }
            }
            transaction.commit()?;
            Ok(forgotten)
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use relief_api::WebhookEvent;
    use storage::LocalDisk;

    use super::*;

    fn open() -> (tempfile::TempDir, Store) {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(Arc::new(LocalDisk), &folder.path().join("store")).unwrap();
        (folder, store)
    }

    fn outgoing(receiver: &str, second: usize) -> Outgoing {
        Outgoing {
            receiver: receiver.into(),
            message: Message {
                delivery: Delivery {
                    id: format!("msg_{receiver}_{second}"),
                    event: WebhookEvent::JobDone,
                    about: None,
                    state: DeliveryState::Waiting,
                    created_at: format!("2026-11-22T00:{:02}:{:02}.000Z", second / 60, second % 60),
                    attempts: 0,
                    tried: Vec::new(),
                    next_attempt_at: None,
                },
                body: format!("{second}"),
            },
        }
    }

    #[test]
    fn messages_wait_in_order_for_each_webhook_until_they_end() {
        let (_folder, store) = open();
        for second in 0..3 {
            let both = [outgoing("a", second), outgoing("b", second)];
            let added = store.put_messages(&both).unwrap();
            let number = second as u64 + 1;
            assert_eq!((added[0].number, added[1].number), (number, number));
        }
        assert_eq!(store.waiting("a").unwrap(), [1, 2, 3]);
        let mut message = store.message("a", 2).unwrap().unwrap();
        assert_eq!(message.body, "1");
        message.delivery.attempts = 7;
        store.keep_attempt("a", 2, &message).unwrap();
        assert_eq!(store.message("a", 2).unwrap().unwrap(), message);
        message.delivery.state = DeliveryState::Delivered;
        store.end_message("a", 2, &message.delivery).unwrap();
        // A late attempt does not bring it back.
        store.keep_attempt("a", 2, &message).unwrap();
        assert_eq!(store.message("a", 2).unwrap(), None);
        assert_eq!(store.waiting("a").unwrap(), [1, 3]);
        assert_eq!(store.waiting("b").unwrap(), [1, 2, 3]);
        let told: Vec<(String, DeliveryState)> = store
            .deliveries("a")
            .unwrap()
            .into_iter()
            .map(|delivery| (delivery.id, delivery.state))
            .collect();
        use DeliveryState as S;
        assert_eq!(
            told,
            [
                ("msg_a_2".into(), S::Waiting),
                ("msg_a_1".into(), S::Delivered),
                ("msg_a_0".into(), S::Waiting)
            ]
        );
        // Numbers are not given twice while anything of before is known.
        let added = store.put_messages(&[outgoing("a", 9)]).unwrap();
        assert_eq!(added[0].number, 5);
        assert_eq!(
            store.forget_other_receivers(&["b"]).unwrap(),
            [("a".to_owned(), 3)]
        );
        assert_eq!(store.deliveries("a").unwrap(), []);
        assert_eq!(store.waiting("b").unwrap(), [1, 2, 3]);
    }

    #[test]
    fn messages_of_one_millisecond_are_told_newest_first() {
        let (_folder, store) = open();
        let of_one_time = ["c", "a", "d", "b"].map(|id| Outgoing {
            message: Message {
                delivery: Delivery {
                    id: id.into(),
                    ..outgoing("lab", 7).message.delivery
                },
                body: "{}".into(),
            },
            receiver: "lab".into(),
        });
        for ended in &of_one_time[..2] {
            store.log_delivery("lab", &ended.message.delivery).unwrap();
        }
        store.put_messages(&of_one_time[2..]).unwrap();
        let told = store.deliveries("lab").unwrap();
        let ids: Vec<&str> = told.iter().map(|delivery| &*delivery.id).collect();
        assert_eq!(ids, ["b", "d", "a", "c"]);
    }

    #[test]
    fn a_message_is_kept_once_for_each_webhook() {
        let (_folder, store) = open();
        let both = [outgoing("a", 1), outgoing("b", 1)];
        let first = store.put_messages(&both[..1]).unwrap();
        // It waits for one of them, who may not have heard of it.
        let added = store.put_messages(&both).unwrap();
        assert_eq!(added[..1], first);
        let numbers: Vec<_> = added.iter().map(|a| (&*a.receiver, a.number)).collect();
        assert_eq!(numbers, [("a", 1), ("b", 1)]);
        assert_eq!(store.waiting("a").unwrap(), [1]);
        store.put_messages(&[outgoing("a", 2)]).unwrap();
        let mut delivery = store.message("a", 1).unwrap().unwrap().delivery;
        delivery.state = DeliveryState::Delivered;
        store.end_message("a", 1, &delivery).unwrap();
        // One has got it.
        assert_eq!(store.put_messages(&both).unwrap(), added[1..]);
        assert_eq!(store.waiting("a").unwrap(), [2]);
        assert_eq!(store.deliveries("a").unwrap()[1..], [delivery]);
    }

    /// The receiver was taken out and put in again while a message of before was under way.
    #[test]
    fn what_becomes_of_one_message_is_not_taken_for_anothers() {
        let (_folder, store) = open();
        let [before, after] = [outgoing("a", 1), outgoing("a", 2)];
        store.put_messages(std::slice::from_ref(&before)).unwrap();
        store.forget_other_receivers(&[]).unwrap();
        store.put_messages(std::slice::from_ref(&after)).unwrap();
        let (mut late, waits) = (before.message, after.message);
        late.delivery.attempts = 1;
        store.keep_attempt("a", 1, &late).unwrap();
        assert_eq!(store.message("a", 1).unwrap(), Some(waits.clone()));
        late.delivery.state = DeliveryState::Delivered;
        store.end_message("a", 1, &late.delivery).unwrap();
        assert_eq!(store.message("a", 1).unwrap(), Some(waits));
        let delivered = |delivery: &Delivery| delivery.state == DeliveryState::Delivered;
        assert!(!store.deliveries("a").unwrap().iter().any(delivered));
    }

    #[test]
    fn too_many_messages_push_out_the_oldest_and_the_log_is_bounded() {
        let (_folder, store) = open();
        let all: Vec<Outgoing> = (0..MOST_WAITING).map(|s| outgoing("a", s)).collect();
        let added = store.put_messages(&all).unwrap();
        assert!(added.iter().all(|added| added.dropped.is_empty()));
        let added = store.put_messages(&[outgoing("a", 1_000)]).unwrap();
        assert_eq!(added[0].dropped, [1]);
        assert_eq!(store.waiting("a").unwrap().len(), MOST_WAITING);
        let dropped = store.deliveries("a").unwrap().pop().unwrap();
        assert_eq!(
            (dropped.id.as_str(), dropped.state),
            ("msg_a_0", DeliveryState::Dropped)
        );
        for number in store.waiting("a").unwrap() {
            let message = store.message("a", number).unwrap().unwrap();
            store.end_message("a", number, &message.delivery).unwrap();
        }
        let kept = store.deliveries("a").unwrap();
        assert_eq!(kept.len(), MOST_LOGGED);
        assert_eq!(kept[0].id, "msg_a_1000");
    }
}
