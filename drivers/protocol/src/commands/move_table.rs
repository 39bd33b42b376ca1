//! Driving the table.

use crate::message::Request;
use crate::wire::message;

message! {
    /// Drives the table to a position.
    Move = 0x07 {
        /// Where to, counts.
        table_counts: i32,
    }
}

message! {
    /// The move has begun. It is done when the status says idle at that position.
    MoveStarted = 0x87 {}
}

impl Request for Move {
    type Reply = MoveStarted;
}
