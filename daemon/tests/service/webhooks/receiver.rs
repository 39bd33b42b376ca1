//! Whoever is told: a small HTTP server that answers as the test says, and checks what it gets by
//! means of its own.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Barrier, Mutex};
use std::time::Duration;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use relief_api::WebhookMessage;
use sha2::{Digest, Sha256};

/// Far longer than anything takes that should happen.
const LIMIT: Duration = Duration::from_secs(60);

/// What the receiver does with a request.
#[derive(Debug, Clone)]
pub(crate) enum Answer {
    /// This status and body.
    Status(u16, &'static str),
    /// A redirection, whose body tells where to as well.
    Elsewhere(u16, String),
    /// Nothing, with the connection kept open.
    Hang,
    /// It is taken, once the test comes there too.
    Held(Arc<Barrier>),
    /// Nothing, with the connection closed.
    Close,
    /// A status, and a body without end.
    EndlessBody(u16),
    /// A head without end.
    EndlessHead,
    /// A field of the head without end.
    EndlessField,
}

/// A request as it came.
#[derive(Debug, Clone)]
pub(crate) struct Got {
    pub(crate) request: String,
    headers: Vec<(String, String)>,
    pub(crate) body: String,
}

impl Got {
    #[track_caller]
    pub(crate) fn header(&self, name: &str) -> &str {
        let mut found = self.headers.iter().filter(|(key, _)| key == name);
        let value = &found.next().unwrap_or_else(|| panic!("no {name}")).1;
        assert!(found.next().is_none(), "{name} twice");
        value
    }

    pub(crate) fn id(&self) -> &str {
        self.header("webhook-id")
    }

    #[track_caller]
    pub(crate) fn message(&self) -> WebhookMessage {
        serde_json::from_str(&self.body).unwrap()
    }

    /// Whether it is signed with this secret.
    pub(crate) fn is_signed_with(&self, secret: &str) -> bool {
        let key = STANDARD
            .decode(secret.strip_prefix("whsec_").unwrap())
            .unwrap();
        let (id, time) = (self.id(), self.header("webhook-timestamp"));
        let signed = format!("{id}.{time}.{}", self.body);
        let expected = STANDARD.encode(hmac(&key, signed.as_bytes()));
        self.header("webhook-signature") == format!("v1,{expected}")
    }
}

/// HMAC-SHA-256 as RFC 2104 has it, for keys of no more than a block.
pub(crate) fn hmac(key: &[u8], text: &[u8]) -> Vec<u8> {
    let pad = |with: u8| -> Vec<u8> {
        let mut block = [with; 64];
        for (place, byte) in block.iter_mut().zip(key) {
            *place ^= byte;
        }
        block.to_vec()
    };
    let inner = Sha256::digest([&pad(0x36), text].concat());
    Sha256::digest([&pad(0x5C)[..], &inner].concat()).to_vec()
}

/// The answers to come; when there are no more, every message is taken.
type Script = Arc<Mutex<VecDeque<Answer>>>;

pub(crate) struct Receiver {
    pub(crate) address: SocketAddr,
    script: Script,
    got: mpsc::Receiver<Got>,
    is_over: Arc<AtomicBool>,
}

impl Drop for Receiver {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Release);
        // So that it looks.
        let _ = TcpStream::connect(self.address);
    }
}

/// Makes of a connection what is spoken on it.
pub(crate) type Wrap = Box<dyn Fn(TcpStream) -> Box<dyn Talk> + Send + Sync>;

pub(crate) trait Talk: Read + Write + Send {}
impl<T: Read + Write + Send> Talk for T {}

pub(crate) fn any_port() -> TcpListener {
    TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap()
}

impl Receiver {
    pub(crate) fn new(answers: impl IntoIterator<Item = Answer>) -> Self {
        Self::on(any_port(), answers)
    }

    pub(crate) fn on(listener: TcpListener, answers: impl IntoIterator<Item = Answer>) -> Self {
        Self::speaking(listener, answers, Box::new(|stream| Box::new(stream)))
    }

