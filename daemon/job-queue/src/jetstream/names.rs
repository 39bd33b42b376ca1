//! Names of streams, buckets, consumers and subjects.

use std::collections::BTreeSet;

use crate::Priority;
use crate::order::{BenchName, JobKey, Need, Order};
use crate::queue::{QueueError, Worker};

/// Longest name of a tool.
const MOST_TOOL_CHARS: usize = 24;
/// Longest name of a class, which is part of a consumer's.
const MOST_CLASS_CHARS: usize = 120;
/// More memory than any machine has.
const MOST_GIB_LOG2: u32 = 20;

/// What begins all names.
#[derive(Debug, Clone)]
pub(crate) struct Names {
    prefix: String,
}

impl Names {
    pub(crate) fn new(prefix: &str) -> Self {
        Self {
            prefix: prefix.to_owned(),
        }
    }

    /// The stream of orders.
    pub(crate) fn orders(&self) -> String {
        format!("{}_JOBS", self.prefix.to_uppercase())
    }

    /// The bucket of standings.
    pub(crate) fn standings(&self) -> String {
        format!("{}-jobs", self.prefix)
    }

    /// The bucket of benches and workers.
    pub(crate) fn nodes(&self) -> String {
        format!("{}-nodes", self.prefix)
    }

    /// The bucket of a bench's journals and results.
    pub(crate) fn depot(&self, bench: &BenchName) -> String {
        format!("{}-{bench}", self.prefix)
    }

    /// Subjects of all orders.
    pub(crate) fn every_order(&self) -> String {
        format!("{}.jobs.>", self.prefix)
    }

    /// Where an order is put.
    pub(crate) fn order(&self, order: &Order) -> Result<String, QueueError> {
        let queue = Line::of(order)?;
        Ok(format!(
            "{}.{}.{}-{}",
            self.line(&queue),
            order.key.bench,
            order.key.job,
            order.turn
        ))
    }

    /// Where the order of a turn is, whatever its priority and class.
    pub(crate) fn turn(&self, key: &JobKey, turn: u32) -> String {
        format!(
            "{}.jobs.*.*.*.{}.{}-{turn}",
            self.prefix, key.bench, key.job
        )
    }

    fn line(&self, line: &Line) -> String {
        format!(
            "{}.jobs.v{}.{}.{}",
            self.prefix,
            line.format,
            line.priority.as_str(),
            line.class.token()
        )
    }

    /// Orders of a line.
    pub(crate) fn filter(&self, line: &Line) -> String {
        format!("{}.*.*", self.line(line))
    }

    /// Which job and turn a subject is of.
    pub(crate) fn parse_order(&self, subject: &str) -> Option<(JobKey, u32)> {
        let rest = subject.strip_prefix(&self.prefix)?.strip_prefix(".jobs.")?;
        let mut tokens = rest.split('.').skip(3);
        let bench = BenchName::try_from(tokens.next()?.to_owned()).ok()?;
        let (job, turn) = tokens.next()?.split_once('-')?;
        let job = job.parse().ok()?;
        Some((JobKey { bench, job }, turn.parse().ok()?))
    }

    /// Rung when there is an order.
    pub(crate) fn bell(&self) -> String {
        format!("{}.bell", self.prefix)
    }

    /// Told when a job is wanted no more.
    pub(crate) fn cancel(&self, key: &JobKey) -> String {
        format!("{}.cancel.{key}", self.prefix)
    }

    /// Told how far a job is.
    pub(crate) fn progress(&self, key: &JobKey) -> String {
        format!("{}.progress.{key}", self.prefix)
    }

    /// Told how far the jobs of a bench are.
    pub(crate) fn every_progress(&self, bench: &BenchName) -> String {
        format!("{}.progress.{bench}.*", self.prefix)
    }
}

/// Which job a key is of, in a bucket.
pub(crate) fn parse_key(text: &str) -> Option<JobKey> {
    let (bench, job) = text.split_once('.')?;
    Some(JobKey {
        bench: BenchName::try_from(bench.to_owned()).ok()?,
        job: job.parse().ok()?,
    })
}

/// Which workers can do an order: memory in powers of two, and tools.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Class {
    gib_log2: u32,
    tools: BTreeSet<String>,
}

impl Class {
    fn of(need: &Need) -> Result<Self, QueueError> {
        let mib = |gib_log2: &u32| 1024_u64 << gib_log2;
        let gib_log2 = (0..=MOST_GIB_LOG2).find(|log2| need.memory_mib <= mib(log2));
        let Some(gib_log2) = gib_log2 else {
            return Err(QueueError::Refused(format!(
                "an order that needs {} MiB of memory: ask for less",
                need.memory_mib
            )));
        };
        for tool in &need.tools {
            let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            if !(1..=MOST_TOOL_CHARS).contains(&tool.len()) || !tool.chars().all(plain) {
                return Err(QueueError::Refused(format!(
                    "tool `{tool}`: give 1 to {MOST_TOOL_CHARS} small letters, digits and `_`"
                )));
            }
        }
        let class = Self {
            gib_log2,
            tools: need.tools.clone(),
        };
        if class.token().len() > MOST_CLASS_CHARS {
            return Err(QueueError::Refused(format!(
                "an order that needs {} tools: name fewer",
                need.tools.len()
            )));
        }
        Ok(class)
    }

