//! An interior-point method on the contact law in the plane, for problems on which sweeps and Newton's method stall.
//!
//! With λn = α₊ + α₋, λt = µ (α₊ − α₋) and ut = p − q the law (de Saxcé & Feng 1998) is three complementary pairs:
//!
//! ```text
//! 0 ≤ α₊ ⊥ w₊ = un + 2µ p ≥ 0,   0 ≤ α₋ ⊥ w₋ = un + 2µ q ≥ 0,   0 ≤ p ⊥ q ≥ 0
//! ```
//!
//! since un + µ |ut| ± µ ut are 2µ p and 2µ q beyond un. Every product is set to σ; a Newton step eliminates what belongs to one contact,
//!
//! ```text
//! dp = (c − p r)/(p + q) + p/(p + q) dut,   dα₊ = c₊/w₊ − k₊ (dun + 2µ dp − r₊),   k₊ = α₊/w₊
//! G = [ k₊ + k₋             2µ (k₊ p − k₋ q)/(p + q)  ]
//!     [ µ (k₊ − k₋)         2µ² (k₊ p + k₋ q)/(p + q) ]
//! (M + Jᵀ G J) dv = Jᵀ (λ + dλ₀) − M (v − v*)
//! ```
//!
//! so that a sparse system with three rows per body is left, whatever the number of contacts.
//!
//! **Source**: Acary, Armand, Nguyen & Shpakovych 2023 (`acary2023`), in the plane, where second-order cones are wedges.
//! **Departures**: σ follows the last step: the law is not monotone, and a step that ends at once leads back to the middle of the cone. The path
//! ends at products of 10⁻¹¹, as λ = σ/w loses digits beyond; [`mod@super::newton`] goes on in the states that are found.
//! **Fails when** the path meets no solution (Painlevé's rod may have none).

use super::problem::{ContactProblem, DPair, Velocity};
use super::residual::Target;
use super::sparse;

/// Most steps.
const STEPS: usize = 150;
/// Mean product at which the path ends, relative to the first.
const GOAL: f64 = 1e-11;
/// Part of the way to the boundary that a step may go.
const INSIDE: f64 = 0.99;
/// σ over the mean product, by the length of the last step.
const CENTERING: [(f64, f64); 4] = [(0.5, 0.1), (0.1, 0.5), (0.02, 1.0), (0.0, 3.0)];

/// α₊, α₋, w₊, w₋, p, q of one contact.
type Pairs = [f64; 6];

/// The step of one contact as a function of the change of its velocity.
struct LocalStep {
    /// dp and dq without dut, and their factors of it.
    constant: [f64; 2],
    factor: [f64; 2],
    /// r₊ and r₋, c₊ and c₋.
    rest: [f64; 2],
    goal: [f64; 2],
}

/// Impulses near a solution; none if a system cannot be solved.
pub fn interior_point(problem: &ContactProblem) -> Option<Vec<DPair>> {
    let target: Vec<f64> = (0..problem.contacts.len()).map(|i| Target::Rigid.row(problem, i).bias).collect();
    let fastest = problem.bodies.iter().flat_map(|b| b.free_velocity).fold(0.0, |m: f64, v| m.max(v.abs()));
    let speed = if fastest > 0.0 { fastest } else { 1.0 };
    let unit = problem.impulse_unit();
    let mut velocities: Vec<Velocity> = problem.bodies.iter().map(|b| b.free_velocity).collect();
    let mut pairs: Vec<Pairs> = vec![[unit, unit, speed, speed, speed, speed]; problem.contacts.len()];
    let mut length = 1.0;
    for _ in 0..STEPS {
        let product =
            |x: &Pairs| (x[0] * x[2] + x[1] * x[3]) / (unit * speed) + x[4] * x[5] / (speed * speed);
        let mean = pairs.iter().map(product).sum::<f64>() / (3 * pairs.len()).max(1) as f64;
        if mean <= GOAL {
            break;
        }
        let centering = CENTERING.iter().find(|(least, _)| length > *least).map_or(3.0, |c| c.1);
        let sigma = centering * mean;
        let goals = [sigma * unit * speed, sigma * speed * speed];
        let (direction, changes) = newton_step(problem, &target, &velocities, &pairs, goals)?;
        length = 1.0;
        for (x, d) in pairs.iter().flatten().zip(changes.iter().flatten()).filter(|(_, d)| **d < 0.0) {
            length = f64::min(length, -INSIDE * x / d);
        }
        for (v, d) in velocities.iter_mut().zip(&direction) {
            (0..3).for_each(|k| v[k] += length * d[k]);
        }
        for (x, d) in pairs.iter_mut().flatten().zip(changes.iter().flatten()) {
            *x += length * d;
        }
    }
    let impulse = |(x, c): (&Pairs, &super::ProblemContact)| [x[0] + x[1], c.friction * (x[0] - x[1])];
    Some(pairs.iter().zip(&problem.contacts).map(impulse).collect())
}

