//! The velocity-level contact problem of one step, in `f64`.
//!
//! Bodies have velocities v = (vx, vy, w) and the mass matrix M = diag(m, m, I). Contact `i`
//! has a unit normal n from a to b, the tangent t = (n_y, −n_x), and arms r × n and r × t from
//! each center of mass to the contact point. The velocity of b relative to a at the point,
//!
//! ```text
//! un = n·(v_b + w_b ẑ × r_b) − n·(v_a + w_a ẑ × r_a) = n·v_b + (r_b × n) w_b − n·v_a − (r_a × n) w_a,
//! ```
//!
//! is the row (−n, −r_a × n | n, r_b × n) of J times (v_a | v_b); the tangential row has t instead of n. A
//! step seeks impulses λ, one (normal, tangential) pair per contact, and velocities
//!
//! ```text
//! v⁺ = v* + M⁻¹ Jᵀ λ,      v* = v + h M⁻¹ f,
//! ```
//!
//! that obey the contact law of [`crate::lab::reference::residual`]. G = J M⁻¹ Jᵀ is the Delassus matrix.
//! Joints have their own rows and laws: [`crate::lab::reference::joints`].

use super::rows::{OwnRow, ProblemJoint};
pub use crate::engine::constraints::numerics::coulomb_lcp::DPair;
use serde::{Deserialize, Serialize};

/// Velocity of a body: (m/s, m/s, rad/s).
pub type Velocity = [f64; 3];
/// Normal and tangential row of one side of a contact, sign included: (1, 1, m) each.
pub type SideRows = [Velocity; 2];

/// A body of a contact problem.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProblemBody {
    /// Inverse mass (1/kg); zero for a body with prescribed motion.
    pub inv_mass: f64,
    /// Inverse inertia (1/(kg·m²)) about the center of mass; zero if the body cannot rotate.
    pub inv_inertia: f64,
    /// Velocity at the start of the step.
    pub velocity: Velocity,
    /// Velocity v* at the end of the step without contacts.
    pub free_velocity: Velocity,
}

impl ProblemBody {
    /// Inverse masses of its three velocities (1/kg, 1/kg, 1/(kg·m²)).
    pub fn inverse(&self) -> Velocity {
        [self.inv_mass, self.inv_mass, self.inv_inertia]
    }

    /// Whether impulses change its motion.
    pub fn moves(&self) -> bool {
        self.inv_mass > 0.0 || self.inv_inertia > 0.0
    }

    /// Finite masses of its three velocities; zero for infinite ones, whose components cannot change.
    fn masses(&self) -> Velocity {
        // The reciprocal of the smallest numbers is infinite, too.
        self.inverse().map(|x| if x > 0.0 && x.recip().is_finite() { x.recip() } else { 0.0 })
    }
}

/// The right-hand side b of un = Jn v + b that a residual refers to.
///
/// "Does the result obey the contact law?" and "did the solver solve its own equations?" are different
/// questions. The type keeps their answers apart.
#[derive(Clone, Copy, Debug)]
pub enum Target<'a> {
    /// Rigid law: b = max(gap, 0)/h − rebound. Open contacts may close within the step, overlapping ones may
    /// not deepen.
    Rigid,
    /// The solver's own law: one row for every contact of the problem, then one for every joint row.
    Own(&'a [OwnRow]),
}

impl Target<'_> {
    /// Bias (m/s) and compliance (1/kg) at contact `i`.
    pub fn row(&self, problem: &ContactProblem, i: usize) -> OwnRow {
        match self {
            Target::Own(rows) => rows[i],
            Target::Rigid => {
                let c = &problem.contacts[i];
                OwnRow { bias: c.gap.max(0.0) / problem.h - c.rebound, compliance: 0.0 }
            }
        }
    }
}

/// A contact point of a contact problem.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProblemContact {
    /// Body a; `None` if that side is static.
    pub body_a: Option<u32>,
    /// Body b; `None` if that side is static.
    pub body_b: Option<u32>,
    /// Manifold number. Points of a manifold are neighbors in the list and share bodies and normal.
    pub manifold: u32,
    /// Unit normal from a to b.
    pub normal: [f64; 2],
    /// (r × n, r × t) from the center of mass of a to the point (m).
    pub arm_a: DPair,
    /// (r × n, r × t) from the center of mass of b to the point (m).
    pub arm_b: DPair,
    /// Signed distance at the start of the step (m); negative is overlap.
    pub gap: f64,
    /// Coulomb coefficient (1).
    pub friction: f64,
    /// Separation speed required by restitution (m/s), ≥ 0; zero for an inelastic contact.
    pub rebound: f64,
    /// Initial impulses of a warm-started solver (N·s).
    pub warm_impulse: DPair,
}

