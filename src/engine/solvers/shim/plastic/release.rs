//! What has borne a body until it is hit, by points that the impact releases.
//!
//! A block that rocks stands on one corner until the other one is hit. Its load F of the step before belongs to the first
//! corner until t, and in the step that is solved from its beginning on, all of it goes to the second: an error of F t
//! times the distance of both, which takes 3 % of the spin of a block 8 m high. So a point that an impact releases, which
//! is one that leaves faster than its load can bring it back within the step, gives F t beside the impact (for t < 0 it has
//! borne too long, and takes it back from what does not move), and the impact goes on to spread. A force in [0, t]
//! moves bodies by F t (dt − t/2)/m in the step.

use super::PlasticImpacts;
use super::point::{On, Place, Point, STILL};

impl On<'_> {
    /// A point bears no load any more.
    fn release(&mut self, point: &Point) {
        let Place { part, width, first, layout, .. } = self.place(point.lane);
        let floats: &mut [f32] = bytemuck::cast_slice_mut(self.batches[part].records_mut());
        let mut forget = |of: usize| floats[first + layout.at(point.index as usize, of) * width] = 0.0;
        forget(layout.normal_impulse);
        if layout.has_friction {
            forget(layout.tangent_impulse);
        }
    }
}

impl PlasticImpacts {
    /// Gives bodies what has borne them until they were hit, by points that the impact releases; whether there are any.
    pub(crate) fn release(&mut self, on: &mut On<'_>) -> bool {
        for place in 0..self.points.len() {
            let point = self.points[place];
            let time =
                point.rows.map(|row| self.bodies[row as usize].time).into_iter().fold(STILL.time, f32::max);
            let brings_back = point.k[0] * point.borne[0] * (on.dt / on.h);
            let leaves = point.impulse[0] == 0.0 && point.velocity(on.rows)[0] > brings_back;
            if point.is_round || point.borne[0] <= 0.0 || time == STILL.time || !leaves {
                continue;
            }
            on.release(&point);
            if time < 0.0 && point.pushes_a {
                continue;
            }
            let given = point.borne.map(|impulse| impulse * (time / on.h));
            self.push(on, place, given, [0.5 * time, time]);
            if on.record_impulses {
                let sum = &mut on.contacts[point.contact as usize].step_impulse[point.index as usize];
                *sum = [sum[0] + given[0], sum[1] + given[1]];
            }
        }
        !self.queue.is_empty()
    }
}
