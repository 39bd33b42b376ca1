//! What a service tells.

use anyhow::{Result, bail};
use relief_api::{Event, Scan};
use relief_tests::rig::{Client, Events};

/// What a subscriber of the events hears.
pub(crate) struct Heard(Events);

impl Heard {
    pub(crate) async fn listen(client: &Client) -> Result<Self> {
        Ok(Self(client.events().await?))
    }

    /// Waits for the result of a scan; its name.
    pub(crate) async fn published(&mut self, scan: &str) -> Result<String> {
        let find = |event: &Event| match event {
            Event::Published {
                scan: of, result, ..
            } if of == scan => Some(Ok(result.clone())),
            Event::Scan(told) if told.id == scan => match told.state {
                relief_api::ScanState::Failed => Some(Err(told.reason.clone())),
                _ => None,
            },
            _ => None,
        };
        match self.0.until(find).await?.1 {
            Ok(result) => Ok(result),
            Err(reason) => bail!("the scan {scan} failed: {}", reason.unwrap_or_default()),
        }
    }

    /// Waits for the end of a scan.
    pub(crate) async fn over(&mut self, scan: &str) -> Result<Scan> {
        self.0.scan_over(scan).await
    }

    /// Results told before the service was gone and not looked at yet.
    pub(crate) async fn rest(&mut self) -> Vec<String> {
        let mut results = Vec::new();
        while let Ok(Some(event)) = self.0.next().await {
            if let Event::Published { result, .. } = event {
                results.push(result);
            }
        }
        results
    }
}
