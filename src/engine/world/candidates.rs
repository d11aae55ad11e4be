//! Candidates: pairs of shapes whose bounds overlap, kept while they do.

use super::World;
use super::joints::JointSlots;
use crate::bodies::{BodyKind, Filter};
use crate::contacts::pair_key;
use crate::narrowphase::batch::{NO_CONTACT, PairKind};
use crate::narrowphase::candidate::Candidate;
use crate::params::SPECULATIVE_DISTANCE;

/// Allowance for rounding in a squared distance (1).
const REACH_ROUNDING: f32 = 1.0 + 1e-5;

/// Whether a joint or the filters of two shapes keep them from colliding.
pub(super) fn ignores(joints: &JointSlots, filters: &[Filter], [i, j]: [u32; 2], bodies: [u32; 2]) -> bool {
    let meet = || filters[i as usize].meets(&filters[j as usize]);
    joints.keeps_apart(bodies) || (!filters.is_empty() && !meet())
}

/// Squared distance of the centers of two bodies within which shapes of these reaches may touch (m²).
pub(super) fn reach_squared(reach: [f32; 2], length_unit: f32) -> f32 {
    let reach = reach[0] + reach[1] + length_unit * SPECULATIVE_DISTANCE;
    reach * reach * REACH_ROUNDING
}

impl World {
    /// Rebuilds the candidates from `self.pairs`; persisting ones keep their contact.
    ///
    /// Both lists are sorted by shape pair, so one walk along both is enough.
    pub(super) fn update_candidates(&mut self) {
        let narrow = &mut self.narrow;
        std::mem::swap(&mut narrow.candidates, &mut narrow.last_candidates);
        narrow.candidates.clear();
        narrow.of_kind.iter_mut().for_each(Vec::clear);
        let mut last = narrow.last_candidates.iter().peekable();
        let mut kept = 0;
        let may_ignore = !self.filters.is_empty() || self.joints.keeps_any_apart();
        for &[i, j] in &self.pairs {
            let (a, b) = if self.proxies[j as usize].dynamic { (i, j) } else { (j, i) };
            let [sa, sb] = [a, b].map(|shape| &self.surfaces[shape as usize]);
            let bodies = [a, b].map(|shape| self.shape_body[shape as usize]);
            // Two segments never touch.
            let Some(kind) = PairKind::of(sa.class, sb.class) else { continue };
            if may_ignore && ignores(&self.joints, &self.filters, [a, b], bodies) {
                continue;
            }
            let key = pair_key(i, j);
            while last.next_if(|old| old.pair() < key).is_some() {}
            let candidate = match last.next_if(|old| old.pair() == key) {
                Some(old) => *old,
                None => Candidate {
                    shapes: [a, b],
                    bodies,
                    numbers: [sa.number, sb.number],
                    reach_squared: reach_squared([sa.reach, sb.reach], self.settings.length_unit),
                    friction: (sa.friction * sb.friction).sqrt(),
                    restitution: sa.restitution.max(sb.restitution),
                    contact: NO_CONTACT,
                },
            };
            kept += usize::from(candidate.touches());
            narrow.of_kind[kind as usize].push(narrow.candidates.len() as u32);
            narrow.candidates.push(candidate);
        }
        narrow.on_seams.clear();
        if !self.seams.is_empty() {
            let has_seams = |(_, candidate): &(u32, &Candidate)| self.seams.has(candidate.shapes[0]);
            narrow.on_seams.extend((0..).zip(&narrow.candidates).filter(has_seams).map(|(name, _)| name));
        }
        narrow.extents.clear();
        narrow.extents.resize(self.bodies.len(), 0.0);
        for (surface, &body) in self.surfaces.iter().zip(&self.shape_body) {
            if self.bodies.kind[body as usize] != BodyKind::Static {
                let extent = &mut narrow.extents[body as usize];
                *extent = extent.max(surface.reach);
            }
        }
        narrow.jobs_are_current = false;
        // A contact is removed together with its candidate.
        narrow.is_changed |= kept != self.contacts.len();
    }
}
