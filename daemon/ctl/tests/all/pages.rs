//! Pages that conversions leave.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on is a test that has failed"
)]

use crate::common;

use std::fs;

use common::{relief, roof, text};

#[test]
fn a_conversion_leaves_a_page_in_the_form_that_its_ending_means() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("roof.xyz"), text(&roof())).unwrap();
    let run = |page: &str, more: &[&str]| {
        let arguments = [
            "convert",
            "roof.xyz",
            "--name",
            "A <b> roof",
            "--page",
            page,
        ];
        relief(directory.path(), &[&arguments[..], more].concat())
    };
    let output = run("roof.html", &["--page", "roof.PDF"]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let html = fs::read_to_string(directory.path().join("roof.html")).unwrap();
    assert!(html.contains("<h1><bdi>A &lt;b&gt; roof</bdi></h1>"));
    assert_eq!(html.matches("data:image/png;base64,").count(), 4);
    let pdf = fs::read(directory.path().join("roof.PDF")).unwrap();
    assert!(pdf.starts_with(b"%PDF-1.7"));
    let output = run("roof.doc", &[]);
    assert_eq!(output.status.code(), Some(2));
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        told.contains("roof.doc names no form of a page; known: .html, .pdf"),
        "{told}"
    );
    assert!(!directory.path().join("roof.doc").exists());
}
