//! What is heard is seen.

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::Buffer;
use ratatui::crossterm::event::{Event as Input, KeyCode, KeyEvent, KeyModifiers};
use ratatui::style::{Color, Modifier};
use relief_api::{Event, LiveColumn};
use serde_json::{Value, json};

use super::actions::Action;
use super::board::{Board, Now};
use super::colours::Depth;
use super::keys::Wish;
use super::link::Word;
use super::screen;

fn at(s: f64) -> Now {
    Now {
        s,
        clock: "12:34:56".into(),
    }
}

fn scanner(name: &str, laser: &str, scan: Option<Value>) -> Value {
    json!({
        "name": name, "link": "ready", "endpoint": "/dev/ttyS0", "model": "RS-1", "scan": scan,
        "laser": {"at": "t", "laser": laser, "cause": "because"},
    })
}

fn status(scanners: Vec<Value>) -> Word {
    let text = json!({
        "version": "1.2.3", "started_at": "t", "scanner": scanners[0], "scanners": scanners,
        "jobs_queued": 3, "jobs_running": 1, "spool": "/spool",
    });
    Word::Status(Box::new(serde_json::from_value(text).unwrap()))
}

fn event(value: Value) -> Word {
    Word::Event(Box::new(serde_json::from_value(value).unwrap()))
}

fn scan(scanner: &str, state: &str) -> Value {
    json!({
        "id": format!("scan-{scanner}"), "name": "house", "scanner": scanner, "state": state,
        "started_at": "t", "columns_planned": 40, "columns": 10,
    })
}

/// Columns whose heights rise with x, 40 nodes in each.
fn column(scanner: &str, number: u32) -> Word {
    let i = i64::from(number);
    Word::Event(Box::new(Event::Column {
        scan: format!("scan-{scanner}"),
        scanner: scanner.into(),
        columns: number + 1,
        columns_planned: 40,
        samples: 77,
        x_mm: 0.5 * f64::from(number),
        pitch_mm: 0.5,
        live: vec![LiveColumn {
            i,
            j_first: -20,
            z_um: vec![Some(1000 * number as i32); 40],
        }],
    }))
}

fn told(words: impl IntoIterator<Item = Word>) -> Board {
    let mut board = Board::default();
    for word in words {
        board.hear(word, &at(0.0));
    }
    board
}

fn drawn(board: &Board, now: f64, size: [u16; 2], depth: Depth) -> Buffer {
    let mut terminal = Terminal::new(TestBackend::new(size[0], size[1])).unwrap();
    let draw = |frame: &mut ratatui::Frame<'_>| screen::draw(frame, board, &at(now), depth);
    terminal.draw(draw).unwrap();
    terminal.backend().buffer().clone()
}

fn seen(board: &Board) -> Buffer {
    drawn(board, 0.0, [110, 34], Depth::True)
}

fn lines(buffer: &Buffer) -> Vec<String> {
    let area = buffer.area;
    let line = |y| {
        (0..area.width)
            .map(|x| buffer[(x, y)].symbol())
            .collect::<String>()
    };
    (0..area.height).map(line).collect()
}

fn has(buffer: &Buffer, text: &str) -> bool {
    lines(buffer).iter().any(|line| line.contains(text))
}

fn press(board: &mut Board, code: KeyCode) -> Option<Wish> {
    board.press(&Input::Key(KeyEvent::new(code, KeyModifiers::NONE)))
}

