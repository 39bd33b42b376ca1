//! A broker that is not ours, Debian's mosquitto, and its client that listens.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, DnType, IsCa, KeyPair};
use rustix::process::{Pid, Signal, kill_process};

use crate::webhooks::receiver::any_port;

/// Far longer than anything takes that should happen.
const LIMIT: Duration = Duration::from_secs(60);

pub(super) const USER: &str = "relief";
pub(super) const PASSWORD: &str = "hunter2 ";

/// Debian keeps the broker out of the path of those who are not root.
fn found(program: &str) -> Option<PathBuf> {
    let path = std::env::var("PATH").unwrap_or_default();
    let mut folders = path.split(':').chain(["/usr/sbin"]);
    folders.find_map(|folder| {
        let file = Path::new(folder).join(program);
        file.is_file().then_some(file)
    })
}

/// A broker's folder, port and certificates; the broker itself comes and goes.
pub(super) struct Broker {
    folder: tempfile::TempDir,
    pub(super) port: u16,
    program: PathBuf,
    child: Option<Child>,
}

impl Drop for Broker {
    fn drop(&mut self) {
        self.stop();
    }
}

impl Broker {
    /// None where there is no mosquitto, which is said, unless there has to be one.
    pub(super) fn new() -> Option<Self> {
        let programs = ["mosquitto", "mosquitto_passwd", "mosquitto_sub"].map(found);
        let [Some(program), Some(passwords), Some(_)] = programs else {
            assert!(
                std::env::var_os("RELIEF_NEEDS_BROKER").is_none(),
                "mosquitto or mosquitto-clients is missing"
            );
            println!("skipped: no mosquitto");
            return None;
        };
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        let made = Command::new(passwords)
            .args(["-b", "-c"])
            .arg(place("passwords"))
            .args([USER, PASSWORD])
            .status();
        assert!(made.unwrap().success());
        let mut params = CertificateParams::new([]).unwrap();
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        // Or OpenSSL takes the broker's for signed by itself.
        params.distinguished_name.push(DnType::CommonName, "lab");
        let lab = CertifiedIssuer::self_signed(params, KeyPair::generate().unwrap()).unwrap();
        let key = KeyPair::generate().unwrap();
        let params = CertificateParams::new(["localhost".to_owned()]).unwrap();
        let certificate = params.signed_by(&key, &lab).unwrap();
        fs::write(place("ca.pem"), lab.pem()).unwrap();
        fs::write(place("broker.pem"), certificate.pem()).unwrap();
        fs::write(place("broker.key"), key.serialize_pem()).unwrap();
        // Whoever else is given it meanwhile has the test fail, and nothing else.
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let port = listener.local_addr().unwrap().port();
        let shown = |name: &str| place(name).display().to_string();
        // Run by root, it would become a user who may not read the folder.
        let text = format!(
            "user root\nallow_anonymous false\npassword_file {}\npersistence true\n\
             persistence_location {}/\nlistener {port} 127.0.0.1\ncafile {}\ncertfile {}\n\
             keyfile {}\n",
            shown("passwords"),
            folder.path().display(),
            shown("ca.pem"),
            shown("broker.pem"),
            shown("broker.key"),
        );
        fs::write(place("mosquitto.conf"), text).unwrap();
        Some(Self {
            folder,
            port,
            program,
            child: None,
        })
    }

    pub(super) fn ca_file(&self) -> PathBuf {
        self.folder.path().join("ca.pem")
    }

    pub(super) fn url(&self) -> String {
        format!("mqtts://localhost:{}", self.port)
    }

    /// Starts it, and waits until it listens.
    pub(super) fn start(&mut self) {
        let child = Command::new(&self.program)
            .arg("-c")
            .arg(self.folder.path().join("mosquitto.conf"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        self.child = Some(child.unwrap());
        let begun = Instant::now();
        while TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).is_err() {
            assert!(begun.elapsed() < LIMIT, "mosquitto does not listen");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Stops it in good order: it keeps what is retained, and sessions.
    pub(super) fn stop(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = kill_process(Pid::from_child(&child), Signal::TERM);
            child.wait().unwrap();
        }
    }

    /// The program that listens, to everything.
    fn listening(&self, more: &[&str]) -> Command {
        let mut command = Command::new("mosquitto_sub");
        command
            .args(["-h", "localhost", "-p", &self.port.to_string()])
            .args(["-u", USER, "-P", PASSWORD, "--cafile"])
            .arg(self.ca_file())
            .args(["-q", "1", "-t", "#", "-F", "%r %t %p"])
            .args(more)
            .stderr(Stdio::null());
        command
    }

    /// Has the broker keep what comes for a listener who is away.
    pub(super) fn subscribe(&self, listener: &str) {
        let status = self.listening(&["-c", "-i", listener, "-E"]).status();
        assert!(status.unwrap().success());
    }

    /// Listens, as somebody whom the broker knows already or not.
    pub(super) fn listen(&self, listener: Option<&str>) -> Listener {
        let known: Vec<&str> = match listener {
            Some(listener) => vec!["-c", "-i", listener],
            None => Vec::new(),
        };
        let mut child = self
            .listening(&known)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let (sender, heard) = mpsc::channel();
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        Listener { child, heard }
    }
}

/// What stands for a broker that lets everybody in, and then acknowledges nothing. Gives its port,
/// and what it is sent.
pub(super) fn mute() -> (u16, mpsc::Receiver<Vec<u8>>) {
    let listener = any_port();
    let port = listener.local_addr().unwrap().port();
    let (sender, sent) = mpsc::channel();
    std::thread::spawn(move || {
        for mut stream in listener.incoming().flatten() {
            let mut bytes = [0; 4096];
            if stream.read(&mut bytes).is_err() || stream.write_all(&[0x20, 2, 0, 0]).is_err() {
                continue;
            }
            while let Ok(count @ 1..) = stream.read(&mut bytes) {
                if sender.send(bytes[..count].to_vec()).is_err() {
                    return;
                }
            }
        }
    });
    (port, sent)
}

/// Somebody who listens to everything.
pub(super) struct Listener {
    child: Child,
    heard: mpsc::Receiver<String>,
}

impl Drop for Listener {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What somebody heard.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Heard {
    /// The broker had kept it.
    pub(super) retained: bool,
    pub(super) topic: String,
    pub(super) payload: String,
}

impl Listener {
    fn next_within(&self, longest: Duration) -> Result<Heard, RecvTimeoutError> {
        let line = self.heard.recv_timeout(longest)?;
        let mut parts = line.splitn(3, ' ');
        let mut part = || parts.next().unwrap_or_default().to_owned();
        Ok(Heard {
            retained: part() == "1",
            topic: part(),
            payload: part(),
        })
    }

    /// The next of those on a topic that ends so.
    #[track_caller]
    pub(super) fn on(&self, topic: &str) -> Heard {
        let until = Instant::now() + LIMIT;
        loop {
            let longest = until.saturating_duration_since(Instant::now());
            let heard = self.next_within(longest);
            let heard = heard.unwrap_or_else(|_| panic!("nothing on {topic}"));
            if heard.topic.ends_with(topic) {
                return heard;
            }
        }
    }

    /// The next that has this to say on a topic that ends so.
    #[track_caller]
    pub(super) fn until(&self, topic: &str, wanted: impl Fn(&str) -> bool) -> Heard {
        loop {
            let heard = self.on(topic);
            if wanted(&heard.payload) {
                return heard;
            }
        }
    }
}
