//! A bad line between scanner and service.

use anyhow::Result;
use relief_tests::rig::{Rig, journal_columns, small_house};
use sim_scanner::config::SimConfig;
use sim_scanner::device::Event as Happened;
use sim_scanner::fault::FaultSpec;
use sim_scanner::line::LineFaults;

async fn columns_over(line: LineFaults) -> Result<(Vec<scan_record::RawColumn>, usize)> {
    let rig = Rig::start(&SimConfig {
        line,
        ..small_house()
    })
    .await?;
    let ended = rig.scan_to_result(&super::named("house")).await?;
    let columns = journal_columns(&rig.journal(&ended.scan.id).await?)?;
    let resent = rig
        .control()?
        .events()
        .iter()
        .filter(|event| matches!(event, Happened::Resent(_)))
        .count();
    rig.end().await?;
    Ok((columns, resent))
}

#[tokio::test(flavor = "multi_thread")]
async fn garbage_on_the_line_costs_repeats_and_no_sample() -> Result<()> {
    let (clean, resent) = columns_over(LineFaults::default()).await?;
    assert_eq!((clean.len(), resent), (60, 0));
    for faults in [
        "flip=1e-4,seed=3",
        "lose=3e-4,to=host,seed=4",
        "garbage=3e-4,seed=5",
    ] {
        let line = faults.parse::<FaultSpec>()?.line;
        let (columns, resent) = columns_over(line).await?;
        assert!(
            resent > 0,
            "{faults}: nothing went wrong, so nothing was tried"
        );
        assert_eq!(columns, clean, "{faults}");
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn garbage_before_the_first_word_does_no_harm() -> Result<()> {
    let rig = Rig::start(&small_house()).await?;
    let control = rig.control()?;
    control.send_garbage(b"\x00\xff\x13 boot: version 7\r\n\x00\x01\x02\x00");
    control.corrupt_frames(2);
    let ended = rig.scan_to_result(&super::named("house")).await?;
    assert_eq!(ended.scan.columns, 60);
    rig.end().await
}
