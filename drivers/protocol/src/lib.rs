//! The wire protocol of the slide-table scanner: frames, messages and both ends' rules, without I/O.
