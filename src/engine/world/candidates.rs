//! Candidates: pairs of shapes whose bounds overlap, kept while they do.

use super::World;
use super::collide::Narrow;
use super::joints::JointSlots;
use crate::bodies::{BodyKind, Filter};
use crate::contacts::pair_key;
use crate::narrowphase::batch::{NO_CONTACT, PairKind};
use crate::narrowphase::candidate::Candidate;
use crate::params::SPECULATIVE_DISTANCE;
use crate::workers::Apart;

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

/// Least number of pairs that are worth a thread.
const LEAST_PAIRS: usize = 1024;

/// What one thread found among the pairs of a part.
#[derive(Clone, Debug, Default)]
pub(super) struct Listed {
    /// Number of candidates, and of those with a contact.
    count: usize,
    touching: usize,
    /// Their indices by [`PairKind`], as if no pair was left out before the part.
    of_kind: [Vec<u32>; PairKind::ALL.len()],
}

impl World {
    /// Rebuilds the candidates from `self.pairs`; persisting ones keep their contact.
    ///
    /// Both lists are sorted by shape pair, so one walk along both is enough. Each thread walks along a part.
    pub(super) fn update_candidates(&mut self) {
        let World { narrow, pairs, work, .. } = self;
        let Narrow { candidates, last_candidates, listed, of_kind, .. } = narrow;
        std::mem::swap(candidates, last_candidates);
        candidates.resize(pairs.len(), Candidate::NONE);
        let size = work.workers.part(pairs.len(), LEAST_PAIRS);
        let count = pairs.len().div_ceil(size);
        listed.resize_with(count.max(listed.len()), Apart::default);
        let (proxies, surfaces, shape_body) = (&self.proxies, &self.surfaces, &self.shape_body);
        let (joints, filters, unit) = (&self.joints, &self.filters, self.settings.length_unit);
        let may_ignore = !filters.is_empty() || joints.keeps_any_apart();
        let parts = pairs.chunks(size).zip(candidates.chunks_mut(size)).zip(&mut *listed);
        work.workers.each((0..).step_by(size).zip(parts), |(first, ((pairs, candidates), Apart(listed)))| {
            let Listed { count, touching, of_kind } = listed;
            (*count, *touching) = (0, 0);
            of_kind.iter_mut().for_each(Vec::clear);
            let start = pairs.first().map_or(0, |&[i, j]| pair_key(i, j));
            let start = last_candidates.partition_point(|old| old.pair() < start);
            let mut last = last_candidates[start..].iter().peekable();
            for &[i, j] in pairs {
                let (a, b) = if proxies[j as usize].dynamic { (i, j) } else { (j, i) };
                let [sa, sb] = [a, b].map(|shape| &surfaces[shape as usize]);
                let bodies = [a, b].map(|shape| shape_body[shape as usize]);
                // Two segments never touch.
                let Some(kind) = PairKind::of(sa.class, sb.class) else { continue };
                if may_ignore && ignores(joints, filters, [a, b], bodies) {
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
                        reach_squared: reach_squared([sa.reach, sb.reach], unit),
                        friction: (sa.friction * sb.friction).sqrt(),
                        restitution: sa.restitution.max(sb.restitution),
                        contact: NO_CONTACT,
                    },
                };
                *touching += usize::from(candidate.touches());
                of_kind[kind as usize].push((first + *count) as u32);
                candidates[*count] = candidate;
                *count += 1;
            }
        });
        of_kind.iter_mut().for_each(Vec::clear);
        let (mut end, mut touching) = (0, 0);
        for (first, Apart(listed)) in (0..).step_by(size).zip(&listed[..count]) {
            let left_out = first - end;
            if left_out > 0 {
                candidates.copy_within(first..first + listed.count, end);
            }
            for (all, part) in of_kind.iter_mut().zip(&listed.of_kind) {
                all.extend(part.iter().map(|name| name - left_out as u32));
            }
            end += listed.count;
            touching += listed.touching;
        }
        candidates.truncate(end);
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
        narrow.is_changed |= touching != self.contacts.len();
    }
}
