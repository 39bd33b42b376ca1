//! Requests over HTTP, to a whole service whose scanner is not there. It has a scan with a job
//! and a result, so that requests get past "there is no such scan".

use std::sync::{Arc, LazyLock};
use std::time::Duration;

use relief_api::{CreateToken, path};
use reliefd::{Config, Daemon};
use scan_record::{EndCause, JournalReader, JournalWriter};
use scanner_driver::protocol::{Identity, ScanPlan};
use scanner_driver::{DeviceStatus, ScanStream, Scanner, ScannerError};
use serde_json::json;
use tempfile::TempDir;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpStream, UnixStream};
use tokio::runtime::Runtime;
use tokio::signal::unix::{SignalKind, signal};

/// What must never be told.
const SECRET: &str = "the-secret-beside-the-spool";
/// The scan, as short as one can be: whatever is done with it is soon done.
const SCAN: &str = "20261121T110830.123Z-a";
const JOURNAL: &[u8] = include_bytes!("../seeds/journal/cartesian");
/// A reply that has begun comes without pauses as long as this.
const PAUSE: Duration = Duration::from_millis(20);
/// After a whole reply nothing comes but what answers a second request.
const SHORT_PAUSE: Duration = Duration::from_millis(2);
/// No reply takes as long, unless it hangs.
const GUARD: Duration = Duration::from_secs(20);

struct Absent;

impl Scanner for Absent {
    fn identify(&self) -> Result<Identity, ScannerError> {
        Err(ScannerError::Closed)
    }
    fn home(&self) -> Result<(), ScannerError> {
        Err(ScannerError::Closed)
    }
    fn status(&self) -> Result<DeviceStatus, ScannerError> {
        Err(ScannerError::Closed)
    }
    fn start_scan(&self, _plan: &ScanPlan) -> Result<ScanStream, ScannerError> {
        Err(ScannerError::Closed)
    }
    fn abort(&self) -> Result<(), ScannerError> {
        Err(ScannerError::Closed)
    }
}

struct Service {
    runtime: Runtime,
    daemon: Daemon,
    token: String,
    _folder: TempDir,
}

static SERVICE: LazyLock<Service> = LazyLock::new(|| match start() {
    Ok(service) => service,
    Err(error) => panic!("{error}"),
});

fn start() -> Result<Service, Box<dyn std::error::Error>> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()?;
    let folder = tempfile::tempdir()?;
    let mut config = Config::default();
    config.service.socket = folder.path().join("s");
    config.service.listen = Some(([127, 0, 0, 1], 0).into());
    config.service.state_dir = folder.path().join("state");
    config.service.spool_dir = folder.path().join("spool");
    config.http.request_timeout_ms = 2_000;
    std::fs::create_dir_all(folder.path().join("state/scans"))?;
    let journal = folder.path().join(format!("state/scans/{SCAN}.scan"));
    std::fs::write(journal, kept()?)?;
    std::fs::create_dir_all(folder.path().join("spool/r"))?;
    std::fs::write(folder.path().join("spool/r/range.png"), "a picture")?;
    std::fs::write(folder.path().join("secret"), SECRET)?;
    std::os::unix::fs::symlink("../../secret", folder.path().join("spool/r/link"))?;
    // A Rust program's main ignores it, the fuzzer's does not. What is set here stays.
    drop(runtime.block_on(async { signal(SignalKind::pipe()) })?);
    let daemon = runtime.block_on(Daemon::start_with(config, Arc::new(Absent)))?;
    let body = serde_json::to_string(&CreateToken {
        name: "fuzz".into(),
    })?;
    let request = format!(
        "POST {} HTTP/1.0\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
        path::TOKENS,
        body.len()
    );
    let reply = runtime.block_on(async {
        let stream = UnixStream::connect(daemon.socket()).await?;
        ask(stream, request.as_bytes(), GUARD).await
    })?;
    let reply = String::from_utf8_lossy(&reply).into_owned();
    let token = reply.split('"').find(|word| word.starts_with("relief_"));
    let token = token.ok_or("no token")?.to_owned();
    Ok(Service {
        runtime,
        daemon,
        token,
        _folder: folder,
    })
}