    pub(crate) fn speaking(
        listener: TcpListener,
        answers: impl IntoIterator<Item = Answer>,
        wrap: Wrap,
    ) -> Self {
        let address = listener.local_addr().unwrap();
        let script: Script = Arc::new(Mutex::new(answers.into_iter().collect()));
        let (sender, got) = mpsc::channel();
        let answers = Arc::clone(&script);
        let wrap = Arc::new(wrap);
        let is_over = Arc::new(AtomicBool::new(false));
        let over = Arc::clone(&is_over);
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                if over.load(Ordering::Acquire) {
                    return;
                }
                let (sender, answers) = (sender.clone(), Arc::clone(&answers));
                let wrap = Arc::clone(&wrap);
                std::thread::spawn(move || {
                    let Ok(stream) = stream else { return };
                    // Who closes early has been heard enough.
                    let _ = serve(wrap(stream), &answers, &sender);
                });
            }
        });
        Self {
            address,
            script,
            got,
            is_over,
        }
    }

    pub(crate) fn url(&self) -> String {
        format!("http://{}/relief", self.address)
    }

    /// What it does next.
    pub(crate) fn will(&self, answer: Answer) {
        self.script.lock().unwrap().push_back(answer);
    }

    /// The next request.
    #[track_caller]
    pub(crate) fn next(&self) -> Got {
        self.got.recv_timeout(LIMIT).expect("somebody is told")
    }

    /// Nothing more has come.
    #[track_caller]
    pub(crate) fn is_quiet(&self) {
        let got = self.got.recv_timeout(Duration::from_millis(300));
        assert!(
            matches!(got, Err(RecvTimeoutError::Timeout)),
            "{:?}",
            got.unwrap().body
        );
    }
}

fn serve(
    stream: Box<dyn Talk>,
    script: &Mutex<VecDeque<Answer>>,
    sender: &mpsc::Sender<Got>,
) -> std::io::Result<()> {
    let mut stream = BufReader::new(stream);
    let mut lines = Vec::new();
    loop {
        let mut line = String::new();
        if stream.read_line(&mut line)? == 0 {
            return Ok(());
        }
        match line.trim_end() {
            "" => break,
            line => lines.push(line.to_owned()),
        }
    }
    let mut lines = lines.into_iter();
    let request = lines.next().unwrap();
    let headers: Vec<(String, String)> = lines
        .map(|line| {
            let (key, value) = line.split_once(": ").unwrap();
            (key.to_ascii_lowercase(), value.to_owned())
        })
        .collect();
    let length = headers.iter().find(|(key, _)| key == "content-length");
    let mut body = vec![0; length.unwrap().1.parse().unwrap()];
    stream.read_exact(&mut body)?;
    let got = Got {
        request,
        headers,
        body: String::from_utf8(body).unwrap(),
    };
    let next = script.lock().unwrap().pop_front();
    let answer = next.unwrap_or(Answer::Status(204, ""));
    // Whoever hears of it may find the answer on its way.
    let _ = sender.send(got);
    let out = stream.get_mut();
    match answer {
        Answer::Status(status, body) => write!(
            out,
            "HTTP/1.1 {status} x\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        )?,
        Answer::Elsewhere(status, to) => write!(
            out,
            "HTTP/1.1 {status} x\r\nLocation: {to}\r\nContent-Length: {}\r\n\r\n{to}",
            to.len()
        )?,
        // Until the other side has had enough.
        Answer::Hang => drop(out.read(&mut [0])?),
        Answer::Held(until) => {
            until.wait();
            write!(out, "HTTP/1.1 204 x\r\n\r\n")?;
        }
        Answer::Close => {}
        Answer::EndlessBody(status) => {
            write!(out, "HTTP/1.1 {status} x\r\n\r\n")?;
            loop {
                out.write_all(&[b'a'; 4096])?;
            }
        }
        Answer::EndlessHead => {
            write!(out, "HTTP/1.1 200 x\r\n")?;
            loop {
                out.write_all(b"x: aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\r\n")?;
            }
        }
        Answer::EndlessField => {
            write!(out, "HTTP/1.1 200 x\r\nx: ")?;
            loop {
                out.write_all(&[b'a'; 4096])?;
            }
        }
    }
    out.flush()
}
