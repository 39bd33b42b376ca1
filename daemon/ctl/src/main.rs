//! The command line of Relief: demo, convert, and the clients of the service.

mod cli;
mod command;
mod failure;
mod follow;
mod input;
mod output;
mod progress;
mod raw_scan;
mod service;
mod summary;

use std::process::ExitCode;

fn main() -> ExitCode {
    let invocation = match cli::parse() {
        Ok(invocation) => invocation,
        Err(exit) => return exit,
    };
    match command::run(invocation) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.tell(),
    }
}
