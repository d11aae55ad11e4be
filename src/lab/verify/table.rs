//! The list of cases.

use super::{
    Case, balance, bullets, carried, changes, columns, far, flight, impacts, joined, limits, motion, overlap,
    pairs, paradox, pendulums, ratios, rocking, slender, sliding, springs, stacks, sudden, together,
};
use std::sync::LazyLock;

/// Every case, sorted by family. The rows of a group are in its own file.
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
        joined::CASES,
        limits::CASES,
        motion::CASES,
        overlap::CASES,
        pairs::CASES,
        paradox::CASES,
        pendulums::CASES,
        ratios::CASES,
        rocking::CASES,
        slender::CASES,
        sliding::CASES,
        springs::CASES,
        stacks::CASES,
        sudden::CASES,
        together::CASES,
    ];
    let mut cases: Vec<&Case> = groups.into_iter().flatten().collect();
    cases.sort_by_key(|case| family(case.id));
    cases
});

/// The letter and the number before the dot of an id.
fn family(id: &str) -> (&str, u32) {
    let (family, _) = id.split_once('.').expect("an id is a family and a name");
    let (letter, number) = family.split_at(1);
    (letter, number.parse().expect("a family is a letter and a number"))
}
