//! NATS servers as children: one, or three as a cluster, and the way to them, which can be cut.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use nats_child::{KEEPS, Server, free_port};
use serde_json::Value;

/// How long a cluster may take to find a leader.
const GUARD: Duration = Duration::from_secs(60);
/// How long a look at a server may take.
const LOOK: Duration = Duration::from_secs(2);

struct Member {
    name: String,
    server: Server,
    monitor: u16,
}

/// Servers of one cluster.
pub(crate) struct Cluster {
    members: Vec<Member>,
}

impl Member {
    /// What it tells of itself.
    fn monitored(&self, path: &str) -> Result<Value> {
        let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, self.monitor))?;
        stream.set_read_timeout(Some(LOOK))?;
        write!(stream, "GET {path} HTTP/1.0\r\n\r\n")?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer)?;
        let (_, body) = answer.split_once("\r\n\r\n").context("no answer")?;
        Ok(serde_json::from_str(body)?)
    }
}

impl Cluster {
    /// Starts so many servers.
    pub(crate) fn start(count: usize) -> Result<Self> {
        let routes: Vec<u16> = (0..count).map(|_| free_port()).collect::<Result<_, _>>()?;
        let mut members = Vec::new();
        for (number, route) in routes.iter().enumerate() {
            let name = format!("n{}", number + 1);
            let monitor = free_port()?;
            let others: Vec<String> = routes
                .iter()
                .map(|other| format!("nats://127.0.0.1:{other}"))
                .collect();
            let mut lines =
                format!("server_name: {name}\nhttp: \"127.0.0.1:{monitor}\"\n{KEEPS}\n");
            if count > 1 {
                // The others are not told to clients, who would find a way around a link that is cut.
                lines += &format!(
                    "cluster {{ name: study, listen: \"127.0.0.1:{route}\", no_advertise: true, \
                     routes: [{}] }}\n",
                    others.join(", ")
                );
            }
            members.push(Member {
                name,
                server: Server::new(&lines)?,
                monitor,
            });
        }
        for member in &members {
            member.server.start()?;
        }
        let cluster = Self { members };
        if count > 1 {
            cluster.wait_for_leader()?;
        }
        Ok(cluster)
    }

