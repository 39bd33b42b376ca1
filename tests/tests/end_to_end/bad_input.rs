//! Kept scans that nothing, or nothing good, can be made of: the job ends with the reason,
//! and the service goes on with the next.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use range_image::{Calibration, calibration::Head};
use relief_api::{Job, JobState};
use relief_tests::rig::{Refused, Rig, small_house};
use scan_record::{EndCause, Header, JournalReader, JournalWriter, RawColumn, RawSample};

/// Counts of a hundredth of a millimetre, of table and profile.
const COUNT_MM: f64 = 0.01;

/// A service with one kept scan, whose journal can be replaced.
struct Bench {
    rig: Rig,
    scan: String,
    header: Header,
}

impl Bench {
    async fn new() -> Result<Self> {
        let rig = Rig::start(&small_house()).await?;
        let ended = rig.scan_to_result(&super::named("house")).await?;
        let scan = ended.scan.id;
        let kept = JournalReader::open(&journal_path(&rig, &scan))?;
        let mut header = kept.header().clone();
        header.calibration = Calibration {
            table_origin_mm: 0.0,
            table_count_mm: COUNT_MM,
            head: Head::Cartesian { count_mm: COUNT_MM },
            correction: None,
        };
        header.column_pitch_mm = 0.5;
        header.sample_spacing_mm = 0.5;
        Ok(Self { rig, scan, header })
    }

    fn journal(&self) -> PathBuf {
        journal_path(&self.rig, &self.scan)
    }

    /// Runs the scan again with this in place of what was measured, to the job's end.
    async fn rerun(&self, journal: &[u8]) -> Result<Job> {
        std::fs::write(self.journal(), journal)?;
        let mut events = self.rig.client().events().await?;
        let job = self.rig.rerun(&self.scan, &[]).await?;
        self.rig.job_over(&mut events, job.id).await
    }

    /// The service refuses the job at once, and says this.
    async fn refuses(&self, journal: &[u8], because: &str) -> Result<()> {
        std::fs::write(self.journal(), journal)?;
        let Err(refused) = self.rig.rerun(&self.scan, &[]).await else {
            anyhow::bail!("a job was made, but {because}");
        };
        let problem = refused.downcast::<Refused>()?.0;
        assert_eq!(problem.kind, "nothing-kept", "{problem}");
        assert!(
            problem.detail.contains(because),
            "{problem} lacks {because}"
        );
        Ok(())
    }

    /// The job fails, says this, and leaves nothing behind.
    async fn fails(&self, journal: &[u8], because: &str) -> Result<()> {
        let before = self.rig.spooled()?;
        let job = self.rerun(journal).await?;
        let error = job.error.unwrap_or_default();
        assert_eq!(job.state, JobState::Failed, "{because}");
        assert!(error.contains(because), "{error} lacks {because}");
        assert_eq!(error.lines().count(), 1, "{error}");
        assert_eq!(self.rig.spooled()?, before, "{because}");
        Ok(())
    }

    /// The job succeeds, with this among its warnings.
    async fn warns(&self, journal: &[u8], of: &str) -> Result<()> {
        let job = self.rerun(journal).await?;
        assert_eq!(job.state, JobState::Done, "{of}: {:?}", job.error);
        let report = self.rig.result(&job.result).await?.json("report.json")?;
        let warnings = report["warnings"].as_array().context("no warnings")?;
        let found = warnings
            .iter()
            .any(|w| w.as_str().is_some_and(|w| w.contains(of)));
        assert!(found, "{warnings:?} lack {of}");
        Ok(())
    }

    fn columns(&self, columns: &[RawColumn]) -> Result<Vec<u8>> {
        self.with_header(&self.header, columns)
    }

    fn with_header(&self, header: &Header, columns: &[RawColumn]) -> Result<Vec<u8>> {
        let path = self.rig.folder().join("made.scan");
        let mut writer = JournalWriter::create(&path, header)?;
        for column in columns {
            writer.append(column)?;
        }
        writer.finish(&EndCause::Complete)?;
        let bytes = std::fs::read(&path)?;
        std::fs::remove_file(&path)?;
        Ok(bytes)
    }
}

fn journal_path(rig: &Rig, scan: &str) -> PathBuf {
    let scans = Path::new("state/scans");
    rig.folder().join(scans).join(format!("{scan}.scan"))
}

/// Columns half a millimetre apart; each sample at counts of y and z.
fn columns(count: i32, samples: impl Fn(i32) -> Vec<[i32; 2]>) -> Vec<RawColumn> {
    (0..count)
        .map(|i| RawColumn {
            index: i as u32,
            table_counts: 50 * i,
            dropouts: 0,
            samples: samples(i)
                .into_iter()
                .map(|[lateral_counts, range_counts]| RawSample {
                    lateral_counts,
                    range_counts,
                    intensity: 200,
                    saturated: false,
                })
                .collect(),
        })
        .collect()
}

