//! The state of a session in bytes, little-endian, in multiples of four:
//!
//! | bytes | what |
//! |---|---|
//! | `u32` | number of the stage |
//! | `u32` | step |
//! | `u32` | length of the status (bytes), a multiple of four |
//! | … | status: JSON, padded with blanks |
//!
//! and for each pane:
//!
//! | bytes | what |
//! |---|---|
//! | 4 × `u32` | numbers of bodies, depths, points and islands' entries |
//! | `f32` × 3 × bodies | x, y relative to the stage's origin (m), angle (rad) |
//! | `f32` × bodies, or nothing | deepest overlap (m) of the body in the last step |
//! | `f32` × 8 × points | bodies a, b, x, y, separation (m), impulse on b (N·s) × 2, color (−1: none) |
//! | `u32` × bodies, or nothing | island: the least body of it, or the body itself if it is alone or not dynamic |

use super::Session;
use super::pane::Pane;
use crate::engine::disjoint::DisjointSets;
use crate::engine::world::World;
use glam::DVec2;
use serde_json::{Value, json};

impl Session {
    /// The state after the last step. `own` is added to the status, which is a JSON object.
    pub fn frame(&self, own: Value) -> Vec<u8> {
        let mut status = json!({
            "panes": self.panes.iter().map(status).collect::<Vec<_>>(),
            "recording": !self.recorders.is_empty(),
            "grabs": self.grabs,
            "held": self.grab.is_some(),
        });
        if let (Value::Object(status), Value::Object(own)) = (&mut status, own) {
            status.extend(own);
        }
        let mut text = status.to_string();
        text += &" ".repeat(text.len().next_multiple_of(4) - text.len());
        let mut bytes = Vec::with_capacity(text.len() + 128 * self.stage.kinds.len());
        for number in [self.version, self.step as u32, text.len() as u32] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(text.as_bytes());
        for pane in &self.panes {
            self.add_pane(&mut bytes, &pane.world);
        }
        bytes
    }

    fn add_pane(&self, bytes: &mut Vec<u8>, world: &World) {
        let bodies = &world.bodies;
        let origin = DVec2::from(self.stage.origin);
        let relative = |i: usize| (DVec2::from(bodies.center(i)) - origin).as_vec2();
        let points = if self.shown.points { world.counts().points } else { 0 };
        let islands = if self.shown.islands { islands(world) } else { Vec::new() };
        let depths = if self.shown.depths { depths(world) } else { Vec::new() };
        for number in [bodies.len(), depths.len(), points, islands.len()] {
            bytes.extend((number as u32).to_le_bytes());
        }
        let mut numbers = |list: &[f32]| list.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        for i in 0..bodies.len() {
            let at = relative(i);
            numbers(&[at.x, at.y, bodies.angle(i)]);
        }
        numbers(&depths);
        if points > 0 {
            let colors = world.contact_colors();
            for (contact, color) in world.contacts.iter().zip(colors) {
                let (n, at) = (contact.manifold.normal, relative(contact.body_b as usize));
                for (point, [normal, tangent]) in contact.manifold.points().iter().zip(contact.step_impulse) {
                    let place = at + point.anchor_b;
                    let impulse = [n.x * normal + n.y * tangent, n.y * normal - n.x * tangent];
                    numbers(&[contact.body_a as f32, contact.body_b as f32, place.x, place.y]);
                    numbers(&[point.separation, impulse[0], impulse[1], color.map_or(-1.0, f32::from)]);
                }
            }
        }
        islands.iter().for_each(|island| bytes.extend(island.to_le_bytes()));
    }
}

/// What changes with every step, of a pane.
fn status(pane: &Pane) -> Value {
    let (good, verdict) = pane.verdict();
    let (timings, counts) = (pane.world.timings(), pane.world.counts());
    json!({
        "last": pane.last(),
        "phase_ns": timings.phase_ns,
        "step_ns": timings.step_ns,
        "lanes": pane.world.lane_width().lanes(),
        "contacts": counts.contacts,
        "points": counts.points,
        "colors": counts.colors,
        "pushes": pane.pokes(),
        "good": good,
        "verdict": verdict,
        "since": pane.since,
        "failed": pane.failure.is_some(),
    })
}

/// The deepest overlap of each body (m), at the start of the last step; 0 without one.
fn depths(world: &World) -> Vec<f32> {
    let mut depths = vec![0.0_f32; world.bodies.len()];
    for contact in &world.contacts {
        let deepest = contact.manifold.points().iter().map(|point| -point.separation).fold(0.0, f32::max);
        for body in [contact.body_a, contact.body_b] {
            depths[body as usize] = depths[body as usize].max(deepest);
        }
    }
    depths
}

/// The island of each body: dynamic bodies that are connected by contacts and joints, named by the least of them.
fn islands(world: &World) -> Vec<u32> {
    let mut sets = DisjointSets::default();
    sets.begin(world.bodies.len());
    let touching = world.contacts.iter().map(|c| [c.body_a, c.body_b]);
    let joined = world.joints().map(|(_, joint)| [joint.a.index() as u32, joint.b.index() as u32]);
    for [a, b] in touching.chain(joined) {
        if [a, b].iter().all(|&i| world.bodies.is_dynamic(i as usize)) {
            sets.join(a, b);
        }
    }
    (0..world.bodies.len() as u32).map(|i| sets.least(i)).collect()
}
