//! Summary of convergence in sentences.

use super::replay::{Sequence, Start};
use super::{ConvergeReport, Reached, ReplayCurve, TOLERANCES};
use crate::engine::lanes::native_width;

/// Indices in [`TOLERANCES`] of the two tolerances in the summary.
const TOLD: [usize; 2] = [1, 3];

/// Sweeps that each solver needs to 1e-2 and to 1e-4, cold and warm, next to the rate of Gauss–Seidel. Whole
/// schedules in colored order.
pub fn text(report: &ConvergeReport) -> String {
    let own: Vec<&ReplayCurve> = report
        .curves
        .iter()
        .filter(|c| c.arithmetic == "f32" && c.order == Sequence::Colored && !c.is_part)
        .collect();
    let emulated = if report.lanes > native_width().lanes() { ", emulated" } else { "" };
    let mut text =
        format!("In colored order ({} lanes{emulated}), against the rigid contact law:\n", report.lanes);
    for at in TOLD {
        for start in [Start::Cold, Start::Warm] {
            text += &sentence(&own, at, start);
        }
    }
    let changed = || own.iter().copied().filter(|c| !c.own_is_rigid && c.start == Start::Cold);
    if changed().next().is_some() {
        let each = changed().map(|c| {
            let sweeps = TOLD.map(|at| match to(c, &c.own, at) {
                Some(n) => format!("{n} to {:.0e}", TOLERANCES[at]),
                None => format!("none to {:.0e}", TOLERANCES[at]),
            });
            format!("{} {}", c.solver, sweeps.join(", "))
        });
        let list: Vec<String> = each.collect();
        text += &format!(
            "Sweeps to a solver's own law, if it differs from the rigid law, cold: {}.\n",
            list.join("; ")
        );
    }
    text + &baseline(report, &own)
}

/// Sweeps to a tolerance.
fn to(curve: &ReplayCurve, law: &Reached, at: usize) -> Option<usize> {
    law.first[at].map(|i| curve.points[i].sweeps)
}

fn sentence(curves: &[&ReplayCurve], at: usize, start: Start) -> String {
    let own = || curves.iter().filter(|c| c.start == start);
    let mut reached: Vec<(usize, &str)> =
        own().filter_map(|c| Some((to(c, &c.rigid, at)?, c.solver.as_str()))).collect();
    reached.sort();
    let never: Vec<&str> = own().filter(|c| c.rigid.first[at].is_none()).map(|c| c.solver.as_str()).collect();
    if own().next().is_none() {
        return String::new();
    }
    let goal = format!("{:.0e}, {start}", TOLERANCES[at]);
    let mut text = match reached.as_slice() {
        [] => format!("To {goal}: no solver reaches it"),
        [(least, _), ..] => {
            let first: Vec<&str> = reached.iter().filter(|r| r.0 == *least).map(|r| r.1).collect();
            let when = match least {
                0 => "at the start".to_string(),
                1 => "in 1 sweep".to_string(),
                n => format!("in {n} sweeps"),
            };
            let mut text = format!("To {goal}: {} {when}", first.join(", "));
            let others: Vec<String> =
                reached.iter().filter(|r| r.0 > *least).map(|(n, name)| format!("{name} {n}")).collect();
            if !others.is_empty() {
                text += &format!("; then {}", others.join(", "));
            }
            text
        }
    };
    if !never.is_empty() && !reached.is_empty() {
        text += &format!("; never {}", never.join(", "));
    }
    text + ".\n"
}

/// Measured rates, compared with that of Gauss–Seidel.
fn baseline(report: &ConvergeReport, curves: &[&ReplayCurve]) -> String {
    let Some(rate) = report.gauss_seidel_rate else {
        return "Gauss–Seidel in f64 has no rate here: it never converges, or at once.\n".into();
    };
    let sweeps = |tolerance: f64| (tolerance.ln() / rate.ln()).ceil();
    let mut text = format!(
        "Gauss–Seidel in f64, in the problem's order and from zero, has an asymptotic rate of {rate:.4} per sweep"
    );
    if rate < 1.0 {
        text += &format!(", {:.0} sweeps to 1e-2 and {:.0} to 1e-4", sweeps(1e-2), sweeps(1e-4));
    }
    let measured: Vec<String> = curves
        .iter()
        .filter(|c| c.start == Start::Cold && c.own_is_rigid)
        .filter_map(|c| Some(format!("{} {:.4}", c.solver, c.rigid.rate?)))
        .collect();
    match measured.as_slice() {
        [] => text + ".\n",
        list => format!("{text}; measured per iteration: {}.\n", list.join(", ")),
    }
}
