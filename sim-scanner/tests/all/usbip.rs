//! The simulated scanner on USB/IP, as a host's kernel sees it.

#![allow(clippy::panic)] // A test that panics has failed.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use scanner_protocol::commands::{Hello, HelloReply};
use scanner_protocol::usb::{INTERFACE, PRODUCT_ID_CDC_ACM, PRODUCT_ID_VENDOR, VENDOR_ID};
use scanner_protocol::{Decoder, DeviceMessage, Frame};
use sim_scanner::config::SimConfig;
use sim_scanner::endpoint::usb::{Attachment, Personality, UsbServer};

const LIMIT: Duration = Duration::from_secs(20);
const DEVICE_BYTES: usize = 312;

fn serve(personality: Personality) -> (UsbServer, SocketAddr) {
    let config = SimConfig::default();
    let source = config.source().expect("built in");
    let anywhere = "127.0.0.1:0".parse().expect("an address");
    let server = config
        .serve_usb(source, personality, Attachment::Network(anywhere))
        .expect("a free port");
    // Its banner is said, to nobody.
    server
        .control()
        .wait_for_host(LIMIT, false)
        .expect("served");
    let address = server.address().expect("it is on the network");
    (server, address)
}

struct Host(TcpStream);

impl Host {
    fn connect(address: SocketAddr) -> Self {
        let stream = TcpStream::connect(address).expect("it listens");
        stream.set_read_timeout(Some(LIMIT)).expect("a socket");
        Self(stream)
    }

    fn send(&mut self, bytes: &[u8]) {
        self.0.write_all(bytes).expect("it takes in");
    }

    fn take(&mut self, length: usize) -> Vec<u8> {
        let mut bytes = vec![0; length];
        self.0.read_exact(&mut bytes).expect("an answer");
        bytes
    }

    fn is_hung_up_on(&mut self) -> bool {
        matches!(self.0.read(&mut [0]), Ok(0) | Err(_))
    }

    /// Asks for the device; gives the status, and the device if it is given.
    fn import(&mut self, name: &str) -> (u32, Vec<u8>) {
        let mut request = vec![1, 0x11, 0x80, 3, 0, 0, 0, 0];
        request.extend(name.bytes());
        request.resize(40, 0);
        self.send(&request);
        let header = self.take(8);
        assert_eq!(header[..4], [1, 0x11, 0, 3]);
        let status = u32::from_be_bytes(header[4..8].try_into().expect("four"));
        let device = if status == 0 {
            self.take(DEVICE_BYTES)
        } else {
            Vec::new()
        };
        (status, device)
    }

    fn submit(&mut self, sequence: u32, endpoint: u32, incoming: bool, length: u32) {
        self.submit_with(sequence, endpoint, incoming, length, [0; 8], &[]);
    }

    fn submit_with(
        &mut self,
        sequence: u32,
        endpoint: u32,
        incoming: bool,
        length: u32,
        setup: [u8; 8],
        data: &[u8],
    ) {
        let words = [
            1,
            sequence,
            0x1_0001,
            u32::from(incoming),
            endpoint,
            0,
            length,
            0,
            u32::MAX,
            0,
        ];
        let mut bytes: Vec<u8> = words.iter().flat_map(|word| word.to_be_bytes()).collect();
        bytes.extend(setup);
        bytes.extend(data);
        self.send(&bytes);
    }

    /// Command, sequence, status and length of the next answer.
    fn answer(&mut self) -> [i32; 4] {
        let header = self.take(48);
        let word = |at: usize| i32::from_be_bytes(header[at..at + 4].try_into().expect("four"));
        [word(0), word(4), word(20), word(24)]
    }

    fn open_port(&mut self) {
        self.submit_with(900, 0, false, 0, [0x21, 0x22, 3, 0, 0, 0, 0, 0], &[]);
        assert_eq!(self.answer(), [3, 900, 0, 0]);
    }
}

#[test]
fn the_list_and_the_import_say_what_is_offered() {
    for (personality, product, interfaces) in [
        (Personality::Vendor, PRODUCT_ID_VENDOR, 1),
        (Personality::CdcAcm, PRODUCT_ID_CDC_ACM, 2),
    ] {
        let (_server, address) = serve(personality);
        let mut host = Host::connect(address);
        host.send(&[1, 0x11, 0x80, 5, 0, 0, 0, 0]);
        let list = host.take(12 + DEVICE_BYTES + 4 * interfaces);
        assert_eq!(list[8..12], 1_u32.to_be_bytes());
        assert!(list[12 + 256..].starts_with(b"1-1\0"));
        let numbers = &list[12 + 300..];
        assert_eq!(numbers[..2], VENDOR_ID.to_be_bytes());
        assert_eq!(numbers[2..4], product.to_be_bytes());
        if personality == Personality::Vendor {
            let class = [INTERFACE.class, INTERFACE.subclass, INTERFACE.protocol, 0];
            assert_eq!(list[12 + DEVICE_BYTES..], class);
        }
        assert!(host.is_hung_up_on(), "a list is all there is to say");

        let mut host = Host::connect(address);
        assert_eq!(host.import("2-1").0, 4, "no such device");
        let mut host = Host::connect(address);
        let (status, device) = host.import("1-1");
        assert_eq!(status, 0);
        assert_eq!(device[..], list[12..12 + DEVICE_BYTES]);
        let mut second = Host::connect(address);
        assert_eq!(second.import("1-1").0, 2, "one host at a time");
    }
}

