//! Damage to files, drawn from a seed.

use std::io;
use std::ops::Range;

use anyhow::Result;

use super::Dice;
use super::seeds::{self, Seed, gzip};

/// What numbers in text are replaced by.
const WORDS: [&str; 22] = [
    "0",
    "-0",
    "1",
    "-1",
    "4000000000",
    "4294967295",
    "18446744073709551615",
    "2147483647",
    "-2147483648",
    "1e9",
    "1e308",
    "-1e308",
    "1e999",
    "1e-320",
    "nan",
    "inf",
    "99999H",
    "",
    ",",
    "1,5",
    "65535",
    "9223372036854775807",
];
/// What bytes in binary files are replaced by.
const BYTES: [[u8; 8]; 6] = [
    [0xff; 8],
    [0; 8],
    [0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 0x7f],
    [0, 0, 0, 0, 0, 0, 0xf0, 0x7f],
    [0, 0, 0xc0, 0x7f, 0, 0, 0xf8, 0x7f],
    [0x7f, 0xef, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff],
];
/// Files do not grow beyond this by duplication, bytes.
const LONGEST: usize = 4 << 20;

/// A damaged file.
#[derive(Debug, Clone)]
pub struct Mutant {
    /// The format of the sound file.
    pub format: &'static str,
    /// The content.
    pub bytes: Vec<u8>,
}

/// The damaged file of this number: the same number gives the same bytes.
///
/// # Errors
/// When a journal cannot be written.
pub fn mutant(seeds: &[Seed], number: u64) -> Result<Mutant> {
    let mut dice = Dice::new(number);
    let seed = &seeds[dice.below(seeds.len())];
    let mut bytes = seed.bytes.clone();
    if seed.name == "journal" && !dice.once_in(3) {
        bytes = seeds::journal(&mut dice, true)?;
    }
    let packed = dice.once_in(4);
    // Damage below the compression, above it, or both.
    let below = !packed || !dice.once_in(3);
    if below {
        damage(&mut bytes, seeds, &mut dice);
    }
    if packed {
        bytes = gzip_some(&bytes, &mut dice)?;
        if !below || dice.once_in(4) {
            damage(&mut bytes, seeds, &mut dice);
        }
    }
    Ok(Mutant {
        format: seed.name,
        bytes,
    })
}

fn gzip_some(bytes: &[u8], dice: &mut Dice) -> io::Result<Vec<u8>> {
    let mut packed = gzip(bytes)?;
    while dice.once_in(6) {
        packed = gzip(&packed)?;
    }
    Ok(packed)
}

fn damage(bytes: &mut Vec<u8>, seeds: &[Seed], dice: &mut Dice) {
    // Much damage is found at once; a little of it goes further.
    let times = if dice.once_in(2) {
        1
    } else {
        1 + dice.below(4)
    };
    for _ in 0..times {
        once(bytes, seeds, dice);
    }
}

fn once(bytes: &mut Vec<u8>, seeds: &[Seed], dice: &mut Dice) {
    let at = dice.below(bytes.len());
    match dice.below(16) {
        0 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << dice.below(8);
            }
        }
        1 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte = dice.number() as u8;
            }
        }
        2 => bytes.truncate(at),
        3 => {
            let chunk = chunk(bytes, dice);
            bytes.drain(chunk);
        }
        4 => {
            let copy = bytes[chunk(bytes, dice)].to_vec();
            let copies = if dice.once_in(4) {
                1 + dice.below(400)
            } else {
                1
            };
            let room = LONGEST.saturating_sub(bytes.len()) / copy.len().max(1);
            bytes.splice(at..at, copy.repeat(copies.min(room)));
        }
        5 => {
            let other = &seeds[dice.below(seeds.len())].bytes;
            let part = other[chunk(other, dice)].to_vec();
            let place = chunk(bytes, dice);
            bytes.splice(place, part);
        }
        6 => {
            let noise: Vec<u8> = (0..dice.below(64)).map(|_| dice.number() as u8).collect();
            bytes.splice(at..at, noise);
        }
        7 => {
            let odd = dice.pick(&BYTES).unwrap_or_default();
            let width = dice.pick(&[2, 4, 8]).unwrap_or(4).min(bytes.len() - at);
            bytes[at..at + width].copy_from_slice(&odd[..width]);
        }
        8 => {
            let line_end = dice
                .pick(&[&b"\r\n"[..], b"\r", b"", b"\n\n"])
                .unwrap_or(b"");
            *bytes = bytes
                .split(|b| *b == b'\n')
                .collect::<Vec<_>>()
                .join(line_end);
        }
        // The likeliest, since it is what comes past the first checks.
        _ => {
            if let Some(number) = number_after(bytes, at) {
                let word = dice.pick(&WORDS).unwrap_or_default();
                if dice.once_in(3) {
                    bytes.splice(number, word.bytes());
                } else {
                    in_place(bytes, number, word);
                }
            }
        }
    }
}

/// Columns count in some formats: the word takes the number's place, and what follows it
/// on the line where it is longer.
fn in_place(bytes: &mut [u8], number: Range<usize>, word: &str) {
    let filled = word.bytes().chain(std::iter::repeat(b' '));
    let length = word.len().max(number.len());
    let rest = bytes.iter_mut().skip(number.start).take(length);
    for (byte, new) in rest.take_while(|b| !b.is_ascii_control()).zip(filled) {
        *byte = new;
    }
}

fn chunk(bytes: &[u8], dice: &mut Dice) -> Range<usize> {
    let from = dice.below(bytes.len());
    let most = if dice.once_in(3) { bytes.len() } else { 200 };
    from..(from + dice.below(most)).min(bytes.len())
}

/// The next decimal number.
fn number_after(bytes: &[u8], at: usize) -> Option<Range<usize>> {
    let is_part = |b: &u8| b.is_ascii_digit() || matches!(b, b'-' | b'.');
    let from = at + bytes.get(at..)?.iter().position(is_part)?;
    let length = bytes.get(from..)?.iter().take_while(|b| is_part(b)).count();
    Some(from..from + length)
}
