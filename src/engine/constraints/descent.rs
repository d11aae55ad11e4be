//! What block descent works on: bodies, each with its contact points, and what the solver keeps.

use super::graph::Graph;
use super::kept::Kept;
use crate::engine::contacts::Contact;
use crate::engine::lanes::BodyRow;

/// One point's two rows, as body `side` of them sees it.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Jacobian of the separation and of the slide along t on body a: −n, −t and minus the arms.
    pub on_a: [[f32; 3]; 2],
    /// On body b.
    pub on_b: [[f32; 3]; 2],
}

/// Everything of one substep; see the [module](self).
pub struct Blocks<'a> {
    /// One row per body, and an inert one at the end.
    pub rows: &'a mut [BodyRow],
    /// Which contacts each body has ([`super::Passes::build_graph`]).
    pub graph: &'a Graph,
    /// What the solver keeps.
    pub kept: &'a mut Kept,
    /// All contacts.
    pub contacts: &'a [Contact],
    /// Changes of velocity in free flight per substep, `[h aₓ, h a_y, h α, 0]` per row.
    pub increments: &'a [[f32; 4]],
    /// Whether contacts turn bodies.
    pub rotation: bool,
    /// Whether there is friction.
    pub friction: bool,
}

impl Blocks<'_> {
    /// The rows of point `p` of contact `contact`, arms as at the start of the step.
    pub fn row(&self, contact: usize, p: usize) -> Row {
        let c = &self.contacts[contact];
        let (n, point) = (c.manifold.normal, &c.manifold.points[p]);
        let t = glam::Vec2::new(n.y, -n.x);
        let turns = if self.rotation { 1.0 } else { 0.0 };
        let side = |anchor: glam::Vec2, sign: f32| {
            [n, t].map(|u| [sign * u.x, sign * u.y, sign * turns * anchor.perp_dot(u)])
        };
        Row { on_a: side(point.anchor_a, -1.0), on_b: side(point.anchor_b, 1.0) }
    }

    /// How far a body has moved since the step began: Δx, Δy (m), Δθ (rad). What is no body has not.
    pub fn moved(&self, body: u32) -> [f32; 3] {
        self.rows.get(body as usize).map_or([0.0; 3], |row| [row.delta[0], row.delta[1], row.delta[2]])
    }

    /// Inverse mass (1/kg) and inertia (1/(kg·m²)) of a body.
    pub fn inverse_masses(&self, body: usize) -> [f32; 2] {
        [self.rows[body].velocity[3], self.rows[body].delta[3]]
    }
}