    fn wait_for_leader(&self) -> Result<()> {
        let begun = Instant::now();
        loop {
            let answers = self.members.iter().map(|member| member.monitored("/jsz"));
            let has_leader = |answer: Result<Value>| {
                answer.is_ok_and(|answer| answer["meta_cluster"]["leader"].is_string())
            };
            if answers.into_iter().all(has_leader) {
                return Ok(());
            }
            ensure!(begun.elapsed() < GUARD, "the cluster has found no leader");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Addresses of all servers.
    pub(crate) fn ports(&self) -> Vec<u16> {
        self.members.iter().map(|one| one.server.port()).collect()
    }

    /// Number of the server that leads the stream of orders; the first if that cannot be told.
    pub(crate) fn leader(&self) -> usize {
        let leads = |member: &Member| -> Option<String> {
            let answer = member.monitored("/jsz?accounts=true&streams=true").ok()?;
            let accounts = answer["account_details"].as_array()?.clone();
            let streams = accounts
                .iter()
                .filter_map(|one| one["stream_detail"].as_array());
            let orders = streams.flatten().find(|one| {
                one["name"]
                    .as_str()
                    .is_some_and(|name| name.ends_with("JOBS") || name.ends_with("jobs"))
            })?;
            Some(orders["cluster"]["leader"].as_str()?.to_owned())
        };
        let told = self.members.iter().find_map(leads);
        told.and_then(|name| self.members.iter().position(|one| one.name == name))
            .unwrap_or_default()
    }

    /// How many messages the leader of a stream has; none can be told while there is none.
    pub(crate) fn messages(&self, stream: &str) -> Option<u64> {
        self.members.iter().find_map(|member| {
            let answer = member.monitored("/jsz?accounts=true&streams=true").ok()?;
            let accounts = answer["account_details"].as_array()?;
            let streams = accounts
                .iter()
                .filter_map(|one| one["stream_detail"].as_array());
            let found = streams.flatten().find(|one| one["name"] == stream)?;
            // A single server has no cluster to tell of.
            let leader = &found["cluster"]["leader"];
            let leads = leader.is_null() || *leader == member.name.as_str();
            leads.then(|| found["state"]["messages"].as_u64())?
        })
    }

    /// What each server has of each stream.
    pub(crate) fn told(&self) -> String {
        let mut told = String::new();
        for member in &self.members {
            let answer = member.monitored("/jsz?accounts=true&streams=true");
            let streams = answer
                .iter()
                .flat_map(|answer| answer["account_details"].as_array())
                .flatten()
                .filter_map(|account| account["stream_detail"].as_array())
                .flatten();
            for stream in streams {
                told += &format!(
                    "\n{} {}: leader {}, {}",
                    member.name, stream["name"], stream["cluster"]["leader"], stream["state"]
                );
            }
        }
        told
    }

    /// SIGKILL.
    pub(crate) fn kill(&self, number: usize) {
        self.members[number].server.kill();
    }

    /// Starts it again with what it has kept.
    pub(crate) fn start_again(&self, number: usize) -> Result<()> {
        Ok(self.members[number].server.start()?)
    }
}

/// A way to the servers, one port for each, which can be cut.
pub(crate) struct Link {
    ports: Vec<u16>,
    is_cut: Arc<AtomicBool>,
}

impl Link {
    /// One that is not cut. Lives until the process ends.
    pub(crate) fn to(ports: &[u16]) -> Result<Self> {
        let is_cut = Arc::new(AtomicBool::new(false));
        let mut own = Vec::new();
        for &port in ports {
            let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
            own.push(listener.local_addr()?.port());
            let is_cut = Arc::clone(&is_cut);
            std::thread::spawn(move || {
                for client in listener.incoming().flatten() {
                    if is_cut.load(Ordering::Relaxed) {
                        continue;
                    }
                    let Ok(server) = TcpStream::connect((Ipv4Addr::LOCALHOST, port)) else {
                        continue;
                    };
                    for (from, to) in [(&client, &server), (&server, &client)] {
                        if let (Ok(from), Ok(to)) = (from.try_clone(), to.try_clone()) {
                            let is_cut = Arc::clone(&is_cut);
                            std::thread::spawn(move || carry(from, to, &is_cut));
                        }
                    }
                }
            });
        }
        Ok(Self { ports: own, is_cut })
    }

    pub(crate) fn ports(&self) -> &[u16] {
        &self.ports
    }

    /// From now on nothing gets through, and what is connected is cut off; or things do again.
    pub(crate) fn cut(&self, is_cut: bool) {
        self.is_cut.store(is_cut, Ordering::Relaxed);
    }
}

fn carry(mut from: TcpStream, mut to: TcpStream, is_cut: &AtomicBool) {
    let _ = from.set_read_timeout(Some(Duration::from_millis(20)));
    let _ = to.set_nodelay(true);
    let mut bytes = vec![0; 1 << 16];
    while !is_cut.load(Ordering::Relaxed) {
        match from.read(&mut bytes) {
            Ok(0) => break,
            Ok(count) => {
                if to.write_all(&bytes[..count]).is_err() {
                    break;
                }
            }
            Err(error)
                if matches!(
                    error.kind(),
                    std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut
                ) => {}
            Err(_) => break,
        }
    }
    let _ = from.shutdown(std::net::Shutdown::Both);
    let _ = to.shutdown(std::net::Shutdown::Both);
}

/// Addresses as the configuration has them.
pub(crate) fn urls(ports: &[u16]) -> Vec<String> {
    ports
        .iter()
        .map(|port| format!("nats://127.0.0.1:{port}"))
        .collect()
}
