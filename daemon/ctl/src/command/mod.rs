//! The commands, one small file each.

pub(crate) mod abort;
pub(crate) mod accept;
pub(crate) mod calibrate;
pub(crate) mod change;
pub(crate) mod compare;
pub(crate) mod config;
pub(crate) mod convert;
pub(crate) mod demo;
pub(crate) mod discover;
pub(crate) mod doctor;
pub(crate) mod features;
pub(crate) mod fetch;
pub(crate) mod fill;
mod fill_image;
pub(crate) mod fleet;
mod grid;
pub(crate) mod hooks;
pub(crate) mod jobs;
pub(crate) mod laser;
pub(crate) mod manual;
pub(crate) mod named;
mod pages;
mod part;
pub(crate) mod pause;
mod places;
mod priority;
mod regularize;
pub(crate) mod rerun;
pub(crate) mod resume;
mod runs;
pub(crate) mod scan;
pub(crate) mod scans;
mod setting;
mod shown;
pub(crate) mod skin;
pub(crate) mod status;
pub(crate) mod surface;
mod timestamp;
pub(crate) mod token;
pub(crate) mod toolpath;
mod units;
pub(crate) mod uploads;
pub(crate) mod watch;
pub(crate) mod webhooks;
pub(crate) mod worker;

use std::future::Future;

use crate::cli::{Command, Invocation};
use crate::failure::Failure;

/// Runs what the user asked for.
pub(crate) fn run(invocation: Invocation) -> Result<(), Failure> {
    let json = invocation.json;
    match invocation.command {
        Command::Demo(args) => block_on(demo::run(args, json)),
        Command::Accept(args) => block_on(accept::run(args, json)),
        Command::Calibrate(args) => block_on(calibrate::run(args, json)),
        Command::Compare(args) => block_on(compare::run(args, json)),
        Command::Features(args) => block_on(features::run(args, json)),
        Command::Fill(args) => block_on(fill::run(args, json)),
        Command::Toolpath(args) => block_on(toolpath::run(args, json)),
        Command::Convert(args) => block_on(convert::run(args, json)),
        Command::Skin(args) => block_on(skin::run(args, json)),
        Command::Scan(args) => block_on(scan::run(args, json)),
        Command::Abort(args) => block_on(abort::run(args, json)),
        Command::Pause(args) => block_on(pause::run(args, json)),
        Command::Resume(args) => block_on(resume::run(args, json)),
        Command::Status(args) => block_on(status::run(args, json)),
        Command::Scans(args) => block_on(scans::run(args, json)),
        Command::Jobs(args) => block_on(jobs::run(args, json)),
        Command::Retry(args) => block_on(change::retry(args, json)),
        Command::Cancel(args) => block_on(change::cancel(args, json)),
        Command::Rerun(args) => block_on(rerun::run(args, json)),
        Command::Surface(args) => block_on(surface::run(args, json)),
        Command::Watch(args) => block_on(watch::run(args, json)),
        Command::Discover(args) => block_on(discover::run(args, json)),
        Command::Doctor(args) => block_on(doctor::run(args, json)),
        Command::Fetch(args) => block_on(fetch::run(args, json)),
        Command::Laser(args) => block_on(laser::run(args, json)),
        Command::Token(args) => block_on(token::run(args, json)),
        Command::Webhooks(args) => block_on(webhooks::run(args, json)),
        Command::Hooks(args) => block_on(hooks::run(args, json)),
        Command::Uploads(args) => block_on(uploads::run(args, json)),
        Command::Fleet(args) => block_on(fleet::run(args, json)),
        Command::Worker(args) => worker::run(args, json),
        Command::Config(args) => config::run(args, json),
        Command::Manual(args) => manual::run(&args, json),
    }
}

/// Runs a client; one thread is plenty for it.
fn block_on(work: impl Future<Output = Result<(), Failure>>) -> Result<(), Failure> {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|error| Failure::at("cannot start the runtime", &error))?
        .block_on(work)
}
