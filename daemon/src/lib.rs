//! The Relief service: acquisition, job queue, spool and HTTP API.