/// Changes of velocities and of the pairs toward products of `goals`.
fn newton_step(
    problem: &ContactProblem,
    target: &[f64],
    velocities: &[Velocity],
    pairs: &[Pairs],
    [goal, slide]: [f64; 2],
) -> Option<(Vec<Velocity>, Vec<Pairs>)> {
    let n = 3 * problem.bodies.len();
    let (mut entries, mut right): (Vec<sparse::Triplet>, _) = (Vec::new(), vec![0.0; n]);
    for (b, body) in problem.bodies.iter().enumerate() {
        for (k, inverse) in [body.inv_mass, body.inv_mass, body.inv_inertia].into_iter().enumerate() {
            let mass = if inverse > 0.0 { 1.0 / inverse } else { 1.0 };
            entries.push((3 * b + k, 3 * b + k, mass));
            right[3 * b + k] -= mass * (velocities[b][k] - body.free_velocity[k]);
        }
    }
    // What has infinite mass stays as it is.
    let moves = |b: usize, k: usize| {
        let body = &problem.bodies[b];
        [body.inv_mass, body.inv_mass, body.inv_inertia][k] > 0.0
    };
    let mut locals = Vec::new();
    for ((contact, &[more, less, w_more, w_less, p, q]), bias) in
        problem.contacts.iter().zip(pairs).zip(target)
    {
        let ([vn, ut], mu) = (contact.velocity(velocities), contact.friction);
        let un = vn + bias;
        let (sum, open) = (p + q, p - q - ut);
        let rest = [w_more - un - 2.0 * mu * p, w_less - un - 2.0 * mu * q];
        let goals = [goal - more * w_more, goal - less * w_less];
        let left = slide - p * q;
        let constant = [(left - p * open) / sum, (left + q * open) / sum];
        let factor = [p / sum, -q / sum];
        let k = [more / w_more, less / w_less];
        let w = [w_more, w_less];
        let change = [0, 1].map(|s| goals[s] / w[s] - k[s] * (2.0 * mu * constant[s] - rest[s]));
        let impulse = [more + less + change[0] + change[1], mu * (more - less + change[0] - change[1])];
        let g = [
            [k[0] + k[1], 2.0 * mu * (k[0] * factor[0] + k[1] * factor[1])],
            [mu * (k[0] - k[1]), 2.0 * mu * mu * (k[0] * factor[0] - k[1] * factor[1])],
        ];
        for (a, rows) in contact.sides() {
            for r in (0..3).filter(|&r| moves(a, r)) {
                right[3 * a + r] += rows[0][r] * impulse[0] + rows[1][r] * impulse[1];
                let by = [0, 1].map(|d| rows[0][r] * g[0][d] + rows[1][r] * g[1][d]);
                for (b, columns) in contact.sides() {
                    for c in (0..3).filter(|&c| moves(b, c)) {
                        entries.push((3 * b + c, 3 * a + r, by[0] * columns[0][c] + by[1] * columns[1][c]));
                    }
                }
            }
        }
        locals.push(LocalStep { constant, factor, rest, goal: goals });
    }
    let x = sparse::solve(entries, &right)?;
    let direction: Vec<Velocity> = x.chunks_exact(3).map(|x| [x[0], x[1], x[2]]).collect();
    let change = |((contact, local), x): ((&super::ProblemContact, &LocalStep), &Pairs)| {
        let [dun, dut] = contact.velocity(&direction);
        let sliding = [0, 1].map(|s| local.constant[s] + local.factor[s] * dut);
        let w = [0, 1].map(|s| dun + 2.0 * contact.friction * sliding[s] - local.rest[s]);
        let a = [0, 1].map(|s| (local.goal[s] - x[s] * w[s]) / x[2 + s]);
        [a[0], a[1], w[0], w[1], sliding[0], sliding[1]]
    };
    let changes = problem.contacts.iter().zip(&locals).zip(pairs).map(change).collect();
    Some((direction, changes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::certify::{CERTIFIED, certify};
    use crate::lab::reference::gallery::*;
    use crate::lab::reference::newton::newton_after;
    use crate::lab::reference::sweeps::Stop;

    #[test]
    fn the_path_ends_near_a_solution_and_newton_s_method_at_it() {
        for p in [
            sliding_box(),
            block_on_incline(0.25, 0.24),
            heavy_on_light(1e3),
            box_pyramid(8, 0.6),
            disc_column(30),
        ] {
            let near = interior_point(&p).unwrap();
            let residual = certify(&p, &near);
            assert!(residual < 1e-4, "{}: {residual:e}", p.name);
            let stop = Stop { tolerance: 0.01 * CERTIFIED, iterations: 60 };
            let found = certify(&p, &newton_after(&p, Target::Rigid, &near, 0, stop).impulses);
            assert!(found <= CERTIFIED, "{}: {found:e}", p.name);
        }
    }
}