/// A roof, 24 mm square.
fn roof() -> Vec<RawColumn> {
    columns(49, |i| {
        (0..49)
            .map(|j| [50 * j, 2000 - 25 * (i - 24).abs() + 5 * j])
            .collect()
    })
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_of_scans_without_a_surface_fail_with_the_reason() -> Result<()> {
    let bench = Bench::new().await?;
    let good = std::fs::read(bench.journal())?;
    let many = |count| columns(1, move |_| (0..count).map(|j| [10 * j, 2000]).collect());
    for (made, because) in [
        (columns(40, |_| vec![]), "none of its 40 columns has any"),
        (columns(1, |_| vec![[7, 7]]), "at one point in x and y"),
        (many(300), "at one x, a single column"),
        (many(60_000), "at one x, a single column"),
        (columns(300, |_| vec![[0, 2000]]), "at one y"),
        (
            columns(300, |i| vec![[100 * i, 2000]]),
            "on one slanted line",
        ),
        (
            columns(3, |i| vec![[0, i], [50, 0]]),
            "holds 6 samples only",
        ),
    ] {
        bench.fails(&bench.columns(&made)?, because).await?;
    }
    let none = bench.columns(&[])?;
    bench
        .refuses(&none, "it ended before its first column")
        .await?;
    // What no column of a journal can hold is refused before it is written.
    let refused = bench.columns(&many(1_000_000)).unwrap_err().to_string();
    assert!(
        refused.contains("1000000 samples, at most 65536"),
        "{refused}"
    );
    std::fs::remove_file(bench.rig.folder().join("made.scan"))?;
    // The service lives, and does what it is asked next.
    let next = bench.rerun(&good).await?;
    assert_eq!(next.state, JobState::Done, "{:?}", next.error);
    bench.rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_of_absurd_or_damaged_journals_fail_with_the_reason() -> Result<()> {
    let bench = Bench::new().await?;
    let good = std::fs::read(bench.journal())?;
    let sound = bench.columns(&roof())?;

    let mut far = bench.header.clone();
    far.calibration.head = Head::Cartesian { count_mm: 1e6 };
    let far = bench.with_header(&far, &roof())?;
    bench
        .fails(
            &far,
            "is beyond 25000 mm; check the units and the calibration",
        )
        .await?;
    let mut still = roof();
    still[5].table_counts = still[4].table_counts;
    let still = bench.columns(&still)?;
    bench
        .fails(&still, "strictly ascending or strictly descending x")
        .await?;
    let mut fine = bench.header.clone();
    fine.column_pitch_mm = 1e-9;
    fine.sample_spacing_mm = 1e-9;
    bench
        .fails(&bench.with_header(&fine, &roof())?, "pitch_mm")
        .await?;
    for scale in [f64::NAN, f64::INFINITY, 0.0] {
        let mut header = bench.header.clone();
        header.calibration.table_count_mm = scale;
        let journal = bench.with_header(&header, &roof())?;
        bench
            .refuses(&journal, "a scale that is zero or not finite")
            .await?;
    }
    bench.refuses(b"", "this is no scan journal").await?;
    bench
        .refuses(b"0 0 0\n0 1 0\n1 0 0\n", "this is no scan journal")
        .await?;
    bench
        .refuses(&[0x1f, 0x8b, 8, 0], "this is no scan journal")
        .await?;
    let mut damaged = sound.clone();
    damaged[40] ^= 1;
    bench
        .refuses(
            &damaged,
            "the header of this scan journal (byte 12) is damaged",
        )
        .await?;
    bench.refuses(&sound[..30], "is damaged").await?;

    let next = bench.rerun(&good).await?;
    assert_eq!(next.state, JobState::Done, "{:?}", next.error);
    bench.rig.end().await
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_odd_but_usable_is_made_with_a_warning() -> Result<()> {
    let bench = Bench::new().await?;
    let sound = bench.columns(&roof())?;
    let plane = columns(60, |_| (0..60).map(|j| [50 * j, 2000]).collect());
    bench
        .warns(&bench.columns(&plane)?, "one plane fills the view")
        .await?;
    let cut = &sound[..sound.len() * 3 / 4];
    bench.warns(cut, "a record is cut off").await?;
    let mut flipped = sound.clone();
    let at = flipped.len() * 3 / 4;
    flipped[at] ^= 1;
    bench.warns(&flipped, "does not match its checksum").await?;
    for (count_mm, pitch_mm) in [(5.0, 250.0), (3e-4, 0.015)] {
        let mut header = bench.header.clone();
        header.calibration.table_count_mm = count_mm;
        header.calibration.head = Head::Cartesian { count_mm };
        header.column_pitch_mm = pitch_mm;
        header.sample_spacing_mm = pitch_mm;
        let journal = bench.with_header(&header, &roof())?;
        bench
            .warns(&journal, "across, which is unusual: check the scanner's")
            .await?;
    }
    // Every sample twice is no more than every sample once.
    let doubled: Vec<RawColumn> = roof()
        .into_iter()
        .map(|mut column| {
            column.samples = column.samples.iter().flat_map(|s| [*s, *s]).collect();
            column
        })
        .collect();
    let job = bench.rerun(&bench.columns(&doubled)?).await?;
    assert_eq!(job.state, JobState::Done, "{:?}", job.error);
    let report = bench.rig.result(&job.result).await?.json("report.json")?;
    assert_eq!(report["model"]["faces"], 2);
    bench.rig.end().await
}
