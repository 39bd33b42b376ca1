//! One closed solid of a block with outlines cut into it and raised on it.
