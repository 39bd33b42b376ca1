//! What fuzzers begin with, what they have found that leads somewhere new, and everything that
//! once made a target fail: none does now.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on says where")]

use std::fs;
use std::path::Path;

use relief_fuzz::TARGETS;

/// The files of a target, of which the seeds are never missing.
fn files(folder: &str, target: &str) -> Vec<std::path::PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../fuzz")
        .join(folder)
        .join(target);
    let Ok(entries) = fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn seeds_and_finds_pass() {
    let mut kept_bytes = 0;
    for (name, target) in TARGETS {
        let seeds = files("seeds", name);
        assert!(seeds.len() >= 3, "{name} has {} seeds", seeds.len());
        let kept = files("kept", name);
        assert!(kept.len() >= 10, "{name} has {} kept inputs", kept.len());
        for file in &kept {
            kept_bytes += fs::metadata(file).unwrap().len();
        }
        for file in seeds.iter().chain(&files("finds", name)).chain(&kept) {
            println!("{}", file.display());
            target(&fs::read(file).unwrap());
        }
    }
    // The repository has room for them.
    assert!(kept_bytes < 1_000_000, "{kept_bytes} bytes are kept");
}

#[test]
fn seeds_lead_somewhere() {
    // A seed that is refused at its first byte would leave the fuzzer to find out alone what
    // the format is.
    let read = |target: &str, name: &str| {
        let files = files("seeds", target);
        let found = files.iter().find(|file| file.ends_with(name));
        fs::read(found.unwrap()).unwrap()
    };
    let whole = read("journal", "cartesian");
    let mut journal = scan_record::JournalReader::new(&*whole).unwrap();
    while journal.next_column().unwrap().is_some() {}
    assert_eq!(journal.columns(), 4);
    assert_eq!(
        journal.ending(),
        Some(&scan_record::Ending::Closed(
            scan_record::EndCause::Complete
        ))
    );
    for name in ["points-106", "points-116"] {
        let points = cad_exchange::iges::read_points(&*read("iges", name)).unwrap();
        assert!(points.len() >= 8, "{name}: {}", points.len());
    }
    cad_exchange::iges::read_model(&*read("iges", "model-128")).unwrap();
    for (name, faces) in [("drum-inch", 3), ("vase", 8)] {
        let body = cad_exchange::step::read_body(&*read("step", name)).unwrap();
        assert_eq!(body.faces.len(), faces, "{name}");
    }
    cad_exchange::step::read_model(&*read("step", "own")).unwrap();
    // Bare contents come to the same file.
    let bare = |name: &str| relief_fuzz::laid_out(&read("iges", name)[1..]);
    for kind in ["points-106", "points-116"] {
        let points = |file: &[u8]| cad_exchange::iges::read_points(file).unwrap();
        assert_eq!(
            points(&bare(&format!("bare-{kind}"))),
            points(&read("iges", kind))
        );
    }
    for kind in ["model-114", "model-128"] {
        let model = |file: &[u8]| cad_exchange::iges::read_model(file).unwrap();
        assert_eq!(
            model(&bare(&format!("bare-{kind}"))),
            model(&read("iges", kind))
        );
    }
    for (name, status) in [
        ("status", "200"),
        ("status-loopback", "200"),
        ("rerun", "202"),
        ("journal", "200"),
        ("one-scan", "200"),
    ] {
        let reply = relief_fuzz::reply(&read("http", name));
        assert_eq!(reply.split(' ').nth(1), Some(status), "{name}: {reply}");
    }
    let options = scan_files::ReadOptions::default();
    for name in ["blanks.xyz", "semicolons.csv", "packed.xyz.gz"] {
        let scan = scan_files::read_from(&*read("scan_file", name), name, &options).unwrap();
        assert_eq!(scan.points(), 81, "{name}");
    }
    for (name, format) in [
        ("ascii", "ascii"),
        ("binary-little", "binary_little_endian"),
        ("binary-big", "binary_big_endian"),
    ] {
        let mut file = format!("ply\nformat {format} 1.0\n").into_bytes();
        file.extend(&read("ply", name)[1..]);
        let scan = scan_files::read_from(&*file, name, &options).unwrap();
        assert_eq!(scan.points(), 81, "{name}");
    }
    for name in ["serial.toml", "usb.toml", "simulator.toml", "all.toml"] {
        let text = String::from_utf8(read("config", name)).unwrap();
        reliefd::Config::parse(&text, Path::new(name)).unwrap();
    }
    for (name, frames) in [("host-messages", 14), ("device-messages", 16)] {
        let bytes = read("protocol", name);
        let (mut rest, mut decoder) = (&*bytes, scanner_protocol::Decoder::new());
        while decoder.next(&mut rest).is_some() {}
        assert!(decoder.counts().frames >= frames, "{name}");
        assert_eq!(decoder.counts().bad(), 0, "{name}");
    }
}