#[test]
fn a_laser_that_is_on_fills_a_red_line() {
    let buffer = seen(&told([status(vec![
        scanner("left", "off", None),
        scanner("right", "on", None),
    ])]));
    assert!(
        lines(&buffer)[0].contains("LASER ON: right"),
        "{:?}",
        lines(&buffer)[0]
    );
    for x in 0..110 {
        assert_eq!(buffer[(x, 0)].bg, Color::Red);
    }
    let off = seen(&told([status(vec![scanner("left", "off", None)])]));
    assert_eq!(lines(&off)[0].trim(), "Laser off");
    assert_eq!(off[(0, 0)].bg, Color::Green);
    // An event says so before the next status does.
    let entry = json!({"kind": "laser", "at": "t", "laser": "on", "cause": "c", "scanner": "left"});
    let lit = seen(&told([
        status(vec![scanner("left", "off", None)]),
        event(entry),
    ]));
    assert_eq!(lines(&lit)[0].trim(), "\u{26a0} LASER ON \u{26a0}");
    let unknown = seen(&told([status(vec![scanner("left", "unknown", None)])]));
    assert_eq!(lines(&unknown)[0].trim(), "LASER STATE NOT KNOWN");
    // On the smallest screen, too.
    let on = told([status(vec![scanner("left", "on", None)])]);
    let small = drawn(&on, 0.0, [20, 3], Depth::Indexed);
    assert!(lines(&small)[0].contains("LASER ON"), "{:?}", lines(&small));
    assert!(
        lines(&small)[1].contains("terminal is too"),
        "{:?}",
        lines(&small)
    );
}

/// A range image of the first columns, every `step`th of them.
fn image(scanner: &str, columns: i64, step: i64) -> Word {
    let of = |i: i64| LiveColumn {
        i,
        j_first: -20,
        z_um: vec![Some(1000 * i as i32); (40 / step) as usize],
    };
    Word::Image(Box::new(relief_api::ScanImage {
        scan: format!("scan-{scanner}"),
        pitch_mm: 0.5,
        step: step as u32,
        columns: (0..columns).filter(|i| i % step == 0).map(of).collect(),
    }))
}

fn nodes(board: &Board) -> usize {
    board.selected().unwrap().picture.nodes()
}

#[test]
fn what_was_scanned_before_is_shown_too() {
    let under_way = || status(vec![scanner("left", "on", Some(scan("left", "scanning")))]);
    let late = told([under_way(), column("left", 10)]);
    assert_eq!(nodes(&late), 40);
    let mut board = told([under_way(), column("left", 10), image("left", 10, 1)]);
    assert_eq!(nodes(&board), 11 * 40);
    board.hear(column("left", 11), &at(1.0));
    assert_eq!(nodes(&board), 12 * 40);
    // A thinned one makes all of it as coarse: columns 0, 4 and 8, and 8 again of the events'.
    let coarse = told([under_way(), column("left", 8), image("left", 10, 4)]);
    assert_eq!(nodes(&coarse), 3 * 10);
    // Of another scan it is not.
    let other = told([under_way(), column("left", 10), image("right", 10, 1)]);
    assert_eq!(nodes(&other), 40);
}

#[test]
fn nothing_is_certain_without_a_connection() {
    let mut board = told([Word::Connected, status(vec![scanner("left", "on", None)])]);
    assert!(!has(&seen(&board), "NO CONNECTION"));
    board.hear(Word::Lost("the cat".into()), &at(10.0));
    board.hear(Word::Lost("the dog".into()), &at(12.0));
    let stale = drawn(&board, 33.0, [110, 34], Depth::True);
    let lines = lines(&stale);
    assert_eq!(lines[0].trim(), "LASER STATE NOT KNOWN, last ON");
    assert!(lines[1].contains("NO CONNECTION for 23 s"), "{}", lines[1]);
    assert!(
        lines[1].contains("OLD") && lines[1].contains("the dog"),
        "{}",
        lines[1]
    );
    assert!(stale[(2, 4)].modifier.contains(Modifier::DIM));
    assert!(has(&stale, "connection lost: the cat"));
    board.hear(Word::Connected, &at(34.0));
    let fresh = drawn(&board, 34.0, [110, 34], Depth::True);
    assert!(!has(&fresh, "NO CONNECTION") && has(&fresh, "connected to the service again"));
    assert!(!fresh[(2, 4)].modifier.contains(Modifier::DIM));
}

#[test]
fn a_scan_shows_how_far_it_is() {
    let station = scanner("left", "on", Some(scan("left", "scanning")));
    let mut board = told([status(vec![station])]);
    assert!(has(&seen(&board), "shows from the next column on"));
    for number in 0..20 {
        board.hear(column("left", number), &at(0.25 * f64::from(number)));
    }
    let buffer = drawn(&board, 5.0, [110, 34], Depth::True);
    let text = lines(&buffer).join("\n");
    for told in [
        "20 of 40 columns, 5 s left, 4.0 columns/s",
        "x 9.5 mm, 77 samples",
        "50 %",
    ] {
        assert!(text.contains(told), "{told}: {text}");
    }
    assert!(text.contains("z 0.0") && text.contains("19.0 mm"), "{text}");
    assert!(text.contains("scanning  house"), "{text}");
}

