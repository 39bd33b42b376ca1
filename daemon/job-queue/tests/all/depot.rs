//! Bytes come out as they went in, or not at all.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::future::Future;
use std::io::{self, Read, Write};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use async_nats::jetstream::Context;
use async_nats::jetstream::object_store::ObjectStore;
use async_nats::jetstream::stream::Stream;
use futures_util::TryStreamExt;
use job_queue::depot::{Bundle, CHUNK_BYTES, Depot, Kind, Parcel};
use job_queue::jetstream::JetStreamQueue;
use job_queue::{BenchName, QueueError};

use crate::server::{self, RUNTIME, connect, options};
use nats_child::Server;

/// A bench's bucket, and a way behind the depot's back.
struct Rig {
    _server: Arc<Server>,
    queue: Arc<JetStreamQueue>,
    depot: Depot,
    bench: BenchName,
    name: String,
    url: String,
}

impl Rig {
    fn new() -> Option<Self> {
        Self::with_quota(None)
    }

    fn with_quota(quota_bytes: Option<u64>) -> Option<Self> {
        let server = server::shared()?;
        let mut options = options(&server.url());
        options.quota_bytes = quota_bytes;
        let queue = connect(&options);
        Some(Self {
            depot: queue.depot(),
            queue,
            bench: BenchName::try_from("lab-1".to_owned()).unwrap(),
            name: format!("{}-lab-1", options.prefix),
            url: server.url(),
            _server: server,
        })
    }

    fn put(&self, bytes: &[u8]) -> Parcel {
        let mut from = bytes;
        self.depot
            .put(&self.bench, Kind::Journal, &mut from)
            .unwrap()
    }

    fn fetch(&self, parcel: &Parcel) -> Result<Vec<u8>, QueueError> {
        let mut to = Vec::new();
        self.depot
            .fetch(&self.bench, Kind::Journal, parcel, &mut to)
            .map(|()| to)
    }

    /// Why it cannot be fetched.
    fn damage(&self, parcel: &Parcel) -> String {
        match self.fetch(parcel).unwrap_err() {
            error @ QueueError::Damaged { .. } => error.to_string(),
            error => unreachable!("{error}"),
        }
    }

    fn behind<T, F: Future<Output = T>>(
        &self,
        work: impl FnOnce(Context, ObjectStore, Stream) -> F,
    ) -> T {
        RUNTIME.block_on(async {
            let client = async_nats::connect(&self.url).await.unwrap();
            let context = async_nats::jetstream::new(client);
            let objects = context.get_object_store(&self.name).await.unwrap();
            let stream = context.get_stream(format!("OBJ_{}", self.name)).await;
            work(context, objects, stream.unwrap()).await
        })
    }

    /// Messages of each subject.
    fn messages(&self, part: &str) -> BTreeMap<String, usize> {
        let filter = format!("$O.{}.{part}.>", self.name);
        self.behind(|_, _, stream| async move {
            let subjects = stream.info_with_subjects(filter).await.unwrap();
            subjects.try_collect().await.unwrap()
        })
    }
}

/// Bytes that cannot be packed.
fn noise(len: usize, seed: u64) -> Vec<u8> {
    let mut state = seed | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 32) as u8
    };
    (0..len).map(|_| next()).collect()
}

#[test]
fn what_was_put_is_fetched() {
    let Some(rig) = Rig::new() else { return };
    for len in [0, 1, CHUNK_BYTES, 6 * CHUNK_BYTES + 12_345] {
        let bytes = noise(len, 7);
        let parcel = rig.put(&bytes);
        assert_eq!(parcel.bytes, len as u64);
        let measured = Parcel::of_reader(&mut bytes.as_slice()).unwrap();
        assert_eq!(
            measured, parcel,
            "measuring puts nothing, and says the same"
        );
        assert!(rig.fetch(&parcel).unwrap() == bytes, "{len} bytes");
    }
    // A message may have no more than the server allows of, and there should not be many.
    let most = rig.messages("C").into_values().max().unwrap();
    assert!((8..=9).contains(&most), "{most} messages for a chunk");
}

