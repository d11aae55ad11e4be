//! Mutations of raw text, which use only the characters of JSON and not its structure.

use super::harness::Random;
use rand::RngExt;

/// Fragments that readers treat specially, or names of fields and values.
#[rustfmt::skip]
const WORDS: &[&str] = &[
    "{", "}", "[", "]", ",", ":", "\"", "\\", "\\u0000", "\\ud800", "\\n", "\n", "\r\n", "\0", "\t",
    "\u{7f}", "\u{feff}", "\u{2028}", "µ", "/", "=", "null", "true", "NaN", "Infinity", "-", "-0", "-0.0",
    "0", "1e308", "1e309", "-1e999", "1e-308", "5e-324", "1e-999", "1e39", "1e-46", "9007199254740993",
    "18446744073709551616", "4294967296", "-1", "1e9", "1e-9", "0.5", "\"name\"", "\"gravity\"", "\"dt\"",
    "\"steps\"", "\"bodies\"", "\"type\"", "\"dynamic\"", "\"static\"", "\"kinematic\"", "\"position\"",
    "\"angle\"", "\"velocity\"", "\"angular_velocity\"", "\"gravity_scale\"", "\"linear_damping\"",
    "\"angular_damping\"", "\"group\"", "\"shapes\"", "\"circle\"", "\"box\"", "\"polygon\"", "\"capsule\"",
    "\"segment\"", "\"half\"", "\"radius\"", "\"center\"", "\"points\"", "\"density\"", "\"friction\"",
    "\"restitution\"", "\"version\"", "\"bytes\"", "\"checksum\"", "\"reference\"", "[[[[[[[[",
    "{\"a\":{\"a\":", "1e", ".5", "+1", "0x10", "um", "mm", " m", "e",
];

/// A parent with one to five mutations.
pub fn mutate(random: &mut Random, corpus: &[Vec<u8>]) -> Vec<u8> {
    let mut text = pick(random, corpus).clone();
    let changes = if random.random() { 1 } else { random.random_range(2..=5) };
    for _ in 0..changes {
        change(random, &mut text, corpus);
    }
    text
}

pub fn pick<'a, T>(random: &mut Random, of: &'a [T]) -> &'a T {
    &of[random.random_range(0..of.len())]
}

/// [`pick`] by value.
pub fn one<T: Copy>(random: &mut Random, of: &[T]) -> T {
    *pick(random, of)
}

fn change(random: &mut Random, text: &mut Vec<u8>, corpus: &[Vec<u8>]) {
    if text.is_empty() {
        text.extend(pick(random, WORDS).bytes());
        return;
    }
    let at = random.random_range(0..text.len());
    let longest = 1 << random.random_range(0..8);
    let slice = at..(at + random.random_range(1..=longest)).min(text.len());
    match random.random_range(0..12) {
        0 => text[at] ^= 1 << random.random_range(0..8),
        1 => text[at] = random.random(),
        2 => text[at] = one(random, b"{}[],:\"\\0123456789eE+-. \n"),
        3..=4 => drop(text.splice(at..at, pick(random, WORDS).bytes())),
        5 => drop(text.drain(slice)),
        6 => {
            let copy = text[slice.clone()].to_vec();
            // Usually once, occasionally so often that brackets nest or lists grow.
            let times = if random.random_ratio(1, 20) { random.random_range(1..400) } else { 1 };
            text.splice(slice.end..slice.end, copy.repeat(times));
        }
        7 => {
            let piece: Vec<u8> = text.drain(slice).collect();
            let to = random.random_range(0..=text.len());
            text.splice(to..to, piece);
        }
        8 if random.random_ratio(1, 4) => text.truncate(at),
        9 => {
            // The beginning of one parent and the end of another.
            let other = pick(random, corpus);
            let from = random.random_range(0..=other.len());
            text.truncate(at);
            text.extend(&other[from..]);
        }
        _ => {
            // A fragment instead of a number.
            let is_digit = |b: &u8| b"0123456789.eE+-".contains(b);
            let Some(begin) = text[at..].iter().position(is_digit).map(|i| at + i) else { return };
            let end = text[begin..].iter().position(|b| !is_digit(b)).map_or(text.len(), |i| begin + i);
            text.splice(begin..end, pick(random, WORDS).bytes());
        }
    }
}
