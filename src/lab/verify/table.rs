//! The list of cases.

use super::{
    Case, balance, bullets, carried, changes, columns, far, flight, impacts, limits, motion, overlap, pairs,
    paradox, ratios, rocking, slender, sliding, stacks, sudden, together,
};
use std::sync::LazyLock;

/// Hard cases that need joints or springs, which the crate does not have: listed as skipped.
pub static NEEDS_JOINTS: &[(&str, &str)] = &[
    ("A9", "oscillator damped by Coulomb friction"),
    ("A10", "block on a belt, held by a spring"),
    ("A13", "falling rod on a pin"),
    ("A14", "pendulum of large amplitude"),
    ("A15", "double pendulum"),
    ("B16", "hanging chain"),
    ("B17", "tension of a chain with a ball"),
    ("B20", "bridge of 160 links"),
];

/// Every case, by family. The rows of a group are in its file.
pub static CASES: LazyLock<Vec<&'static Case>> = LazyLock::new(|| {
    let groups = [
        balance::CASES,
        bullets::CASES,
        carried::CASES,
        changes::CASES,
        columns::CASES,
        far::CASES,
        flight::CASES,
        impacts::CASES,
        limits::CASES,
        motion::CASES,
        overlap::CASES,
        pairs::CASES,
        paradox::CASES,
        ratios::CASES,
        rocking::CASES,
        slender::CASES,
        sliding::CASES,
        stacks::CASES,
        sudden::CASES,
        together::CASES,
    ];
    let mut cases: Vec<&Case> = groups.into_iter().flatten().collect();
    cases.sort_by_key(|case| family(case.id));
    cases
});

/// The letter and the number before the dot.
fn family(id: &str) -> (&str, u32) {
    let (family, _) = id.split_once('.').expect("an id is a family and a name");
    let (letter, number) = family.split_at(1);
    (letter, number.parse().expect("a family is a letter and a number"))
}