#[test]
fn the_range_image_grows_from_left_to_right() {
    let dots = |columns: u32, depth| {
        let station = scanner("left", "on", Some(scan("left", "scanning")));
        let mut board = told([status(vec![station])]);
        for number in 0..columns {
            board.hear(column("left", number), &at(0.0));
        }
        let buffer = drawn(&board, 0.0, [110, 44], depth);
        let mut found = Vec::new();
        for y in 0..44 {
            for x in 0..66 {
                let cell = &buffer[(x, y)];
                // A dot above another; shades where there are no colours.
                if ["\u{2580}", "\u{2591}"].contains(&cell.symbol()) && y > 10 {
                    found.push((x, cell.fg, cell.bg));
                }
            }
        }
        found
    };
    let widest = |dots: &[(u16, Color, Color)]| dots.iter().map(|dot| dot.0).max().unwrap();
    let (half, whole) = (dots(20, Depth::True), dots(40, Depth::True));
    let left = half.iter().map(|dot| dot.0).min().unwrap();
    assert_eq!(left, whole.iter().map(|dot| dot.0).min().unwrap());
    let (half_mm, whole_mm) = (widest(&half) - left, widest(&whole) - left);
    assert!(
        half_mm.abs_diff(whole_mm / 2) <= 2,
        "{half_mm} of {whole_mm}"
    );
    // The lowest is on the left, the highest on the right, and a column has one height.
    let (low, high) = (Depth::True.colour(0.0), Depth::True.colour(1.0));
    for (x, above, below) in &whole {
        assert_eq!(above, below);
        assert!(*above == low || *x > left, "{x} {left}");
        assert!(*above != low || *x < left + 2, "{x} {left}");
    }
    assert!(
        whole
            .iter()
            .any(|dot| dot.1 == high && dot.0 + 1 >= widest(&whole))
    );
    let few = dots(40, Depth::Indexed);
    assert!(few.iter().all(|dot| matches!(dot.1, Color::Indexed(_))));
    assert!(
        dots(40, Depth::Mono)
            .iter()
            .all(|dot| dot.1 == Color::Reset)
    );
}

#[test]
fn an_outlier_does_not_take_the_colours_of_all_others() {
    let mut picture = super::picture::Picture::default();
    let mut z_um: Vec<Option<i32>> = (0..400).map(Some).collect();
    z_um[200] = Some(400_000);
    let live = LiveColumn {
        i: 0,
        j_first: 0,
        z_um,
    };
    picture.push(&[live], 1, 1);
    let [low, high] = picture.z_mm().unwrap();
    assert!(low < 0.01 && (0.39..0.4).contains(&high), "{low} {high}");
}

#[test]
fn jobs_results_and_events_are_listed() {
    let job = |id: u64, state: &str| {
        json!({"kind": "job", "id": id, "scan": "s", "scanner": "left", "result": "s",
            "name": "house", "state": state, "queued_at": "t"})
    };
    let progress = json!({"kind": "progress", "job": 7, "scan": "s", "scanner": "left",
        "stage": "segment", "fraction": 0.5});
    let published = json!({"kind": "published", "job": 6, "scan": "s", "scanner": "left",
        "result": "one", "directory": "/spool/one", "files": ["a.igs"]});
    let mut board = told([
        status(vec![scanner("left", "off", None)]),
        event(job(6, "queued")),
        event(job(7, "running")),
        event(progress),
        event(published),
    ]);
    let shown = lines(&seen(&board));
    let place = |text: &str| shown.iter().position(|line| line.contains(text));
    let bar = "\u{2588}".repeat(5) + &"\u{2591}".repeat(5);
    let newest = place(&format!("7 running segment {bar} 50 % house")).unwrap();
    assert_eq!(place("6 queued house"), Some(newest + 1), "{shown:?}");
    assert!(place("one (1 file)").is_some());
    assert!(place("12:34:56 job 6 on left: published /spool/one (a.igs)").is_some());
    // A finished job is at no stage.
    board.hear(event(job(7, "done")), &at(0.0));
    assert!(has(&seen(&board), "7 done house"));
}

