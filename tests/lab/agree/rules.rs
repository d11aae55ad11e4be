//! How sources treat gaps: rules of normal rows, and corrections of positions.

use super::Model;
use simpulse::lab::reference::oracle::{GapRule, Line, SidesOfPoint};
use std::f64::consts::TAU;

/// How a normal row treats the gap s.
#[derive(Clone, Copy, Debug)]
pub enum ScalarRule {
    /// A gap may close; overlap is not corrected.
    Rigid,
    /// As [`ScalarRule::Rigid`], but a gap counts as closed: the rows of sources without speculative
    /// contacts.
    Closed,
    /// b = max(β (s + slop)/h, −cap) (`baumgarte1972`): β (1), slop (m), cap (m/s).
    Baumgarte(f64, f64, f64),
    /// Soft contacts (`catto2011`).
    Soft(ScalarSpring),
    /// As [`ScalarRule::Rigid`], and the fraction β of an overlap smaller than a limit (m) is corrected
    /// (`coumans2015`).
    Shallow(f64, f64),
    /// Corrects the fraction β of an overlap larger than a limit (m); shallower points have no row.
    Deep(f64, f64),
    /// The target of a point that bounces, v_n ≥ u; other rules leave its row alone.
    Rebound,
    /// v_n ≥ 0 at points with a gap below a slop (m); other points have no row.
    Touching(f64),
}

/// Parameters of soft contacts.
#[derive(Clone, Copy, Debug)]
pub struct ScalarSpring {
    /// ω (rad/s) between dynamic bodies; twice that against other bodies.
    pub omega: f64,
    /// ζ (1)
    pub damping: f64,
    /// Push speed limit (m/s).
    pub cap: f64,
    /// Whether the cap applies to γ_m β s (`catto2024box2d`) or to β s (`catto2024solver2d`).
    pub scaled: bool,
    /// Whether the leak of a capped push is reduced in the same proportion, so that a load is carried at any
    /// depth (`shim`).
    pub carries: bool,
}

impl ScalarSpring {
    /// From a frequency of `hertz` (Hz), limited to `share` of the substep rate; `h` is the substep (s).
    pub fn new(hertz: f64, share: f64, damping: f64, cap: f64, h: f64) -> Self {
        ScalarSpring { omega: TAU * hertz.min(share / h), damping, cap, scaled: true, carries: false }
    }
}

/// Whether one side of point `i` is not dynamic.
fn against_static(model: &Model, i: usize) -> bool {
    let c = &model.problem.contacts[i];
    let dynamic = |b: u32| model.problem.bodies[b as usize].inverse() != [0.0; 3];
    [c.body_a, c.body_b].into_iter().any(|body| !body.is_some_and(dynamic))
}

impl GapRule for ScalarRule {
    fn line(self, model: &Model, i: usize) -> Line {
        let (s, h, rigid) = (model.place(i)[0], model.h, Line::rigid);
        let u = model.problem.contacts[i].rebound;
        match self {
            ScalarRule::Rebound => rigid(-u),
            _ if u != 0.0 => Line { scale: 0.0, ..rigid(0.0) },
            ScalarRule::Closed => rigid(0.0),
            ScalarRule::Touching(slop) => Line { scale: if s < slop { 1.0 } else { 0.0 }, ..rigid(0.0) },
            ScalarRule::Deep(share, limit) if s < -limit => rigid(share * s / h),
            ScalarRule::Deep(..) => Line { scale: 0.0, ..rigid(0.0) },
            _ if s > 0.0 => rigid(s / h),
            ScalarRule::Shallow(share, limit) => rigid(if s > -limit { share * s / h } else { 0.0 }),
            ScalarRule::Rigid => rigid(0.0),
            ScalarRule::Baumgarte(share, slop, cap) => rigid((share * (s + slop).min(0.0) / h).max(-cap)),
            ScalarRule::Soft(ScalarSpring { omega, damping, cap, scaled, carries }) => {
                let omega = if against_static(model, i) { 2.0 * omega } else { omega };
                let rate = omega / (2.0 * damping + h * omega);
                let a = h * omega * (2.0 * damping + h * omega);
                let (scale, leak) = (a / (1.0 + a), 1.0 / (1.0 + a));
                let wanted = -scale * rate * s;
                let push = if scaled { wanted.min(cap) } else { scale * (-rate * s).min(cap) };
                let leak = if carries && wanted > cap { leak * cap / wanted } else { leak };
                Line { push: -push, scale, keep: 1.0 - leak }
            }
        }
    }
}

/// Nonlinear Gauss–Seidel on positions: corrects the fraction `share` of an overlap beyond `slop` (m), by
/// at most `most` (m).
pub fn positions(model: &mut Model, share: f64, slop: f64, most: f64, turned: bool) {
    for i in 0..model.l.len() {
        let error = (share * (model.place(i)[0] + slop)).clamp(-most, 0.0);
        let rows = model.rows(i, turned);
        model.displace(&rows, 0, -error * model.mass(&rows, 0));
    }
}

/// As [`positions`] on turned arms, with both points of a manifold together (`catto2024solver2d`):
/// C + K p ≥ 0 with p ≥ 0, by its four cases.
pub fn positions_in_pairs(model: &mut Model, share: f64, slop: f64, most: f64) {
    for m in model.manifolds.clone() {
        let error = |model: &Model, i: usize| (share * (model.place(i)[0] + slop)).clamp(-most, 0.0);
        let rows: Vec<SidesOfPoint> = m.clone().map(|i| model.rows(i, true)).collect();
        let c: Vec<f64> = m.clone().map(|i| error(model, i)).collect();
        let k = |a: usize, b: usize| model.coupling((&rows[a], 0), (&rows[b], 0));
        let p = match c[..] {
            [c] => vec![-c / k(0, 0)],
            _ => {
                let (a, b, d) = (k(0, 0), k(0, 1), k(1, 1));
                let det = a * d - b * b;
                let cases = [
                    [(b * c[1] - d * c[0]) / det, (b * c[0] - a * c[1]) / det],
                    [-c[0] / a, 0.0],
                    [0.0, -c[1] / d],
                    [0.0, 0.0],
                ];
                let holds = |p: &&[f64; 2]| {
                    let w = [c[0] + a * p[0] + b * p[1], c[1] + b * p[0] + d * p[1]];
                    (0..2).all(|i| p[i] >= 0.0 && w[i] >= -1e-12)
                };
                cases.iter().find(holds).unwrap_or(&cases[3]).to_vec()
            }
        };
        rows.iter().zip(p).for_each(|(rows, p)| model.displace(rows, 0, p));
    }
}
