//! Loads of a contact problem, and norms for its errors.

use super::problem::{ContactProblem, ProblemBody, Velocity};

impl ContactProblem {
    /// M (v* − v): the impulse of forces on each body during the step (N·s, N·s, N·m·s). Zero for components
    /// of infinite mass.
    pub fn loads(&self) -> Vec<Velocity> {
        let change = |b: &ProblemBody| {
            let m = masses(b);
            [0, 1, 2].map(|k| m[k] * (b.free_velocity[k] - b.velocity[k]))
        };
        self.bodies.iter().map(change).collect()
    }

    /// h times the sum of weights (N·s): ∑ |m (v* − v)|. Zero without forces.
    pub fn total_load(&self) -> f64 {
        self.loads().iter().map(|p| p[0].hypot(p[1])).sum()
    }

    /// The impulse by which residuals are divided (N·s): h m g of the heaviest body, max |m (v* − v)|.
    /// Without forces max |m v*|; 1 if nothing moves.
    pub fn impulse_unit(&self) -> f64 {
        let largest = |p: Vec<Velocity>| p.iter().map(|p| p[0].hypot(p[1])).fold(0.0, f64::max);
        let momenta = self.bodies.iter().map(|b| {
            let m = masses(b);
            [0, 1, 2].map(|k| m[k] * b.free_velocity[k])
        });
        [largest(self.loads()), largest(momenta.collect())].into_iter().find(|&u| u > 0.0).unwrap_or(1.0)
    }

    /// √(vᵀ M v) over components of finite mass (√J·√2).
    pub fn mass_norm(&self, velocities: &[Velocity]) -> f64 {
        let square = |(b, v): (&ProblemBody, &Velocity)| {
            let m = masses(b);
            m[0] * v[0] * v[0] + m[1] * v[1] * v[1] + m[2] * v[2] * v[2]
        };
        self.bodies.iter().zip(velocities).map(square).sum::<f64>().sqrt()
    }

    /// ‖v − w‖ in the mass norm, relative to max(‖w‖, ‖v* − v_start‖). The second norm represents √m g h, so
    /// that a reference at rest does not make every error infinite.
    pub fn velocity_error(&self, velocities: &[Velocity], reference: &[Velocity]) -> f64 {
        let minus = |a: &[Velocity], b: &[Velocity]| -> Vec<Velocity> {
            a.iter().zip(b).map(|(a, b)| [0, 1, 2].map(|k| a[k] - b[k])).collect()
        };
        let free: Vec<Velocity> = self.bodies.iter().map(|b| b.free_velocity).collect();
        let start: Vec<Velocity> = self.bodies.iter().map(|b| b.velocity).collect();
        let scale = self.mass_norm(reference).max(self.mass_norm(&minus(&free, &start)));
        let error = self.mass_norm(&minus(velocities, reference));
        if error == 0.0 { 0.0 } else { error / scale }
    }
}

/// Finite masses of a body; zero for infinite ones, whose components cannot change.
fn masses(b: &ProblemBody) -> Velocity {
    // The reciprocal of the smallest numbers is infinite, too.
    let inverse = |x: f64| if x > 0.0 && x.recip().is_finite() { x.recip() } else { 0.0 };
    [inverse(b.inv_mass), inverse(b.inv_mass), inverse(b.inv_inertia)]
}
