//! The driver of the slide-table scanner: session, retries, column stream, transports.
