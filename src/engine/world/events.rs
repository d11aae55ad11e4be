//! Contact events (begin, end, hit), and contacts in world coordinates.

use super::World;
use crate::bodies::BodyHandle;
use crate::contacts::Contact;
use crate::params::HIT_SPEED;
use glam::{DVec2, Vec2};

/// A contact event in the last step. Bodies and shapes are in the order of the [`Contact`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ContactEvent {
    /// Two shapes came within [`SPECULATIVE_DISTANCE`](crate::params::SPECULATIVE_DISTANCE), at which
    /// contacts begin.
    Begin {
        /// The bodies.
        bodies: [BodyHandle; 2],
        /// Indices of the shapes.
        shapes: [u32; 2],
    },
    /// The shapes separated, or a body was removed; its handle is then invalid.
    End {
        /// The bodies.
        bodies: [BodyHandle; 2],
        /// Indices of the shapes.
        shapes: [u32; 2],
    },
    /// The shapes approached faster than [`HIT_SPEED`] and pushed each other. A solver with soft contacts
    /// stops a body over several steps, each of which may report a hit.
    Hit {
        /// The bodies.
        bodies: [BodyHandle; 2],
        /// Indices of the shapes.
        shapes: [u32; 2],
        /// Mean of the contact points (m).
        point: [f64; 2],
        /// Unit vector from the first body to the second.
        normal: [f64; 2],
        /// Approach speed along the normal before the step (m/s), > 0.
        approach_speed: f64,
        /// Normal impulse of the whole step, summed over all points (N·s).
        impulse: f64,
    },
}

/// A contact point in world coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ContactPoint {
    /// Position (m): the center of body b plus the arm found at the start of the last step.
    pub position: [f64; 2],
    /// Unit vector from body a to body b.
    pub normal: [f64; 2],
    /// Signed gap along the normal (m); negative is overlap.
    pub separation: f64,
    /// Normal impulse of the last substep, ≥ 0 (N·s).
    pub normal_impulse: f64,
    /// Tangential impulse of the last substep (N·s).
    pub tangent_impulse: f64,
}

/// A pair of touching shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct TouchingPair {
    key: u64,
    bodies: [BodyHandle; 2],
    shapes: [u32; 2],
}

/// Events of the last step, and the state for finding those of the next.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Events {
    #[cfg_attr(feature = "serde", serde(skip))]
    list: Vec<ContactEvent>,
    /// Touching pairs after the last step, sorted by key.
    touching: Vec<TouchingPair>,
    #[cfg_attr(feature = "serde", serde(skip))]
    last_touching: Vec<TouchingPair>,
    #[cfg_attr(feature = "serde", serde(skip))]
    /// Approach speed before the step (m/s) and point (m) of each contact.
    approach: Vec<(f32, DVec2)>,
}

impl Events {
    /// Forgets the last step.
    pub fn clear(&mut self) {
        self.list.clear();
        self.touching.clear();
    }
}

