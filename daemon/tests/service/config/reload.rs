//! What a reload puts in force and what waits for a restart.

use std::path::Path;

use reliefd::Config;

#[test]
fn a_reload_says_what_holds_and_what_needs_a_restart() {
    let parse = |text: &str| Config::parse(text, Path::new("relief.toml")).unwrap();
    let old = parse("");
    let new = parse(
        "[regrid]\nseed = 7\n[fill]\nmode = \"auto\"\n[log]\nlevel = \"debug\"\n\
         [scanner]\nbaud = 9600\n\
         [deliverables]\nauthor = \"A\"\n",
    );
    let (merged, outcome) = old.reloaded(&new);
    assert_eq!(outcome.applied, ["regrid", "fill", "deliverables", "log"]);
    assert_eq!(outcome.needs_restart, ["scanner"]);
    assert_eq!(merged.regrid.seed, Some(7));
    assert_eq!(merged.scanner, old.scanner);
    assert_eq!(old.reloaded(&old).1, reliefd::config::Reloaded::default());
}

#[test]
fn a_reload_changes_what_a_scanner_measures_and_leaves_it_attached() {
    let parse = |text: &str| Config::parse(text, Path::new("relief.toml")).unwrap();
    let old = parse("[scanners.a]\nport = \"a\"\n[scanners.b]\nport = \"b\"\n");
    let new = parse(
        "[scanners.a]\nport = \"a\"\nscan.samples = 9\n[scanners.b]\nport = \"other\"\n\
         scan.samples = 8\n[scanners.c]\nport = \"c\"\n",
    );
    let (merged, outcome) = old.reloaded(&new);
    assert_eq!(outcome.applied, ["scanners.a.scan", "scanners.b.scan"]);
    assert_eq!(outcome.needs_restart, ["scanners.b", "scanners.c"]);
    assert_eq!(merged.scan_on("a").samples, Some(9));
    assert_eq!(merged.scan_on("b").samples, Some(8));
    assert_eq!(merged.scanners["b"].port, Path::new("b"));
    assert_eq!(merged.scanners.len(), 2);
    let (merged, outcome) = old.reloaded(&parse("[scanner]\nport = \"a\"\n"));
    assert_eq!(
        outcome.needs_restart,
        ["scanner", "scanners.a", "scanners.b"]
    );
    assert_eq!(merged.each_scanner().len(), 2);
}
