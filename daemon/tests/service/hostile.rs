//! Clients that are wrong, slow, too many, or after what is not theirs: raw bytes, over the
//! socket and over TCP.

use std::time::Duration;

use relief_api::{CreateToken, NewToken, Problem, Status, path};
use reliefd::config::HttpConfig;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpStream, UnixStream};

use crate::rig::Rig;

/// Nothing here takes as long, unless it hangs.
const GUARD: Duration = Duration::from_secs(60);

trait Stream: AsyncRead + AsyncWrite + Unpin + Send {}
impl<S: AsyncRead + AsyncWrite + Unpin + Send> Stream for S {}

#[derive(Clone, Copy)]
enum Way {
    Socket,
    Loopback,
}

const BOTH: [Way; 2] = [Way::Socket, Way::Loopback];

/// A service that is offered in both ways, and what to put into a head on each.
struct Doors {
    rig: Rig,
    token: String,
}

impl Doors {
    async fn open(limits: HttpConfig) -> Self {
        let rig = Rig::start(tempfile::tempdir().unwrap(), |config| {
            config.service.listen = Some("127.0.0.1:0".parse().unwrap());
            config.http = limits;
        })
        .await;
        let request = CreateToken { name: "t".into() };
        let token: NewToken = rig.client.post(path::TOKENS, &request).await;
        Self {
            rig,
            token: token.token,
        }
    }

    async fn connect(&self, way: Way) -> Box<dyn Stream> {
        match way {
            Way::Socket => {
                let stream = UnixStream::connect(self.rig.daemon.socket()).await;
                Box::new(stream.unwrap())
            }
            Way::Loopback => {
                let stream = TcpStream::connect(self.rig.daemon.listen().unwrap()).await;
                Box::new(stream.unwrap())
            }
        }
    }

    /// Header fields that let a request in.
    fn fields(&self) -> String {
        format!(
            "Host: localhost\r\nAuthorization: Bearer {}\r\n",
            self.token
        )
    }