impl ProblemContact {
    /// A point without gap or rebound between two bodies, where `None` stands for a static one. `r` points
    /// from their centers of mass to the point (m).
    pub fn touching(
        bodies: [Option<u32>; 2],
        manifold: u32,
        normal: [f64; 2],
        r: [[f64; 2]; 2],
        friction: f64,
    ) -> Self {
        let arm = |k: usize| match bodies[k] {
            None => [0.0; 2],
            Some(_) => {
                let (r, t) = (r[k], [normal[1], -normal[0]]);
                [r[0] * normal[1] - r[1] * normal[0], r[0] * t[1] - r[1] * t[0]]
            }
        };
        let ([body_a, body_b], [arm_a, arm_b], warm_impulse) = (bodies, [arm(0), arm(1)], [0.0; 2]);
        let (gap, rebound) = (0.0, 0.0);
        ProblemContact {
            body_a,
            body_b,
            manifold,
            normal,
            arm_a,
            arm_b,
            gap,
            friction,
            rebound,
            warm_impulse,
        }
    }

    /// t = (n_y, −n_x).
    pub fn tangent(&self) -> [f64; 2] {
        [self.normal[1], -self.normal[0]]
    }

    /// Body and rows of J of each side; `None` for a static one.
    pub fn both_sides(&self) -> [Option<(usize, SideRows)>; 2] {
        let (n, t) = (self.normal, self.tangent());
        let side = |body: Option<u32>, arm: DPair, sign: f64| {
            let block = [[n[0], n[1], arm[0]], [t[0], t[1], arm[1]]];
            body.map(|b| (b as usize, block.map(|row| row.map(|x| sign * x))))
        };
        [side(self.body_a, self.arm_a, -1.0), side(self.body_b, self.arm_b, 1.0)]
    }

    /// The non-static sides, each with its body and its rows of J.
    pub fn sides(&self) -> impl Iterator<Item = (usize, SideRows)> + use<> {
        self.both_sides().into_iter().flatten()
    }

    /// The vectors r from both centers of mass to the point (m), recovered from the arms.
    ///
    /// Write r = α n + β t. Since t × n = 1, r × n = β and r × t = −α.
    pub fn anchors(&self) -> [[f64; 2]; 2] {
        let (n, t) = (self.normal, self.tangent());
        [self.arm_a, self.arm_b].map(|[rn, rt]| [-rt * n[0] + rn * t[0], -rt * n[1] + rn * t[1]])
    }

    /// (un, ut) = J v of this contact (m/s).
    pub fn velocity(&self, velocities: &[Velocity]) -> DPair {
        let mut u = [0.0; 2];
        for (body, block) in self.sides() {
            for (u, row) in u.iter_mut().zip(&block) {
                *u += dot(row, &velocities[body]);
            }
        }
        u
    }
}

/// Product of a row and velocities.
pub(super) fn dot(a: &Velocity, b: &Velocity) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The contact problem of one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactProblem {
    /// Name and origin.
    pub name: String,
    /// Step length (s), > 0.
    pub h: f64,
    /// Non-static bodies.
    pub bodies: Vec<ProblemBody>,
    /// Contact points, grouped by manifold.
    pub contacts: Vec<ProblemContact>,
    /// Joints, in the order of solving.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<ProblemJoint>,
}

impl ContactProblem {
    /// Adds M⁻¹ Jᵀ of one contact times `impulse` to the velocities.
    pub fn apply(&self, contact: &ProblemContact, impulse: DPair, velocities: &mut [Velocity]) {
        for (body, [n, t]) in contact.sides() {
            let inverse = self.bodies[body].inverse();
            for k in 0..3 {
                velocities[body][k] += inverse[k] * (n[k] * impulse[0] + t[k] * impulse[1]);
            }
        }
    }

    /// v⁺ = v* + M⁻¹ Jᵀ λ.
    pub fn velocities(&self, impulses: &[DPair]) -> Vec<Velocity> {
        let mut v: Vec<Velocity> = self.bodies.iter().map(|b| b.free_velocity).collect();
        for (c, &impulse) in self.contacts.iter().zip(impulses) {
            self.apply(c, impulse, &mut v);
        }
        self.push_joints(impulses, &mut v);
        v
    }

    /// J v: (un, ut) of every contact (m/s).
    pub fn contact_velocities(&self, velocities: &[Velocity]) -> Vec<DPair> {
        self.contacts.iter().map(|c| c.velocity(velocities)).collect()
    }

    /// G λ = J M⁻¹ Jᵀ λ of the contacts (m/s).
    pub fn delassus_product(&self, impulses: &[DPair]) -> Vec<DPair> {
        let mut v = vec![[0.0; 3]; self.bodies.len()];
        for (c, &impulse) in self.contacts.iter().zip(impulses) {
            self.apply(c, impulse, &mut v);
        }
        self.contact_velocities(&v)
    }

