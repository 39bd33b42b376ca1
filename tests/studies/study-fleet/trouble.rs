//! What goes wrong, at moments drawn from a seed.

use std::fmt::Write;
use std::time::Duration;

use anyhow::Result;
use relief_tests::mutations::Dice;

use crate::cluster::{Cluster, Link};
use crate::workers::{Hire, Hired};

/// What has happened, and how often.
#[derive(Debug, Default)]
struct Counts {
    workers: u32,
    servers: u32,
    links: u32,
}

/// Workers, servers and links, and how they fare.
pub(crate) struct Trouble {
    dice: Dice,
    /// Between two troubles, as a rule.
    pause: Duration,
    hire: Hire,
    workers: Vec<Option<Hired>>,
    hired: usize,
    cluster: Cluster,
    links: [Link; 2],
    counts: Counts,
}

impl Trouble {
    /// Hires workers.
    pub(crate) fn begin(
        seed: u64,
        pause: Duration,
        workers: usize,
        hire: Hire,
        cluster: Cluster,
        links: [Link; 2],
    ) -> Result<Self> {
        let mut trouble = Self {
            dice: Dice::new(seed),
            pause,
            hire,
            workers: (0..workers).map(|_| None).collect(),
            hired: 0,
            cluster,
            links,
            counts: Counts::default(),
        };
        for place in 0..workers {
            trouble.hire(place)?;
        }
        Ok(trouble)
    }

    fn hire(&mut self, place: usize) -> Result<()> {
        self.hired += 1;
        let name = format!("hand-{}", self.hired);
        self.workers[place] = Some(self.hire.start(&name)?);
        Ok(())
    }

    fn draw(&mut self, least_ms: u64, most_ms: u64) -> Duration {
        let more = self.dice.below((most_ms - least_ms) as usize) as u64;
        Duration::from_millis(least_ms + more)
    }

    /// Waits a while, and has something go wrong for a while.
    pub(crate) async fn next(&mut self) -> Result<()> {
        let share = self.draw(500, 1500).as_secs_f64();
        tokio::time::sleep(self.pause.mul_f64(share)).await;
        let long = self.draw(200, 4000);
        match self.dice.below(4) {
            0 | 1 => {
                let place = self.dice.below(self.workers.len());
                // Dropped, it is killed.
                self.workers[place] = None;
                self.counts.workers += 1;
                tokio::time::sleep(long).await;
                self.hire(place)?;
            }
            2 => {
                let leader = self.cluster.leader();
                self.cluster.kill(leader);
                self.counts.servers += 1;
                tokio::time::sleep(long).await;
                self.cluster.start_again(leader)?;
            }
            _ => {
                let which = self.dice.below(self.links.len());
                self.links[which].cut(true);
                self.counts.links += 1;
                tokio::time::sleep(long).await;
                self.links[which].cut(false);
            }
        }
        Ok(())
    }

    /// No more trouble, and no more workers.
    pub(crate) fn end(&mut self) -> Result<()> {
        self.workers.clear();
        Ok(())
    }

    /// The servers themselves.
    pub(crate) fn cluster(&self) -> &Cluster {
        &self.cluster
    }

    /// What has happened so far.
    pub(crate) fn told(&self) -> String {
        let mut told = String::new();
        let Counts {
            workers,
            servers,
            links,
        } = self.counts;
        // A string takes all that is written.
        let _ = write!(
            told,
            "{workers} workers and {servers} leading servers killed, links cut {links} times"
        );
        told
    }
}
