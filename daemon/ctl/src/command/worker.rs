//! `relief worker`.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::Duration;

use job_queue::BenchName;
use reliefd::config::{LogConfig, LogFormat, NatsConfig};
use reliefd::{BareWorker, WorkerOptions, logging};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::failure::Failure;
use crate::output;

/// Work on jobs of benches elsewhere, by way of a NATS server
///
/// Takes job after job until it is ended; what it is at then is given back, and another worker goes
/// on. It keeps nothing, and needs no configuration: columns and results go by way of the server.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// A NATS server with JetStream, as nats://HOST:4222 or tls://HOST:4222; several of one cluster
    /// may be given
    #[arg(long, value_name = "URL", required = true, num_args = 1..)]
    connect: Vec<String>,
    /// What it is called; the machine's name if not given
    #[arg(long, value_name = "NAME", value_parser = name)]
    name: Option<BenchName>,
    /// Jobs at a time
    #[arg(long, value_name = "N", default_value_t = 1)]
    jobs: usize,
    /// Threads of each job; 0 for the machine's cores, shared by the jobs
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Most memory of a job, in MiB; three quarters of the machine's, shared by the jobs, if not
    /// given
    #[arg(long, value_name = "MIB")]
    memory_mib: Option<u64>,
    /// Something that is installed here and that jobs may ask for; may be given several times
    #[arg(long = "tool", value_name = "NAME")]
    tools: Vec<String>,
    /// File with a token for the server
    #[arg(long, value_name = "FILE", conflicts_with_all = ["nkey_file", "credentials_file"])]
    token_file: Option<PathBuf>,
    /// File with the seed of an nkey for the server
    #[arg(long, value_name = "FILE", conflicts_with = "credentials_file")]
    nkey_file: Option<PathBuf>,
    /// File with the credentials of a user (.creds): a JWT and the seed of its nkey
    #[arg(long, value_name = "FILE")]
    credentials_file: Option<PathBuf>,
    /// File with a certificate (PEM) by which the server knows this worker, for tls://
    #[arg(long, value_name = "FILE", requires = "key_file")]
    certificate_file: Option<PathBuf>,
    /// File with the key (PEM) of that certificate
    #[arg(long, value_name = "FILE", requires = "certificate_file")]
    key_file: Option<PathBuf>,
    /// File with the certificates of the authorities that are trusted; without it, those that the
    /// machine trusts
    #[arg(long, value_name = "FILE")]
    ca_file: Option<PathBuf>,
    /// What the names of streams and buckets begin with, if not as usual
    #[arg(long, value_name = "PREFIX", default_value = "relief")]
    prefix: String,
    /// JetStream domain of the servers that keep everything, if they are reached by a leaf node
    #[arg(long, value_name = "NAME")]
    domain: Option<String>,
    /// How long a worker may be silent before another one gets its job, as the benches have it
    #[arg(long, value_name = "S", default_value_t = 30)]
    silence_s: u32,
    /// Folder for what is worked on
    #[arg(long, value_name = "DIR")]
    work_dir: Option<PathBuf>,
    /// End when there was nothing to do for so long, as where machines are paid by the hour
    #[arg(long, value_name = "S")]
    idle_s: Option<u64>,
    /// What is logged: a level, or a filter such as info,reliefd=debug
    #[arg(long, value_name = "LEVEL", default_value = "info")]
    log: String,
}

fn name(text: &str) -> Result<BenchName, String> {
    BenchName::try_from(text.to_owned()).map_err(|error| error.to_string())
}

pub(crate) fn run(args: Args, json: bool) -> Result<(), Failure> {
    let nats = NatsConfig {
        servers: args.connect,
        bench: args.name,
        token_file: args.token_file,
        nkey_file: args.nkey_file,
        credentials_file: args.credentials_file,
        certificate_file: args.certificate_file,
        key_file: args.key_file,
        ca_file: args.ca_file,
        prefix: args.prefix,
        domain: args.domain,
        silence_s: args.silence_s,
        tools: BTreeSet::from_iter(args.tools),
        memory_mib: args.memory_mib,
        ..NatsConfig::default()
    };
    nats.check().map_err(Failure::Usage)?;
    if args.jobs == 0 {
        return Err(Failure::Usage("--jobs is to be 1 or more".into()));
    }
    let log = LogConfig {
        level: args.log,
        format: LogFormat::Auto,
    };
    logging::init(&log).map_err(|error| Failure::at("cannot log", &error))?;
    let options = WorkerOptions {
        nats,
        workers: args.jobs,
        threads: args.threads,
        folder: args.work_dir.unwrap_or_else(std::env::temp_dir),
        idle: args.idle_s.map(Duration::from_secs),
    };
    let worker = BareWorker::default();
    let mut signals = Signals::new([SIGINT, SIGTERM])
        .map_err(|error| Failure::at("cannot hear signals", &error))?;
    let asked = worker.clone();
    std::thread::spawn(move || {
        if signals.forever().next().is_some() {
            asked.stop();
        }
    });
    let jobs = worker
        .run(&options)
        .map_err(|error| Failure::Failed(error.to_string()))?;
    output::either(json, &serde_json::json!({ "jobs": jobs }), |_| {
        let noun = if jobs == 1 { "job" } else { "jobs" };
        format!("{jobs} {noun} taken")
    })
}