    /// (G_nn, G_tt) of one contact (1/kg).
    pub(super) fn delassus_block(&self, contact: &ProblemContact) -> DPair {
        let mut g = [0.0; 2];
        for (body, block) in contact.sides() {
            let b = &self.bodies[body];
            for (g, row) in g.iter_mut().zip(&block) {
                *g += b.inv_mass * (row[0] * row[0] + row[1] * row[1]) + b.inv_inertia * row[2] * row[2];
            }
        }
        g
    }

    /// Diagonal of G, a (normal, tangential) pair per contact (1/kg).
    pub fn delassus_diagonal(&self) -> Vec<DPair> {
        self.contacts.iter().map(|c| self.delassus_block(c)).collect()
    }

    /// The impulse by which residuals are divided (N·s): h m g of the heaviest body, max |m (v* − v)|.
    /// Without forces max |m v*|; 1 if nothing moves.
    pub fn impulse_unit(&self) -> f64 {
        let largest = |velocity: fn(&ProblemBody) -> DPair| {
            let impulse = |b: &ProblemBody| velocity(b).map(|v| b.masses()[0] * v);
            self.bodies.iter().map(impulse).map(|[x, y]| x.hypot(y)).fold(0.0, f64::max)
        };
        let load = largest(|b| [0, 1].map(|k| b.free_velocity[k] - b.velocity[k]));
        let momentum = largest(|b| [b.free_velocity[0], b.free_velocity[1]]);
        [load, momentum].into_iter().find(|&u| u > 0.0).unwrap_or(1.0)
    }

    /// √(vᵀ M v) over components of finite mass (√J·√2).
    pub fn mass_norm(&self, velocities: &[Velocity]) -> f64 {
        let square = |(b, v): (&ProblemBody, &Velocity)| {
            let m = b.masses();
            m[0] * v[0] * v[0] + m[1] * v[1] * v[1] + m[2] * v[2] * v[2]
        };
        self.bodies.iter().zip(velocities).map(square).sum::<f64>().sqrt()
    }

    /// ‖v − w‖ in the mass norm, relative to max(‖w‖, ‖v* − v_start‖). The second norm represents √m g h, so
    /// that a reference at rest does not make every error infinite.
    pub fn velocity_error(&self, velocities: &[Velocity], reference: &[Velocity]) -> f64 {
        let free: Vec<Velocity> = self.bodies.iter().map(|b| b.free_velocity).collect();
        let start: Vec<Velocity> = self.bodies.iter().map(|b| b.velocity).collect();
        let scale = self.mass_norm(reference).max(self.mass_norm(&minus(&free, &start)));
        let error = self.mass_norm(&minus(velocities, reference));
        if error == 0.0 { 0.0 } else { error / scale }
    }
}