#[test]
fn keys_ask_before_anything_moves() {
    let mut board = told([status(vec![
        scanner("left", "off", None),
        scanner("right", "off", Some(scan("right", "paused"))),
    ])]);
    assert_eq!(press(&mut board, KeyCode::Char('a')), None);
    assert!(has(&seen(&board), "no scan is under way on this scanner"));
    assert_eq!(press(&mut board, KeyCode::Tab), None);
    assert!(has(&seen(&board), "Scan on right"));
    assert!(
        lines(&seen(&board))
            .iter()
            .any(|line| line.contains(">right") || line.contains("> right"))
    );

    assert_eq!(press(&mut board, KeyCode::Char('r')), None);
    assert!(has(&seen(&board), "LASER COMES ON"));
    assert_eq!(press(&mut board, KeyCode::Char('n')), None);
    assert!(has(&seen(&board), "nothing was done"));
    press(&mut board, KeyCode::Char('r'));
    let resume = Action::Resume("scan-right".into());
    assert_eq!(
        press(&mut board, KeyCode::Char('y')),
        Some(Wish::Act(resume))
    );
    press(&mut board, KeyCode::Char('a'));
    assert!(has(
        &seen(&board),
        "Abort scan-right after 10 of 40 columns? [y/n]"
    ));
    let abort = Action::Abort("scan-right".into());
    assert_eq!(
        press(&mut board, KeyCode::Char('y')),
        Some(Wish::Act(abort))
    );
    // A pause is safe, and is not asked about.
    assert_eq!(press(&mut board, KeyCode::Char('p')), None);
    assert!(has(&seen(&board), "scan-right is paused already"));
    let mut going = scan("right", "scanning");
    going["kind"] = "scan".into();
    board.hear(event(going), &at(0.0));
    let pause = Action::Pause("scan-right".into());
    assert_eq!(
        press(&mut board, KeyCode::Char('p')),
        Some(Wish::Act(pause))
    );
    press(&mut board, KeyCode::Char('r'));
    assert!(has(&seen(&board), "scan-right is not paused"));
    board.hear(Word::Answer(Err("refused".into())), &at(0.0));
    assert!(has(&seen(&board), "refused"));

    press(&mut board, KeyCode::Char('?'));
    assert!(has(&seen(&board), "end the looking"));
    assert_eq!(press(&mut board, KeyCode::Char('x')), None);
    assert!(!has(&seen(&board), "end the looking"));
    press(&mut board, KeyCode::BackTab);
    assert!(has(&seen(&board), "Scan on left"));
    assert_eq!(press(&mut board, KeyCode::Char('q')), Some(Wish::Quit));
    let control = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
    assert_eq!(board.press(&Input::Key(control)), Some(Wish::Quit));
}

#[test]
fn every_size_of_terminal_can_be_drawn_on() {
    let station = scanner("left", "on", Some(scan("left", "scanning")));
    let mut board = told([status(vec![station])]);
    for number in 0..40 {
        board.hear(column("left", number), &at(0.0));
    }
    board.press(&Input::Resize(1, 1));
    for width in (1..140).step_by(3) {
        for height in 1..50 {
            let buffer = drawn(&board, 1.0, [width, height], Depth::Indexed);
            assert_eq!(buffer[(0, 0)].bg, Color::Red);
        }
    }
}

#[test]
fn a_scan_that_is_larger_than_any_screen_is_thinned_out() {
    let mut picture = super::picture::Picture::default();
    for i in 0..3000 {
        let live = LiveColumn {
            i,
            j_first: -2000,
            z_um: (0..4000).map(Some).collect(),
        };
        picture.push(&[live], i as u32 + 1, 3000);
    }
    assert!(picture.nodes() < 500_000, "{}", picture.nodes());
    assert!(picture.nodes() > 100_000, "{}", picture.nodes());
    let [low, high] = picture.z_mm().unwrap();
    assert!(
        (low - 0.04).abs() < 0.02 && (high - 3.96).abs() < 0.02,
        "{low} {high}"
    );
}