/// The scan's journal, which tells the service of the scan.
fn kept() -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let mut whole = JournalReader::new(JOURNAL)?;
    let mut header = whole.header().clone();
    header.settings = serde_json::to_vec(&Config::default().processing())?;
    header.metadata = serde_json::to_vec(&json!({
        "id": SCAN,
        "name": "a",
        "part": "",
        "operator": "",
        "note": "",
        "state": "scanning",
        "started_at": "2026-11-21T11:08:30.123Z",
        "columns_planned": 4,
        "columns": 0,
        "settings": {},
        "jobs": [],
    }))?;
    let mut journal = JournalWriter::new(Vec::new(), &header)?;
    while let Some(column) = whole.next_column()? {
        journal.append(&column)?;
    }
    Ok(journal.finish(&EndCause::Complete)?)
}

/// A request as raw bytes: to the socket, or to the loopback address with `TOKEN` in it
/// replaced by one that holds.
pub fn http(data: &[u8]) {
    let text = reply(data);
    assert!(!text.contains(SECRET), "{text}");
    if let Some(line) = text.lines().next() {
        assert!(line.starts_with("HTTP/1."), "{line}");
        assert!(!line.contains(" 500 "), "{text}");
    }
}

/// What the service says to such a request, head and all.
///
/// # Panics
/// When it does not come to an end.
#[must_use]
pub fn reply(data: &[u8]) -> String {
    let Some((way, request)) = data.split_first() else {
        return String::new();
    };
    let service = &*SERVICE;
    let replies = service.runtime.block_on(async {
        let asked = async {
            if way % 2 == 0 {
                let stream = UnixStream::connect(service.daemon.socket()).await?;
                ask(stream, request, PAUSE).await
            } else {
                let address = service
                    .daemon
                    .listen()
                    .ok_or(std::io::ErrorKind::NotFound)?;
                let stream = TcpStream::connect(address).await?;
                ask(stream, &with_token(request, &service.token), PAUSE).await
            }
        };
        tokio::time::timeout(GUARD, asked).await
    });
    let reply = match replies {
        Ok(Ok(reply)) => reply,
        Ok(Err(error)) => panic!("the service does not answer: {error}"),
        Err(_) => panic!("the service hangs"),
    };
    String::from_utf8_lossy(&reply).into_owned()
}

fn with_token(request: &[u8], token: &str) -> Vec<u8> {
    const MARK: &[u8] = b"TOKEN";
    match request.windows(MARK.len()).position(|w| w == MARK) {
        Some(at) => [
            &request[..at],
            token.as_bytes(),
            &request[at + MARK.len()..],
        ]
        .concat(),
        None => request.to_vec(),
    }
}

/// Sends all, reads what comes back, and when that pauses says that nothing more comes.
async fn ask<S>(mut stream: S, request: &[u8], pause: Duration) -> std::io::Result<Vec<u8>>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    // A service that refuses early closes before it has read everything.
    let _ = stream.write_all(request).await;
    let mut reply = Vec::new();
    let mut piece = [0; 4096];
    let mut over = false;
    loop {
        let next = async {
            if over {
                return Some(stream.read(&mut piece).await);
            }
            let pause = if is_whole(&reply) { SHORT_PAUSE } else { pause };
            tokio::time::timeout(pause, stream.read(&mut piece))
                .await
                .ok()
        };
        match next.await {
            // A reset is an end as well.
            Some(Ok(0) | Err(_)) => return Ok(reply),
            Some(Ok(read)) => reply.extend_from_slice(piece.get(..read).unwrap_or_default()),
            // Events end with the service or when nobody is there. What has been sent behind the
            // request may hide from the service that nothing more comes.
            None if is_events(&reply) => return Ok(reply),
            None => {
                over = true;
                let _ = stream.shutdown().await;
            }
        }
    }
}

fn is_events(reply: &[u8]) -> bool {
    const KIND: &[u8] = b"text/event-stream";
    reply.windows(KIND.len()).any(|w| w == KIND)
}

/// Whether a reply has come as long as its head says.
fn is_whole(reply: &[u8]) -> bool {
    const END: &[u8] = b"\r\n\r\n";
    let Some(head) = reply.windows(END.len()).position(|w| w == END) else {
        return false;
    };
    let text = String::from_utf8_lossy(reply.get(..head).unwrap_or_default()).to_lowercase();
    let length = text
        .lines()
        .find_map(|line| line.strip_prefix("content-length:")?.trim().parse().ok());
    length.is_some_and(|length: usize| reply.len() >= head + END.len() + length)
}