/// a − b
pub fn minus(a: &[Velocity], b: &[Velocity]) -> Vec<Velocity> {
    a.iter().zip(b).map(|(a, b)| [0, 1, 2].map(|k| a[k] - b[k])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::gallery::sliding_box;

    /// Two bodies and one contact with an oblique normal; b has 2 kg and 0.5 kg·m², a 1 kg and 0.25 kg·m².
    fn oblique() -> ContactProblem {
        let body = |inv_mass, inv_inertia, v: Velocity| ProblemBody {
            inv_mass,
            inv_inertia,
            velocity: v,
            free_velocity: [v[0], v[1] - 1.0, v[2]],
        };
        // r_a × n = 0.8 − 1.2 = −0.4; t = (0.8, −0.6), r_a × t = −0.6 − 1.6 = −2.2. r_b: −1.4 and −0.2.
        let r = [[1.0, 2.0], [-1.0, 1.0]];
        let contact = ProblemContact::touching([Some(0), Some(1)], 0, [0.6, 0.8], r, 0.5);
        contact.arm_a.iter().zip([-0.4, -2.2]).for_each(|(&a, b)| close(a, b));
        contact.arm_b.iter().zip([-1.4, -0.2]).for_each(|(&a, b)| close(a, b));
        let bodies = vec![body(1.0, 4.0, [1.0, 0.0, 2.0]), body(0.5, 2.0, [0.0, 3.0, -1.0])];
        ContactProblem { name: "oblique".into(), h: 0.1, bodies, contacts: vec![contact], joints: vec![] }
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-14, "{a} is not {b}");
    }

    /// 1/5e-324 is infinite; norms must not become NaN.
    #[test]
    fn a_mass_beyond_all_numbers_is_infinite() {
        let mut p = oblique();
        p.bodies[0].inv_inertia = 5e-324;
        let v: Vec<Velocity> = p.bodies.iter().map(|b| b.velocity).collect();
        let norm = p.mass_norm(&v);
        p.bodies[0].inv_inertia = 0.0;
        assert_eq!(norm, p.mass_norm(&v));
    }

    /// Names appear in tables and terminals.
    #[test]
    fn a_name_is_one_line() {
        let mut p = oblique();
        p.name = "a\nb\u{1b}[31m".into();
        let message = p.validate().unwrap_err().to_string();
        assert_eq!(message, r#"name: must not have control characters, is "a\nb\u{1b}[31m""#);
    }

    #[test]
    fn relative_velocity_by_hand() {
        let p = oblique();
        let v: Vec<Velocity> = p.bodies.iter().map(|b| b.velocity).collect();
        // v at the point: a (1, 0) + 2 (−2, 1) = (−3, 2); b (0, 3) − (−1, −1) = (1, 4); b − a = (4, 2).
        let [un, ut] = p.contacts[0].velocity(&v);
        close(un, 0.6 * 4.0 + 0.8 * 2.0);
        close(ut, 0.8 * 4.0 - 0.6 * 2.0);
        let [a, b] = p.contacts[0].anchors();
        [(a, [1.0, 2.0]), (b, [-1.0, 1.0])].iter().for_each(|(x, y)| {
            close(x[0], y[0]);
            close(x[1], y[1]);
        });
    }

    #[test]
    fn impulses_and_delassus_by_hand() {
        let p = oblique();
        // λ = (1, 0): b gains (0.3, 0.4, −2.8), a loses (0.6, 0.8, −1.6).
        let v = p.velocities(&[[1.0, 0.0]]);
        let expected = [[1.0 - 0.6, -1.0 - 0.8, 2.0 + 1.6], [0.3, 2.0 + 0.4, -1.0 - 2.8]];
        v.iter().flatten().zip(expected.iter().flatten()).for_each(|(a, b)| close(*a, *b));
        // G_nn = 1 + 4·0.16 + 0.5 + 2·1.96, G_tt = 1 + 4·4.84 + 0.5 + 2·0.04, G_nt = 4·0.88 + 2·0.28.
        let [n, t] = [[1.0, 0.0], [0.0, 1.0]].map(|l| p.delassus_product(&[l])[0]);
        let found = [n, t, p.delassus_diagonal()[0]].concat();
        found.iter().zip([6.06, 4.08, 4.08, 20.94, 6.06, 20.94]).for_each(|(&a, b)| close(a, b));
    }

    #[test]
    fn norms_and_scales_by_hand() {
        let p = oblique();
        // m = 1, I = 0.25 and m = 2, I = 0.5: 1 + 4·0.25 + 2·9 + 1·0.5 = 20.5.
        close(p.mass_norm(&[[1.0, 0.0, 2.0], [0.0, 3.0, -1.0]]), 20.5f64.sqrt());
        assert_eq!(p.impulse_unit(), 2.0);
        // ‖v* − v‖ = √3; a reference at rest, and a solution with an error of 1 m/s on the 1 kg body.
        let rest = [[0.0; 3]; 2];
        close(p.velocity_error(&[[1.0, 0.0, 0.0], [0.0; 3]], &rest), 1.0 / 3.0f64.sqrt());
        assert_eq!(p.velocity_error(&rest, &rest), 0.0);
        let mut floating = p.clone();
        floating.bodies.iter_mut().for_each(|b| b.free_velocity = b.velocity);
        assert_eq!(floating.impulse_unit(), 6.0);
    }

    #[test]
    fn bad_problems_are_named() {
        type Spoil = fn(&mut ContactProblem);
        let spoils: [(Spoil, &str); 8] = [
            (|p| p.h = 0.0, "h: the step is 0 s"),
            (|p| p.bodies[0].velocity[2] = f64::NAN, "bodies[0]: NaN"),
            (|p| p.bodies[0].inv_mass = -1.0, "bodies[0]: inv_mass is -1"),
            (|p| p.contacts[1].body_b = Some(3), "contacts[1]: names body 3 of 1"),
            (|p| p.contacts[1].normal = [0.0, 1.1], "contacts[1]: the normal has length 1.1"),
            (|p| p.contacts[0].friction = -0.1, "contacts[0]: friction is -0.1"),
            (|p| p.contacts[0].body_b = None, "contacts[0]: both sides"),
            (|p| (p.bodies[0].inv_mass, p.bodies[0].inv_inertia) = (0.0, 0.0), "contacts[0]: no side"),
        ];
        sliding_box().validate().unwrap();
        for (spoil, message) in spoils {
            let mut p = sliding_box();
            spoil(&mut p);
            let error = p.validate().unwrap_err().to_string();
            assert!(error.starts_with(message), "{error}");
        }
    }
}