    fn token(&self) -> String {
        let mut token = format!("m{}", self.gib_log2);
        for tool in &self.tools {
            token.push('-');
            token.push_str(tool);
        }
        token
    }

    fn parse(token: &str) -> Option<Self> {
        let mut parts = token.split('-');
        let gib_log2 = parts.next()?.strip_prefix('m')?.parse().ok()?;
        (gib_log2 <= MOST_GIB_LOG2).then(|| Self {
            gib_log2,
            tools: parts.map(str::to_owned).collect(),
        })
    }

    /// Whether the worker can do all orders of this class; of the smallest, some at least.
    fn fits(&self, worker: &Worker) -> bool {
        let enough = worker
            .memory_mib
            .is_none_or(|most| self.gib_log2 == 0 || 1024 << self.gib_log2 <= most);
        enough && self.tools.is_subset(&worker.tools)
    }
}

/// Orders that wait behind each other: of one format, priority and class. A consumer gives them
/// out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Line {
    pub(crate) format: u32,
    pub(crate) priority: Priority,
    pub(crate) class: Class,
}

impl Line {
    pub(crate) fn of(order: &Order) -> Result<Self, QueueError> {
        Ok(Self {
            format: order.format,
            priority: order.priority,
            class: Class::of(&order.need)?,
        })
    }

    /// Name of its consumer.
    pub(crate) fn consumer(&self) -> String {
        format!(
            "v{}-{}-{}",
            self.format,
            self.priority.as_str(),
            self.class.token()
        )
    }

    /// The line whose consumer has this name.
    pub(crate) fn parse(consumer: &str) -> Option<Self> {
        let mut parts = consumer.splitn(3, '-');
        let format = parts.next()?.strip_prefix('v')?.parse().ok()?;
        let priority = parts.next()?;
        let priority = Priority::ALL.into_iter().find(|p| p.as_str() == priority)?;
        Some(Self {
            format,
            priority,
            class: Class::parse(parts.next()?)?,
        })
    }

    /// Whether the worker takes orders from it.
    pub(crate) fn fits(&self, worker: &Worker) -> bool {
        worker.formats.contains(&self.format) && self.class.fits(worker)
    }

    /// Lines in the order in which a worker looks at them: what needs most goes first, as few can
    /// do it. `lowest_first` turns priorities around.
    pub(crate) fn rank(&self, lowest_first: bool) -> (u8, std::cmp::Reverse<Class>, u32) {
        let priority = match self.priority {
            Priority::High => 0,
            Priority::Normal => 1,
            Priority::Low => 2,
        };
        (
            if lowest_first { 2 - priority } else { priority },
            std::cmp::Reverse(self.class.clone()),
            self.format,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(memory_mib: u64, tools: &[&str]) -> Order {
        Order {
            format: 1,
            key: JobKey {
                bench: BenchName::try_from("lab-1".to_owned()).unwrap(),
                job: 17,
            },
            turn: 3,
            priority: Priority::Low,
            need: Need {
                memory_mib,
                tools: tools.iter().map(|&tool| tool.to_owned()).collect(),
            },
            body: serde_json::Value::Null,
        }
    }

    #[test]
    fn subjects_and_consumers_tell_what_they_are_of() {
        let names = Names::new("relief");
        let order = order(5000, &["occt", "blender"]);
        let subject = names.order(&order).unwrap();
        assert_eq!(subject, "relief.jobs.v1.low.m3-blender-occt.lab-1.17-3");
        assert_eq!(
            names.parse_order(&subject),
            Some((order.key.clone(), order.turn))
        );
        let line = Line::of(&order).unwrap();
        assert_eq!(line.consumer(), "v1-low-m3-blender-occt");
        assert_eq!(Line::parse(&line.consumer()), Some(line.clone()));
        assert_eq!(
            names.filter(&line),
            "relief.jobs.v1.low.m3-blender-occt.*.*"
        );
        assert_eq!(parse_key(&order.key.to_string()), Some(order.key));
    }

    #[test]
    fn memory_is_rounded_up() {
        for (mib, token) in [(0, "m0"), (1024, "m0"), (1025, "m1"), (1 << 20, "m10")] {
            assert_eq!(Line::of(&order(mib, &[])).unwrap().class.token(), token);
        }
        assert!(Line::of(&order(u64::MAX, &[])).is_err());
    }

    #[test]
    fn tools_that_are_no_names_are_refused() {
        for tool in ["", "a-b", "a.b", "OCCT", "*"] {
            assert!(Line::of(&order(0, &[tool])).is_err(), "{tool}");
        }
    }

    #[test]
    fn workers_look_at_what_they_can_do() {
        let line = Line::of(&order(3000, &["occt"])).unwrap();
        let mut worker = Worker::named("w");
        assert!(!line.fits(&worker));
        worker.tools.insert("occt".to_owned());
        assert!(line.fits(&worker));
        worker.memory_mib = Some(4095);
        assert!(!line.fits(&worker));
        worker.memory_mib = Some(4096);
        assert!(line.fits(&worker));
        worker.formats = 2..=3;
        assert!(!line.fits(&worker));
    }
}
