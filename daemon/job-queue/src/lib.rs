//! Where jobs wait for a worker.
//!
//! ```text
//! bench --offer--> queue --take--> worker --settle--> queue --standing--> bench
//! ```
//!
//! A bench offers what is to be made of its scans; a worker takes an order, and holds it by a
//! [`Lease`] until it settles it. Whatever the queue, a job is run at least once, and settled
//! once: of two workers that both believe to have it, the first one to settle it counts. So the
//! bench, which publishes what was settled, publishes once.

#[cfg(feature = "conformance")]
pub mod conformance;
pub mod depot;
pub mod jetstream;
mod order;
mod queue;

pub use order::{BadName, BenchName, FORMAT, JobKey, Need, OLDEST_FORMAT, Order};
pub use queue::{
    Ending, JobQueue, Lease, MOST_CUT_SHORT, Outcome, QueueError, Standing, Stop, Worker,
};
pub use relief_api::Priority;
