//! Webhooks through the sandbox, whose network is closed unless it is opened.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::os::unix::fs::{PermissionsExt, chown};
use std::thread::JoinHandle;

use anyhow::{Context, Result, ensure};

use super::service::anew;
use crate::bench::{Bench, ready, relief};
use crate::system::{SERVICE, id_of, journal, try_run};

const CONFIGURATION: &str = "/etc/relief/reliefd.toml";
const SECRET: &str = "/etc/relief/lab.secret";
const PLACE: &str = "/etc/systemd/system/reliefd.service.d";

/// With the network closed the message says which drop-in opens it; with it, the receiver is told.
pub(super) fn drop_in(_: &mut Bench) -> Result<()> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let before = fs::read_to_string(CONFIGURATION)?;
    fs::write(
        SECRET,
        "whsec_MDEyMzQ1Njc4OWFiY2RlZjAxMjM0NTY3ODlhYmNkZWY=\n",
    )?;
    fs::set_permissions(SECRET, fs::Permissions::from_mode(0o600))?;
    chown(SECRET, Some(id_of("/etc/passwd", "relief")?), None)?;
    let webhook = format!(
        "\n[[webhooks]]\nname = \"lab\"\nurl = \"http://{}/told\"\nsecret_file = {SECRET:?}\n",
        listener.local_addr()?
    );
    fs::write(CONFIGURATION, before.clone() + &webhook)?;
    anew()?;
    let (well, _, said) = try_run("relief", &["webhooks", "test", "lab"])?;
    ensure!(!well && said.contains("network.conf"), "{said}");
    let told = |entry: &serde_json::Value| {
        let message = entry["MESSAGE"].as_str().unwrap_or_default();
        message.contains("network.conf")
    };
    let entries = journal(&["--unit", SERVICE])?;
    ensure!(entries.iter().any(told), "the log says nothing of it");

    fs::create_dir_all(PLACE)?;
    fs::copy("/packages/network.conf", format!("{PLACE}/network.conf"))?;
    anew()?;
    let receiver = std::thread::spawn(move || receive(&listener));
    let tested = relief(&["webhooks", "test", "lab"])?;
    ensure!(tested["state"] == "delivered", "{tested}");
    let request = joined(receiver)?;
    ensure!(request.contains("webhook-signature: v1,"), "{request}");
    ensure!(request.contains("\"type\":\"test\""), "{request}");

    fs::remove_dir_all(PLACE)?;
    fs::remove_file(SECRET)?;
    fs::write(CONFIGURATION, before)?;
    anew()?;
    ready().map(drop)
}

/// One request, which is taken; its text.
fn receive(listener: &TcpListener) -> Result<String> {
    let (stream, _) = listener.accept()?;
    let mut reader = BufReader::new(stream);
    let mut text = String::new();
    let mut length = 0;
    loop {
        let start = text.len();
        ensure!(reader.read_line(&mut text)? > 0, "it was cut off: {text}");
        let line = text[start..].trim().to_ascii_lowercase();
        if let Some(bytes) = line.strip_prefix("content-length:") {
            length = bytes.trim().parse()?;
        }
        if line.is_empty() {
            break;
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body)?;
    let mut stream = reader.into_inner();
    stream.write_all(b"HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n")?;
    Ok(text + &String::from_utf8(body)?)
}

fn joined<T>(thread: JoinHandle<Result<T>>) -> Result<T> {
    let result = thread.join().ok().context("the receiver has panicked")?;
    result.context("the receiver")
}