#[test]
fn what_is_there_is_not_put_again() {
    let Some(rig) = Rig::new() else { return };
    let bytes = noise(CHUNK_BYTES + 1, 1);
    let parcel = rig.put(&bytes);
    let before = rig.messages("C");
    assert_eq!(rig.put(&bytes), parcel);
    assert_eq!(rig.messages("C"), before);
}

/// Two jobs may well have the same result, and are fetched and cleared up each in its time.
#[test]
fn what_becomes_of_a_result_is_none_of_the_others_worries() {
    let Some(rig) = Rig::new() else { return };
    let bytes = noise(1000, 11);
    let put = || {
        rig.depot
            .put(&rig.bench, Kind::Result, &mut bytes.as_slice())
            .unwrap()
    };
    let (first, second) = (put(), put());
    assert_eq!(first.sha256, second.sha256);
    rig.depot
        .remove(&rig.bench, Kind::Result, &first.chunks)
        .unwrap();
    let fetch = |parcel: &Parcel| {
        let mut to = Vec::new();
        rig.depot
            .fetch(&rig.bench, Kind::Result, parcel, &mut to)
            .map(|()| to)
    };
    assert!(matches!(fetch(&first), Err(QueueError::Damaged { .. })));
    assert_eq!(fetch(&second).unwrap(), bytes);
}

/// What a server believes to have is put all the same once somebody has missed it.
#[test]
fn what_is_missed_is_put_anew() {
    let Some(rig) = Rig::new() else { return };
    let bytes = noise(1000, 12);
    let parcel = rig.put(&bytes);
    let lost = format!("$O.{}.C.>", rig.name);
    rig.behind(|_, _, stream| async move { stream.purge().filter(lost).await.unwrap() });
    rig.damage(&parcel);
    rig.put(&bytes);
    assert!(
        rig.damage(&parcel).contains("missing"),
        "it is believed to be there"
    );
    rig.depot
        .put_anew(&rig.bench, Kind::Journal, &mut bytes.as_slice())
        .unwrap();
    assert_eq!(rig.fetch(&parcel).unwrap(), bytes);
}

#[test]
fn what_is_not_what_was_put_is_damaged() {
    let Some(rig) = Rig::new() else { return };
    let bytes = noise(2 * CHUNK_BYTES, 3);
    let parcel = rig.put(&bytes);
    let object = parcel.chunks[1].object(Kind::Journal);
    let replace = |with: Vec<u8>| {
        let object = object.clone();
        rig.behind(|_, objects, _| async move {
            objects
                .put(object.as_str(), &mut with.as_slice())
                .await
                .unwrap();
        });
    };
    let other = zstd::bulk::compress(&noise(CHUNK_BYTES, 4), 1).unwrap();
    let shorter = zstd::bulk::compress(&bytes[CHUNK_BYTES..2 * CHUNK_BYTES - 1], 1).unwrap();
    // A gigabyte in a few kilobytes: it must not fill the memory.
    let bomb = zstd::bulk::compress(&vec![0; 1 << 30], 1).unwrap();
    let cases = [
        (other, "not what was put"),
        (shorter, "not what was put"),
        (bomb, "unpacked"),
        (b"no zstd".to_vec(), "unpacked"),
        (noise(2 * CHUNK_BYTES, 5), "it takes"),
    ];
    for (with, why) in cases {
        replace(with);
        let told = rig.damage(&parcel);
        assert!(
            told.contains("chunk 2 of 2") && told.contains(why),
            "{told}"
        );
        assert!(told.contains(&parcel.chunks[1].sha256), "{told}");
    }
    replace(zstd::bulk::compress(&bytes[CHUNK_BYTES..], 19).unwrap());
    assert!(rig.fetch(&parcel).unwrap() == bytes);
}

