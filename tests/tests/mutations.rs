//! The short form of `cargo xtask study mutations`.

use peak_alloc::PeakAlloc;
use relief_tests::mutations::{self, MOST_BYTES, MOST_SMALL_BYTES, MOST_TIME, Meter, Wanted};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// Large enough for what grows with the square of a file's size to show.
const WORST_BYTES: usize = 200_000;
/// Memory that a reader may take, in lengths of the file: a point of three bytes takes 60.
const MOST_TIMES: usize = 30;

struct Memory;

impl Meter for Memory {
    fn begin(&self) -> usize {
        ALLOCATOR.reset_peak_usage();
        ALLOCATOR.current_usage()
    }

    fn peak(&self) -> usize {
        ALLOCATOR.peak_usage()
    }
}

/// One test, since memory is measured for the whole process.
#[test]
fn damaged_files_end_no_reader_and_take_no_memory() {
    let seeds = mutations::seeds().unwrap();
    let one = mutations::mutant(&seeds, 7).unwrap();
    assert_eq!(one.bytes, mutations::mutant(&seeds, 7).unwrap().bytes);
    let wanted = Wanted {
        // Others than those of the long form.
        first: 1_000_000,
        files: 400,
        through_every: 20,
    };
    let figures = mutations::run(&wanted, &Memory, |_| {}).unwrap();
    assert!(figures.panics.is_empty(), "{:?}", figures.panics);
    assert!(
        figures.most_bytes.0 < MOST_BYTES,
        "{:?}",
        figures.most_bytes
    );
    assert_eq!(figures.formats.len(), seeds.len());
    // Damage that nobody survives, or everybody, shows nothing.
    let (files, taken) = figures
        .formats
        .values()
        .fold((0, 0), |sum, format| (sum.0 + format.0, sum.1 + format.1));
    assert_eq!(files, wanted.files);
    assert!(
        (files / 10..files * 9 / 10).contains(&taken),
        "{taken} of {files}"
    );
    assert!(figures.through.1 > 0, "{:?}", figures.through);

    for small in mutations::small(&Memory).unwrap() {
        assert!(small.bytes <= 250, "{small:?}");
        let most = if small.packed {
            MOST_BYTES
        } else {
            MOST_SMALL_BYTES
        };
        assert!(small.peak_bytes < most, "{small:?}");
        assert!(small.took < MOST_TIME, "{small:?}");
    }

    for one in mutations::worst(WORST_BYTES, &Memory, |_| {}).unwrap() {
        let most = if one.packed {
            MOST_BYTES
        } else {
            MOST_SMALL_BYTES + MOST_TIMES * one.bytes
        };
        assert!(one.peak_bytes < most, "{one:?}");
        assert!(one.took < MOST_TIME, "{one:?}");
    }
}
