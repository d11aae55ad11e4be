//! Newton's method on the contact law of an island, see [`super::law`].

use super::law::IslandLaw;
use crate::constraints::numerics::block_lu::BlockLu;
use crate::lanes::BodyRow;
use std::ops::Range;

/// Residual at which the law is solved, as a fraction of the impulses (1): rounding.
const TOLERANCE: f64 = 1e-10;
/// Most halvings of a Newton step.
const HALVINGS: usize = 8;
/// Sweeps in `f64` that replace a Newton step without improvement.
const SWEEPS: usize = 8;
/// Steps that leave more than half of the merit, after which Lemke's method is tried.
const PATIENCE: usize = 9;
/// Most points of an island for that.
const PIVOTED: usize = 64;

/// The impulses of an island, and their merit.
pub(crate) struct Island {
    /// The law.
    pub law: IslandLaw,
    /// Factors of the bodies' matrix, in its order.
    factors: BlockLu<3>,
    /// λ (N·s). `[rows]`
    pub impulses: Vec<f64>,
    arguments: Vec<f64>,
    merit: f64,
    /// No improvement was found.
    done: bool,
    /// Steps that left more than half of the merit.
    stalls: usize,
    /// Whether Lemke's method was tried.
    pivoted: bool,
}

impl Island {
    /// Starts at the impulses of the law.
    pub fn new(mut law: IslandLaw) -> Self {
        law.couple();
        let mut factors = BlockLu::default();
        factors.begin(law.movable, |body| law.couplings.of(body));
        let impulses = law.start.clone();
        let arguments = law.arguments(&impulses);
        let merit = law.merit(&impulses, &arguments);
        Island { law, factors, impulses, arguments, merit, done: false, stalls: 0, pivoted: false }
    }

    /// Accepts these impulses if their merit is below `part` times the current merit.
    fn take(&mut self, impulses: Vec<f64>, part: f64) -> bool {
        let arguments = self.law.arguments(&impulses);
        let merit = self.law.merit(&impulses, &arguments);
        // False if the merit is NaN.
        let better = merit < part * self.merit;
        if better {
            (self.impulses, self.arguments, self.merit) = (impulses, arguments, merit);
        }
        better
    }

    /// One step that reduces the residual, if there is one: Newton's, or sweeps, or Lemke's method in small
    /// islands. Returns whether it improved.
    pub fn step(&mut self) -> bool {
        self.done |= self.is_solved(TOLERANCE);
        if self.done {
            return false;
        }
        let before = self.merit;
        let found = (self.stalls >= PATIENCE && self.pivot(PIVOTED)) || self.search() || self.sweep();
        self.stalls += usize::from(self.merit > 0.5 * before);
        self.done |= !found;
        found
    }

    /// At most this many Newton steps, or sweeps where these do not improve. Returns whether the residual is below this
    /// fraction of the impulses.
    pub fn solve(&mut self, steps: usize, tolerance: f64) -> bool {
        for _ in 0..steps {
            if self.is_solved(1e-3 * tolerance) || !(self.search() || self.sweep()) {
                break;
            }
        }
        self.is_solved(tolerance)
    }

    /// Whether the residual is below this fraction of the impulses.
    fn is_solved(&self, tolerance: f64) -> bool {
        self.merit <= self.law.goal(&self.impulses, tolerance)
    }

    /// A Newton step, halved until the residual falls.
    fn search(&mut self) -> bool {
        let states = self.law.states(&self.arguments);
        let Some(target) = self.law.solve_states(&states, &mut self.factors) else { return false };
        let mut fraction = 1.0;
        (0..HALVINGS).any(|_| {
            let blend = |(l, t): (&f64, &f64)| l + fraction * (t - l);
            let trial = self.impulses.iter().zip(&target).map(blend).collect();
            // The directional derivative of the merit along a Newton step is −2 merit.
            let found = self.take(trial, 1.0 - 2e-4 * fraction);
            fraction *= 0.5;
            found
        })
    }

    /// More sweeps, accepted if they improve the merit: then the states change.
    fn sweep(&mut self) -> bool {
        let mut impulses = self.impulses.clone();
        (0..SWEEPS).for_each(|_| self.law.sweep(&mut impulses));
        self.take(impulses, 1.0)
    }

    /// Tries Lemke's method once, if the island has at most `points` points. Accepts its solution if it
    /// improves the merit.
    pub fn pivot(&mut self, points: usize) -> bool {
        if std::mem::replace(&mut self.pivoted, true) || self.law.points.len() > points {
            return false;
        }
        self.law.by_lemke().is_some_and(|found| self.take(found, 1.0))
    }

    /// Takes over the impulses of these rows, those of a joint block, and applies their changes to `bodies`.
    pub fn push(&self, rows: Range<usize>, impulses: &mut [f32], bodies: &mut [BodyRow]) {
        for ((new, row), old) in self.impulses[rows.clone()].iter().zip(&self.law.rows[rows]).zip(impulses) {
            let change = *new as f32 - std::mem::replace(old, *new as f32);
            for (body, j) in row.bodies.into_iter().zip(row.jacobian) {
                let Some(on) = bodies.get_mut(body as usize) else { continue };
                let roots = [on.velocity[3], on.velocity[3], on.delta[3]].map(f32::sqrt);
                (0..3).for_each(|c| on.velocity[c] += roots[c] * j[c] as f32 * change);
            }
        }
    }
}
