//! A small mail server that answers as the test says, and keeps what it takes.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use rustls::{ServerConfig, ServerConnection, StreamOwned};

use crate::webhooks::receiver::{Talk, any_port};

/// Far longer than anything takes that should happen.
const LIMIT: Duration = Duration::from_secs(60);

/// A mail as the server took it.
#[derive(Debug, Clone, Default)]
pub(super) struct Taken {
    /// Over TLS.
    pub(super) is_secure: bool,
    /// Who gave it, name and password.
    pub(super) login: Option<(String, String)>,
    pub(super) from: String,
    pub(super) to: Vec<String>,
    /// Head and body, with plain ends of lines.
    pub(super) text: String,
}

impl Taken {
    /// A field of the head.
    #[track_caller]
    pub(super) fn field(&self, name: &str) -> String {
        let (head, _) = self.text.split_once("\n\n").unwrap();
        let unfolded = head.replace("\n ", " ");
        let found = unfolded
            .lines()
            .find_map(|line| line.strip_prefix(&format!("{name}: ")));
        found
            .unwrap_or_else(|| panic!("no {name}: {head}"))
            .to_owned()
    }

    pub(super) fn body(&self) -> &str {
        self.text.split_once("\n\n").unwrap().1
    }
}

/// What the server says to `MAIL FROM` next instead of taking it.
type Script = Arc<Mutex<VecDeque<&'static str>>>;

pub(super) struct Server {
    pub(super) port: u16,
    script: Script,
    taken: mpsc::Receiver<Taken>,
}

impl Server {
    /// With a certificate it offers STARTTLS; without, it does not.
    pub(super) fn new(tls: Option<Arc<ServerConfig>>) -> Self {
        let listener: TcpListener = any_port();
        let port = listener.local_addr().unwrap().port();
        let script = Script::default();
        let (sender, taken) = mpsc::channel();
        let answers = Arc::clone(&script);
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (sender, answers, tls) = (sender.clone(), Arc::clone(&answers), tls.clone());
                std::thread::spawn(move || {
                    // Who closes early has been heard enough.
                    let _ = serve(stream, tls, &answers, &sender);
                });
            }
        });
        Self {
            port,
            script,
            taken,
        }
    }

    /// Refuses the next mail so; nothing is a beginning without end.
    pub(super) fn refuse(&self, answer: &'static str) {
        self.script.lock().unwrap().push_back(answer);
    }

    /// The next mail.
    #[track_caller]
    pub(super) fn next(&self) -> Taken {
        self.taken.recv_timeout(LIMIT).expect("a mail")
    }

    /// No further mail has come.
    #[track_caller]
    pub(super) fn is_quiet(&self) {
        let taken = self.taken.recv_timeout(Duration::from_millis(300));
        assert!(taken.is_err(), "{taken:?}");
    }
}

/// One line, read byte by byte: what follows may be meant for TLS.
fn line(stream: &mut dyn Talk) -> io::Result<String> {
    let mut bytes = Vec::new();
    let mut byte = [0];
    loop {
        if stream.read(&mut byte)? == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        match byte[0] {
            b'\n' => return Ok(String::from_utf8(bytes).unwrap()),
            b'\r' => {}
            byte => bytes.push(byte),
        }
    }
}

fn login(encoded: &str) -> (String, String) {
    let bytes = STANDARD.decode(encoded).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let mut parts = text.split('\0').skip(1);
    let mut part = || parts.next().unwrap().to_owned();
    (part(), part())
}

fn serve(
    stream: TcpStream,
    tls: Option<Arc<ServerConfig>>,
    script: &Mutex<VecDeque<&'static str>>,
    sender: &mpsc::Sender<Taken>,
) -> io::Result<()> {
    let plain = stream.try_clone()?;
    let mut stream: Box<dyn Talk> = Box::new(stream);
    let mut mail = Taken::default();
    write!(stream, "220 here\r\n")?;
    loop {
        let asked = line(&mut *stream)?;
        let (verb, rest) = asked.split_once(' ').unwrap_or((&asked, ""));
        let answer = match verb.to_ascii_uppercase().as_str() {
            "EHLO" if mail.is_secure || tls.is_none() => "250-here\r\n250 AUTH PLAIN",
            "EHLO" => "250-here\r\n250 STARTTLS",
            "STARTTLS" => {
                write!(stream, "220 go on\r\n")?;
                let config = tls.clone().unwrap();
                let connection = ServerConnection::new(config).map_err(io::Error::other)?;
                stream = Box::new(StreamOwned::new(connection, plain.try_clone()?));
                mail.is_secure = true;
                continue;
            }
            "AUTH" => {
                let given = login(rest.strip_prefix("PLAIN ").unwrap());
                let is_right = given.1 == super::PASSWORD;
                mail.login = Some(given);
                match is_right {
                    true => "235 welcome",
                    false => "535 who are you?",
                }
            }
            "MAIL" => {
                // The lock is given back before anything goes on for long.
                let refusal = script.lock().unwrap().pop_front();
                match refusal {
                    // No end of lines of one answer.
                    Some("") => loop {
                        write!(stream, "250-wait\r\n")?;
                        stream.flush()?;
                        std::thread::sleep(Duration::from_millis(20));
                    },
                    Some(refusal) => refusal,
                    None => {
                        mail.from = rest.to_owned();
                        "250 ok"
                    }
                }
            }
            "RCPT" => {
                mail.to.push(rest.to_owned());
                "250 ok"
            }
            "DATA" => {
                write!(stream, "354 go on\r\n")?;
                loop {
                    let next = line(&mut *stream)?;
                    match next.as_str() {
                        "." => break,
                        next => {
                            mail.text += &format!("{}\n", next.strip_prefix('.').unwrap_or(next))
                        }
                    }
                }
                let _ = sender.send(mail.clone());
                "250 taken"
            }
            "QUIT" => {
                write!(stream, "221 bye\r\n")?;
                return stream.flush();
            }
            _ => "250 ok",
        };
        write!(stream, "{answer}\r\n")?;
        stream.flush()?;
    }
}