#[test]
fn frames_go_both_ways_over_the_bulk_endpoints() {
    for personality in [Personality::Vendor, Personality::CdcAcm] {
        let (server, address) = serve(personality);
        let mut host = Host::connect(address);
        assert_eq!(host.import("1-1").0, 0);
        server
            .control()
            .wait_for_host(LIMIT, true)
            .expect("attached");
        if personality == Personality::CdcAcm {
            host.open_port();
        }
        let hello = Frame::new(
            9,
            &Hello {
                min_version: 1,
                max_version: 1,
                dead_man_ms: 500,
            },
        );
        let length = hello.as_bytes().len();
        host.submit_with(1, 1, false, length as u32, [0; 8], hello.as_bytes());
        assert_eq!(host.answer(), [3, 1, 0, length as i32]);
        let mut decoder = Decoder::new();
        let mut sequence = 100;
        loop {
            host.submit(sequence, 1, true, 512);
            let [command, answered, status, length] = host.answer();
            assert_eq!((command, answered, status), (3, sequence as i32, 0));
            let came = host.take(length as usize);
            let mut bytes = &came[..];
            let replied = std::iter::from_fn(|| decoder.next(&mut bytes)).any(|packet| {
                packet.tag == 9
                    && matches!(
                        DeviceMessage::decode(&packet),
                        Ok(DeviceMessage::HelloReply(HelloReply { version: 1, .. }))
                    )
            });
            if replied {
                break;
            }
            sequence += 1;
        }
        let line = server.control().line_use();
        assert_eq!(line.from_host_bytes, length as u64);
        assert!(line.to_host_bytes > 0);
    }
}

#[test]
fn pulling_the_plug_ends_what_is_under_way_and_it_can_be_put_back() {
    let (server, address) = serve(Personality::Vendor);
    let mut host = Host::connect(address);
    assert_eq!(host.import("1-1").0, 0);
    host.submit(1, 1, true, 512);
    server.control().unplug();
    assert!(host.is_hung_up_on());
    server.control().wait_for_host(LIMIT, false).expect("gone");
    let mut host = Host::connect(address);
    assert_eq!(host.import("1-1").0, 4, "it is not there");
    server.control().replug();
    let mut host = Host::connect(address);
    assert_eq!(host.import("1-1").0, 0);
    server.control().wait_for_host(LIMIT, true).expect("back");
}

#[test]
fn a_host_that_goes_leaves_the_device_to_the_next() {
    let (server, address) = serve(Personality::Vendor);
    for _ in 0..3 {
        let mut host = Host::connect(address);
        assert_eq!(host.import("1-1").0, 0);
        // A configuration set by an earlier host is not there any more.
        host.submit_with(1, 0, true, 1, [0x80, 8, 0, 0, 0, 0, 1, 0], &[]);
        assert_eq!(host.answer(), [3, 1, 0, 1]);
        assert_eq!(host.take(1), [0]);
        host.submit_with(2, 0, false, 0, [0x00, 9, 1, 0, 0, 0, 0, 0], &[]);
        assert_eq!(host.answer(), [3, 2, 0, 0]);
        drop(host);
        server.control().wait_for_host(LIMIT, false).expect("gone");
    }
}

#[test]
fn a_halted_endpoint_stalls_what_waits() {
    let (server, address) = serve(Personality::Vendor);
    let mut host = Host::connect(address);
    assert_eq!(host.import("1-1").0, 0);
    host.submit(1, 1, true, 512);
    server.control().halt_endpoint();
    assert_eq!(host.answer(), [3, 1, -32, 0]);
}

#[test]
fn strangers_and_liars_are_hung_up_on_and_the_device_serves_on() {
    let (_server, address) = serve(Personality::Vendor);
    let length = |length: u32| {
        let words = [1, 1, 0x1_0001, 0, 1, 0, length, 0, u32::MAX, 0, 0, 0];
        words
            .iter()
            .flat_map(|word: &u32| word.to_be_bytes())
            .collect::<Vec<u8>>()
    };
    for (attached, bytes) in [
        (false, b"GET / HTTP/1.1\r\n\r\n".to_vec()),
        (false, vec![1, 0x11, 0x99, 0x99, 0, 0, 0, 0]),
        (true, length(u32::MAX)),
        (true, length(0x7fff_ffff)),
        (true, vec![0xff; 48]),
    ] {
        let mut host = Host::connect(address);
        if attached {
            assert_eq!(host.import("1-1").0, 0);
        }
        host.send(&bytes);
        assert!(host.is_hung_up_on(), "{bytes:02x?}");
    }
    // Many who say nothing keep nobody out.
    let _silent: Vec<Host> = (0..40).map(|_| Host::connect(address)).collect();
    let mut host = Host::connect(address);
    assert_eq!(host.import("1-1").0, 0);
}