#[test]
fn chunks_in_another_order_are_damaged() {
    let Some(rig) = Rig::new() else { return };
    let mut parcel = rig.put(&noise(2 * CHUNK_BYTES, 6));
    parcel.chunks.swap(0, 1);
    let told = rig.damage(&parcel);
    assert!(told.contains("not what was put"), "{told}");
}

#[test]
fn what_is_missing_is_named() {
    let Some(rig) = Rig::new() else { return };
    let parcel = rig.put(&noise(2 * CHUNK_BYTES, 8));
    // Its bytes are gone, or some of them.
    let subjects: Vec<_> = rig.messages("C").into_keys().collect();
    rig.behind(|_, _, stream| async move {
        let keep = stream.purge().filter(&subjects[0]).keep(3);
        keep.await.unwrap();
    });
    let told = rig.damage(&parcel);
    assert!(told.contains("bytes are missing"), "{told}");
    rig.depot
        .remove(&rig.bench, Kind::Journal, &parcel.chunks)
        .unwrap();
    let told = rig.damage(&parcel);
    assert!(told.contains("chunk 1 of 2"), "{told}");
    assert!(rig.messages("C").is_empty() && rig.messages("M").is_empty());
}

#[test]
fn what_is_there_in_vain_is_swept() {
    let Some(rig) = Rig::new() else { return };
    let needed = rig.put(&noise(CHUNK_BYTES, 9));
    let unneeded = rig.put(&noise(1000, 10));
    // Whoever put this was killed on the way; another object was marked as deleted.
    let half = format!("$O.{}.C.half", rig.name);
    rig.behind(|context, objects, _| async move {
        for _ in 0..3 {
            let sent = context.publish(half.clone(), "bytes".into()).await.unwrap();
            sent.await.unwrap();
        }
        objects
            .put("deleted", &mut [1_u8].as_slice())
            .await
            .unwrap();
        objects.delete("deleted").await.unwrap();
    });
    let name = needed.chunks[0].object(Kind::Journal);
    let sweep_but = |names: &[&str], grace| {
        let names = names.iter().map(ToString::to_string).collect();
        rig.depot.sweep(&rig.bench, &names, grace).unwrap()
    };
    let sweep = |grace| sweep_but(&[&name], grace);
    let listed = rig.depot.list(&rig.bench).unwrap();
    assert_eq!(listed.len(), 2);
    let hour = sweep(Duration::from_secs(3600));
    assert_eq!((hour.objects, hour.orphan_messages), (0, 0), "all is young");
    assert_eq!(rig.depot.list(&rig.bench).unwrap(), listed);
    // As long as something needed is not found, nobody knows whose bytes these are.
    let other = unneeded.chunks[0].object(Kind::Journal);
    let unsure = sweep_but(&[&name, &other, "j-elsewhere"], Duration::ZERO);
    assert_eq!((unsure.objects, unsure.orphan_messages), (0, 0));
    let swept = sweep(Duration::ZERO);
    assert_eq!((swept.objects, swept.orphan_messages), (1, 3));
    assert!(swept.bytes >= 1000, "{swept:?}");
    assert_eq!(rig.messages("C").len(), 1, "{:?}", rig.messages("C"));
    assert_eq!(rig.messages("M").len(), 1, "{:?}", rig.messages("M"));
    rig.fetch(&needed).unwrap();
    rig.damage(&unneeded);
    assert_eq!(sweep(Duration::ZERO), job_queue::depot::Swept::default());
}