    /// Both ways are as good as ever.
    async fn check(&self) {
        for way in BOTH {
            let stream = self.connect(way).await;
            let request = format!("GET {} HTTP/1.0\r\n{}\r\n", path::STATUS, self.fields());
            let reply = told(stream, request.as_bytes()).await;
            assert!(reply.starts_with(b"HTTP/1.0 200"), "{}", text(&reply));
        }
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Sends bytes as they are, and gives all that comes back until the service closes.
async fn told<S: Stream>(mut stream: S, bytes: &[u8]) -> Vec<u8> {
    // What is refused early is not read to its end.
    let _ = stream.write_all(bytes).await;
    rest(stream).await
}

async fn rest<S: Stream>(mut stream: S) -> Vec<u8> {
    let mut reply = Vec::new();
    let read = stream.read_to_end(&mut reply);
    // A reset is an end as well.
    let _ = tokio::time::timeout(GUARD, read)
        .await
        .expect("the service closes");
    reply
}

fn problem(reply: &[u8]) -> Problem {
    let split = reply.windows(4).position(|w| w == b"\r\n\r\n");
    let split = split.unwrap_or_else(|| panic!("no reply: {}", text(reply)));
    serde_json::from_slice(&reply[split + 4..])
        .unwrap_or_else(|error| panic!("{error}: {}", text(reply)))
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_no_sound_request_is_refused_and_the_service_goes_on() {
    let doors = Doors::open(HttpConfig::default()).await;
    let fields = doors.fields();
    let many: String = (0..100).map(|n| format!("X-{n}: 1\r\n")).collect();
    let long = "x".repeat(20_000);
    let length = |length: &str| {
        format!(
            "POST /v1/scans HTTP/1.1\r\n{fields}Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n"
        )
    };
    for (request, status) in [
        ("\0\u{1}\u{2} nonsense\r\n\r\n".to_owned(), "400"),
        ("GET\r\n\r\n".into(), "400"),
        (format!("GET / HTTP/9.9\r\n{fields}\r\n"), "400"),
        (format!("GET /{long} HTTP/1.1\r\n{fields}\r\n"), "431"),
        (
            format!("GET / HTTP/1.1\r\n{fields}X: {long}\r\n\r\n"),
            "431",
        ),
        (format!("GET / HTTP/1.1\r\n{fields}{many}\r\n"), "431"),
        (format!("GET / HTTP/1.1\r\n{fields}X: a\0b\r\n\r\n"), "400"),
        (format!("GET / HTTP/1.1\r\n{fields} folded\r\n\r\n"), "400"),
        (length("-1"), "400"),
        (length("18446744073709551616"), "400"),
        (length("1\r\nContent-Length: 2"), "400"),
        // Announced alone, this is refused before a byte of it is taken.
        (length("9223372036854775807"), "413"),
        (
            format!(
                "POST /v1/scans HTTP/1.1\r\n{fields}Transfer-Encoding: chunked\r\n\r\nffffffffffffffffff\r\n"
            ),
            "400",
        ),
        (
            format!("POST /v1/scans HTTP/1.1\r\n{fields}Transfer-Encoding: chunked\r\n\r\nzz\r\n"),
            "400",
        ),
    ] {
        for way in BOTH {
            let stream = doors.connect(way).await;
            let reply = told(stream, request.as_bytes()).await;
            let head = text(&reply);
            let shown: String = request.chars().take(120).collect();
            assert!(head.split(' ').nth(1) == Some(status), "{shown:?}: {head}");
        }
    }
    // JSON nested without end, as deep as a body may be.
    for body in ["[".repeat(200_000), r#"{"settings":"#.repeat(20_000)] {
        let request = format!(
            "POST /v1/scans HTTP/1.0\r\n{fields}Content-Type: application/json\r\n\
             Content-Length: {}\r\n\r\n{body}",
            body.len()
        );
        for way in BOTH {
            let stream = doors.connect(way).await;
            let problem = problem(&told(stream, request.as_bytes()).await);
            assert_eq!((problem.status, problem.kind.as_str()), (400, "wrong-body"));
            assert!(problem.detail.len() < 1_100, "{problem:.1000}");
        }
    }
    // A body without an announced length is cut off at the limit.
    let chunk = format!("8000\r\n{}\r\n", "x".repeat(0x8000)).repeat(9);
    let request = format!(
        "POST /v1/scans HTTP/1.0\r\n{fields}Content-Type: application/json\r\n\
         Transfer-Encoding: chunked\r\n\r\n{chunk}0\r\n\r\n"
    )
    .replace("HTTP/1.0", "HTTP/1.1");
    for way in BOTH {
        let stream = doors.connect(way).await;
        let problem = problem(&told(stream, request.as_bytes()).await);
        assert_eq!((problem.status, problem.kind.as_str()), (413, "wrong-body"));
        assert!(problem.detail.contains("262144 bytes"), "{problem}");
    }
    doors.check().await;
    doors.rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn names_in_paths_do_not_leave_the_spool() {
    let doors = Doors::open(HttpConfig::default()).await;
    let (_, job) = doors.rig.scan_to_result("a").await;
    let result = &job.result;
    let folder = doors.rig.folder.path();
    std::fs::write(folder.join("secret"), "the secret").unwrap();
    let spool = doors.rig.daemon.spool_dir();
    std::os::unix::fs::symlink(folder.join("secret"), spool.join(result).join("link")).unwrap();
    std::os::unix::fs::symlink(folder, spool.join("out")).unwrap();
    std::fs::create_dir(spool.join(".incoming-x")).unwrap();
    std::fs::write(spool.join(".incoming-x/half"), "the secret").unwrap();
    let fields = doors.fields();
    for target in [
        "/v1/spool/../secret",
        "/v1/spool/..%2fsecret",
        "/v1/spool/%2e%2e/secret",
        "/v1/spool/%2E%2E%2Fsecret/x",
        "/v1/spool/out/secret",
        "/v1/spool/out",
        "/v1/spool/RESULT/link",
        "/v1/spool/RESULT/..%2f..%2fsecret",
        "/v1/spool/RESULT/../../secret",
        "/v1/spool/RESULT/%2fetc%2fpasswd",
        "/v1/spool//etc/passwd",
        "/v1/spool/RESULT/%00",
        "/v1/spool/RESULT/manifest.json%00.png",
        "/v1/spool/RESULT%00/manifest.json",
        "/v1/spool/.incoming-x/half",
        "/v1/spool/.incoming-x",
        "/v1/spool/%ff%fe/x",
        "/v1/spool/./RESULT/manifest.json",
        "/v1/scans/..%2f..%2fsecret/journal",
        "/v1/scans/%2e%2e/journal",
        "http://localhost/v1/spool/../secret",
        "*",
        "/../../../../../../etc/passwd",
    ] {
        let target = target.replace("RESULT", result);
        for way in BOTH {
            let stream = doors.connect(way).await;
            let request = format!("GET {target} HTTP/1.0\r\n{fields}\r\n");
            let reply = text(&told(stream, request.as_bytes()).await);
            let status = reply.split(' ').nth(1);
            assert!(matches!(status, Some("400" | "404")), "{target}: {reply}");
            assert!(!reply.contains("the secret"), "{target}: {reply}");
        }
    }
    // What is there is found by the same means.
    let request = format!("GET /v1/spool/{result}/manifest.json HTTP/1.0\r\n{fields}\r\n");
    for way in BOTH {
        let stream = doors.connect(way).await;
        let reply = told(stream, request.as_bytes()).await;
        assert!(reply.starts_with(b"HTTP/1.0 200"), "{}", text(&reply));
    }
    doors.rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn slow_requests_are_cut() {
    let doors = Doors::open(HttpConfig {
        // Long enough for what is sound in here to be in time on a busy machine.
        request_timeout_ms: 2_000,
        ..HttpConfig::default()
    })
    .await;
    let fields = doors.fields();
    // Silence, and a head that does not end, however steadily it comes.
    for way in BOTH {
        let stream = doors.connect(way).await;
        assert_eq!(text(&rest(stream).await), "");
    }
    for way in BOTH {
        let mut stream = doors.connect(way).await;
        let drip = async {
            stream.write_all(b"GET / HTTP/1.1\r\n").await?;
            loop {
                stream.write_all(b"X: y\r\n").await?;
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        };
        let ended: std::io::Result<()> = tokio::time::timeout(GUARD, drip).await.expect("cut");
        ended.unwrap_err();
    }
    // A body of which some never comes.
    let body = format!(
        "POST /v1/scans HTTP/1.1\r\n{fields}Content-Type: application/json\r\n\
         Content-Length: 100\r\n\r\n{{"
    );
    for way in BOTH {
        let stream = doors.connect(way).await;
        let problem = problem(&told(stream, body.as_bytes()).await);
        assert_eq!(
            (problem.status, problem.kind.as_str()),
            (408, "slow-request")
        );
        assert!(problem.detail.contains("2000 ms"), "{problem}");
    }
    doors.check().await;
    doors.rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn connections_are_limited_on_each_door_alone() {
    let doors = Doors::open(HttpConfig {
        connections: 3,
        ..HttpConfig::default()
    })
    .await;
    let tcp = doors.rig.daemon.listen().unwrap();
    // A reply to each shows that it has its place.
    let request = format!("GET {} HTTP/1.1\r\n{}\r\n", path::STATUS, doors.fields());
    let mut held = Vec::new();
    for _ in 0..3 {
        let mut stream = TcpStream::connect(tcp).await.unwrap();
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut first = [0; 12];
        stream.read_exact(&mut first).await.unwrap();
        assert_eq!(&first, b"HTTP/1.1 200");
        held.push(stream);
    }
    for _ in 0..50 {
        let stream = TcpStream::connect(tcp).await.unwrap();
        let problem = problem(&told(stream, request.as_bytes()).await);
        assert_eq!(
            (problem.status, problem.kind.as_str()),
            (503, "too-many-connections")
        );
        assert!(problem.detail.starts_with("3 clients"), "{problem}");
    }
    let status: Status = doors.rig.client.get(path::STATUS).await;
    assert_eq!(status.jobs_queued, 0, "the socket is as free as ever");

    drop(held.pop());
    let again = async {
        loop {
            let stream = TcpStream::connect(tcp).await.unwrap();
            let request = request.replace("HTTP/1.1", "HTTP/1.0");
            let reply = told(stream, request.as_bytes()).await;
            if reply.starts_with(b"HTTP/1.0 200") {
                break;
            }
        }
    };
    tokio::time::timeout(GUARD, again)
        .await
        .expect("a place that is left is given anew");
    doors.rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn listeners_are_limited_on_each_door_alone() {
    let doors = Doors::open(HttpConfig {
        listeners: 2,
        ..HttpConfig::default()
    })
    .await;
    let first = doors.rig.client.events().await;
    let _second = doors.rig.client.events().await;
    let reply = doors.rig.client.request("GET", path::EVENTS, None).await;
    let problem = reply.problem();
    assert_eq!(
        (problem.status, problem.kind.as_str()),
        (503, "too-many-listeners")
    );
    assert!(problem.hint.unwrap().contains("http.listeners"));
    // The other door has places of its own, and no more of them.
    let request = format!("GET {} HTTP/1.1\r\n{}\r\n", path::EVENTS, doors.fields());
    let mut bearers = Vec::new();
    for expected in [b"HTTP/1.1 200", b"HTTP/1.1 200", b"HTTP/1.1 503"] {
        let mut bearer = doors.connect(Way::Loopback).await;
        bearer.write_all(request.as_bytes()).await.unwrap();
        let mut begin = [0; 12];
        bearer.read_exact(&mut begin).await.unwrap();
        assert_eq!(&begin, expected);
        bearers.push(bearer);
    }
    drop(first);
    let again = async {
        // The service notices the end when it next has something to tell, or to ask.
        while doors
            .rig
            .client
            .request("HEAD", path::EVENTS, None)
            .await
            .status
            != 200
        {}
    };
    tokio::time::timeout(GUARD, again)
        .await
        .expect("a place that is left is given anew");
    doors.rig.daemon.shutdown().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_does_not_read_loses_the_connection() {
    let doors = Doors::open(HttpConfig {
        connections: 1,
        stall_timeout_ms: 200,
        ..HttpConfig::default()
    })
    .await;
    // More than any system keeps between two ends of a connection.
    let large = doors.rig.daemon.spool_dir().join("r");
    std::fs::create_dir(&large).unwrap();
    let bytes = 64 << 20;
    std::fs::File::create(large.join("large"))
        .unwrap()
        .set_len(bytes)
        .unwrap();
    let request = format!("GET /v1/spool/r/large HTTP/1.0\r\n{}\r\n", doors.fields());
    let begun = async |way| loop {
        let mut stream = doors.connect(way).await;
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut first = [0; 12];
        stream.read_exact(&mut first).await.unwrap();
        if &first == b"HTTP/1.0 200" {
            break stream;
        }
        // The only place may still be that of the one before, who asked for a token.
        assert_eq!(&first, b"HTTP/1.1 503");
    };
    let unix = begun(Way::Socket).await;
    let tcp = begun(Way::Loopback).await;
    let free = async {
        loop {
            let mut answered = 0;
            for way in BOTH {
                let stream = doors.connect(way).await;
                let request = format!("GET {} HTTP/1.0\r\n{}\r\n", path::STATUS, doors.fields());
                let reply = told(stream, request.as_bytes()).await;
                answered += u32::from(reply.starts_with(b"HTTP/1.0 200"));
            }
            if answered == 2 {
                break;
            }
        }
    };
    tokio::time::timeout(GUARD, free)
        .await
        .expect("their places become free");
    for stream in [unix, tcp] {
        let read = rest(stream).await.len() as u64;
        assert!(read < bytes, "{read} bytes");
    }
    doors.rig.daemon.shutdown().await;
}
