//! Equal scans give equal bytes, whatever the road.

use anyhow::Result;
use relief_tests::direct::{self, Label};
use relief_tests::iges;
use relief_tests::rig::{Rig, small_house};
use sim_scanner::config::SimConfig;

#[tokio::test(flavor = "multi_thread")]
async fn streamed_equals_batch_and_one_thread_equals_two() -> Result<()> {
    let rig = Rig::start_with(&small_house(), |config| config.queue.threads = 1).await?;
    let mut request = super::named("house");
    request.operator = "A. Measurer".into();
    let ended = rig.scan_to_result(&request).await?;
    let streamed = rig.result(&ended.scan.id).await?.iges()?.clone();
    let batch = rig.rerun_to_result(&ended.scan.id, &[]).await?;
    let stages: Vec<&str> = batch.timings.iter().map(|t| t.stage.as_str()).collect();
    assert_eq!(stages[0], "regrid", "from the journal");
    assert_eq!(rig.result(&batch.result).await?.iges()?, &streamed);

    let journal = rig.journal(&ended.scan.id).await?;
    let label = Label::of(&ended.scan)?;
    for threads in [1, 2, 3] {
        let direct = direct::journal(&journal, &label, threads)?;
        assert!(direct == streamed, "directly on {threads} threads");
    }
    let converted = rig.folder().join("converted.igs");
    if let Some(converted) = direct::program(&journal, &label, &converted)? {
        assert!(converted == streamed, "by the program");
    }

    let rig = rig.restart(|config| config.queue.threads = 2).await?;
    let threaded = rig.rerun_to_result(&ended.scan.id, &[]).await?;
    assert_eq!(rig.result(&threaded.result).await?.iges()?, &streamed);
    rig.end().await
}

async fn house_of(seed: u64) -> Result<Vec<u8>> {
    let rig = Rig::start(&SimConfig {
        seed,
        ..small_house()
    })
    .await?;
    let ended = rig.scan_to_result(&super::named("house")).await?;
    let bytes = rig.result(&ended.scan.id).await?.iges()?.to_vec();
    rig.end().await?;
    Ok(bytes)
}

#[tokio::test(flavor = "multi_thread")]
async fn two_scans_with_one_seed_differ_in_their_times_alone() -> Result<()> {
    let (one, again) = (house_of(7).await?, house_of(7).await?);
    assert!(iges::without_times(&one)? == iges::without_times(&again)?);
    let other = house_of(8).await?;
    assert!(iges::without_times(&one)? != iges::without_times(&other)?);
    Ok(())
}