impl World {
    /// Contact events of the last step: ends, begins and hits, in the order of shape pairs. Empty unless
    /// [`Settings::contact_events`](super::Settings::contact_events) is set.
    ///
    /// ```
    /// use simpulse_engine::bodies::{BodyDef, ShapeDef};
    /// use simpulse_engine::{solvers, world::{ContactEvent, Settings, World}};
    ///
    /// let settings = Settings { contact_events: true, ..Settings::default() };
    /// let mut world = World::new(settings);
    /// world.add_body(&BodyDef::fixed([0.0, -1.0]).with(ShapeDef::rectangle(10.0, 1.0)?))?;
    /// world.add_body(&BodyDef::dynamic([0.0, 2.0]).with(ShapeDef::rectangle(0.5, 0.5)?))?;
    /// let mut hit = 0.0;
    /// for _ in 0..60 {
    ///     world.step()?;
    ///     for event in world.contact_events() {
    ///         if let ContactEvent::Hit { impulse, .. } = event {
    ///             hit += impulse;
    ///         }
    ///     }
    /// }
    /// // It fell 1.5 m: 5.5 m/s.
    /// assert!(hit > 5.0, "{hit} N·s");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn contact_events(&self) -> &[ContactEvent] {
        &self.events.list
    }

    /// Nothing happened in this step; pairs that touch still do.
    pub(super) fn clear_events(&mut self) {
        self.events.list.clear();
    }

    /// Bodies a and b of a contact of the last step.
    pub fn bodies_of(&self, contact: &Contact) -> [BodyHandle; 2] {
        let handle = |index| BodyHandle { index, generation: self.slots.generation[index as usize] };
        [contact.body_a, contact.body_b].map(handle)
    }

    /// The points of a contact of the last step, in world coordinates.
    pub fn points_of<'a>(&'a self, contact: &'a Contact) -> impl Iterator<Item = ContactPoint> + 'a {
        let [x, y] = self.bodies.center(contact.body_b as usize);
        contact.manifold.points().iter().map(move |point| ContactPoint {
            position: [x + f64::from(point.anchor_b.x), y + f64::from(point.anchor_b.y)],
            normal: contact.manifold.normal.as_dvec2().to_array(),
            separation: point.separation.into(),
            normal_impulse: point.normal_impulse.into(),
            tangent_impulse: point.tangent_impulse.into(),
        })
    }

    /// Records the approach speed at each contact before the step changes it.
    pub(super) fn note_approach(&mut self) {
        let b = &self.bodies;
        self.events.approach.clear();
        self.events.approach.extend(self.contacts.iter().map(|contact| {
            let [i, j] = [contact.body_a as usize, contact.body_b as usize];
            let points = contact.manifold.points();
            let at = |i: usize, arm: Vec2| b.velocity(i) + b.angular_velocity[i] * arm.perp();
            let speed = |p: &crate::contacts::ManifoldPoint| {
                (at(i, p.anchor_a) - at(j, p.anchor_b)).dot(contact.manifold.normal)
            };
            let arm = points.iter().map(|p| p.anchor_b).sum::<Vec2>() / points.len().max(1) as f32;
            let fastest = points.iter().map(speed).fold(f32::NEG_INFINITY, f32::max);
            (fastest, DVec2::from(b.center(j)) + arm.as_dvec2())
        }));
    }

    /// Compares the contacts of this step with those of the last.
    pub(super) fn find_events(&mut self) {
        let mut events = std::mem::take(&mut self.events);
        std::mem::swap(&mut events.touching, &mut events.last_touching);
        events.list.clear();
        events.touching.clear();
        events.touching.extend(self.contacts.iter().map(|contact| TouchingPair {
            key: contact.key(),
            bodies: self.bodies_of(contact),
            shapes: [contact.shape_a, contact.shape_b],
        }));
        let Events { list, touching, last_touching, approach } = &mut events;
        let end = |&TouchingPair { bodies, shapes, .. }: &TouchingPair| ContactEvent::End { bodies, shapes };
        let mut last = last_touching.iter().peekable();
        for ((now, contact), &(approach_speed, point)) in touching.iter().zip(&self.contacts).zip(&*approach)
        {
            let TouchingPair { key, bodies, shapes } = *now;
            while let Some(gone) = last.next_if(|old| old.key < key) {
                list.push(end(gone));
            }
            match last.next_if(|old| old.key == key) {
                Some(old) if old == now => {}
                old => {
                    // The old pair belonged to other bodies, whose indices were reused.
                    list.extend(old.map(end));
                    list.push(ContactEvent::Begin { bodies, shapes });
                }
            }
            let impulse = contact.step_impulse[0][0] + contact.step_impulse[1][0];
            if approach_speed > HIT_SPEED * self.settings.length_unit && impulse > 0.0 {
                let (normal, point) = (contact.manifold.normal.as_dvec2().to_array(), point.to_array());
                let (approach_speed, impulse) = (approach_speed.into(), impulse.into());
                list.push(ContactEvent::Hit { bodies, shapes, point, normal, approach_speed, impulse });
            }
        }
        list.extend(last.map(end));
        self.events = events;
    }
}