#[test]
fn a_full_bucket_says_so() {
    let Some(rig) = Rig::with_quota(Some(1 << 20)) else {
        return;
    };
    let put = |len, seed| {
        let bytes = noise(len, seed);
        rig.depot
            .put(&rig.bench, Kind::Result, &mut bytes.as_slice())
    };
    let first = put(500_000, 1).unwrap();
    let refused = put(900_000, 2).unwrap_err();
    assert!(matches!(refused, QueueError::Full(_)), "{refused}");
    assert!(refused.to_string().contains("quota"), "{refused}");
    // What was put of it is in vain.
    let needed = first.chunks.iter().map(|one| one.object(Kind::Result));
    let swept = rig
        .depot
        .sweep(&rig.bench, &needed.collect(), Duration::ZERO)
        .unwrap();
    assert!(swept.orphan_messages > 0, "{swept:?}");
    put(300_000, 3).unwrap();
    assert!(rig.queue.is_connected());
}

#[test]
fn a_quota_that_no_server_can_promise_is_told() {
    if !nats_child::is_wanted() {
        return;
    }
    let lines = "jetstream { store_dir: \"FOLDER/kept\", max_file_store: 10MB }";
    let server = Server::new(lines).unwrap();
    server.start().unwrap();
    let mut options = options(&server.url());
    options.quota_bytes = Some(1 << 30);
    let depot = connect(&options).depot();
    let bench = BenchName::try_from("lab-1".to_owned()).unwrap();
    let refused = depot
        .put(&bench, Kind::Journal, &mut [1_u8].as_slice())
        .unwrap_err();
    assert!(matches!(refused, QueueError::Full(_)), "{refused}");
    let told = refused.to_string();
    assert!(
        told.contains("quota") && told.contains("1073741824 bytes"),
        "{told}"
    );
}

/// What a file is written to, and can be looked at.
#[derive(Clone, Default)]
struct Shelf(Rc<RefCell<Vec<u8>>>);

impl Write for Shelf {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn fetch_bundle(rig: &Rig, bundle: &Bundle) -> Result<BTreeMap<String, Vec<u8>>, QueueError> {
    let mut shelves = BTreeMap::<String, Shelf>::new();
    rig.depot
        .fetch_bundle(&rig.bench, Kind::Result, bundle, &mut |file| {
            let shelf = Shelf::default();
            shelves.insert(file.name.clone(), shelf.clone());
            Ok(Box::new(shelf))
        })?;
    let bytes = |(name, shelf): (String, Shelf)| (name, shelf.0.take());
    Ok(shelves.into_iter().map(bytes).collect())
}

#[test]
fn files_of_a_bundle_come_out_as_they_went_in() {
    let Some(rig) = Rig::new() else { return };
    let files: BTreeMap<String, Vec<u8>> = [
        ("empty.txt", 0),
        ("large.step", CHUNK_BYTES + 77),
        ("part.igs", 1234),
        ("zero", 0),
    ]
    .into_iter()
    .enumerate()
    .map(|(n, (name, len))| (name.to_owned(), noise(len, n as u64)))
    .collect();
    let readers = files.iter().map(|(name, bytes)| {
        let reader: Box<dyn Read> = Box::new(io::Cursor::new(bytes.clone()));
        (name.clone(), reader)
    });
    let bundle = rig
        .depot
        .put_bundle(&rig.bench, Kind::Result, readers.collect())
        .unwrap();
    assert_eq!(bundle.parcel.chunks.len(), 2, "four files in two objects");
    assert!(fetch_bundle(&rig, &bundle).unwrap() == files);
    // From another machine, anything may come.
    let spoils: [fn(&mut Bundle); 4] = [
        |b| b.files[0].name = "../etc/passwd".to_owned(),
        |b| b.files[1].name = b.files[2].name.clone(),
        |b| b.files[2].bytes += 1,
        |b| b.files[2].sha256 = b.files[1].sha256.clone(),
    ];
    for spoil in spoils {
        let mut bundle = bundle.clone();
        spoil(&mut bundle);
        let told = fetch_bundle(&rig, &bundle).unwrap_err();
        assert!(matches!(told, QueueError::Damaged { .. }), "{told}");
    }
}
