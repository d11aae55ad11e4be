//! Manifolds that are kept while two bodies hardly move relative to each other. Used by solvers that opt in.
//!
//! The narrow phase skips a pair if, since its manifold was found, body b has moved by less than a given
//! distance in the frame of a, and turned relative to a by less than acos 0.98 (`catto2024box2d`). Its points
//! then stay fixed on their bodies:
//!
//! ```text
//! r_a = R_a l_a,   r_b = R_b l_b,   n = R_a n_a,   s = s₀ + n·(d + r_b − r_a),   d = x_b − x_a
//! ```
//!
//! where l and n_a are fixed in the bodies' frames, and s₀ is chosen such that s was the separation found.
//! The points keep their feature ids and impulses. The method cannot notice that another corner or face has
//! begun to touch. Discs are always collided: their points do not stay fixed on them, and their manifolds are
//! just as cheap to find.

use crate::contacts::Contact;
use crate::lanes::held;
use crate::narrowphase::batch::{NO_CONTACT, PairKind};
use crate::narrowphase::candidate::Candidates;
use crate::narrowphase::lanes::PoseRow;
use glam::Vec2;

/// Cosine of the relative rotation at which a manifold is recomputed (1).
const SAME_TURN: f32 = 0.98;

/// Kinds of pairs whose manifolds are kept.
const KINDS: [PairKind; 2] = [PairKind::Rectangles, PairKind::Hulls];

/// A manifold when it was found, relative to its bodies.
#[derive(Clone, Copy, Debug)]
struct KeptManifold {
    /// Sort key of [`Candidates`].
    pair: u64,
    /// d, in the frame of a (m).
    offset: Vec2,
    /// Cosine and sine of the rotation of b relative to a.
    turn: Vec2,
    /// n_a
    normal: Vec2,
    /// l_a and l_b of each point (m).
    anchors: [[Vec2; 2]; 2],
    /// s₀ of each point (m).
    separation: [f32; 2],
}

/// Kept manifolds; see the [module](self).
#[derive(Clone, Debug, Default)]
pub(crate) struct Recycled {
    /// By kind, sorted by pair.
    found: [Vec<KeptManifold>; KINDS.len()],
    last_found: [Vec<KeptManifold>; KINDS.len()],
    /// Whether the manifold of each candidate is kept in this step. `[candidates]`
    kept: Vec<bool>,
    /// Whether manifolds may be kept in this step.
    is_used: bool,
}

/// x_b − x_a, including the low parts of the positions (m), and both rotations.
fn poses([a, b]: [&PoseRow; 2]) -> (Vec2, [Vec2; 2]) {
    let along = |k: usize| (b.position[k] - a.position[k]) + (b.position[k + 2] - a.position[k + 2]);
    let rotation = |row: &PoseRow| Vec2::new(row.rotation[0], row.rotation[1]);
    (Vec2::new(along(0), along(1)), [rotation(a), rotation(b)])
}

/// `vector` in the coordinates of a frame.
fn unrotate(frame: Vec2, vector: Vec2) -> Vec2 {
    Vec2::new(frame.x, -frame.y).rotate(vector)
}

impl KeptManifold {
    fn new(pair: u64, contact: &Contact, bodies: [&PoseRow; 2]) -> Self {
        let (d, [a, b]) = poses(bodies);
        let mut found = KeptManifold {
            pair,
            offset: unrotate(a, d),
            turn: unrotate(a, b),
            normal: unrotate(a, contact.manifold.normal),
            anchors: contact.manifold.points.map(|p| [unrotate(a, p.anchor_a), unrotate(b, p.anchor_b)]),
            separation: [0.0; 2],
        };
        // The result of the formula without s₀.
        let mut plain = *contact;
        found.write(&mut plain, bodies);
        for p in 0..2 {
            let points = [contact, &plain].map(|c| c.manifold.points[p].separation);
            found.separation[p] = points[0] - points[1];
        }
        found
    }

    fn is_near(&self, bodies: [&PoseRow; 2], distance: f32) -> bool {
        let (d, [a, b]) = poses(bodies);
        (unrotate(a, d) - self.offset).length_squared() < distance * distance
            && unrotate(a, b).dot(self.turn) > SAME_TURN
    }

    /// Writes the manifold for the current poses of the bodies.
    fn write(&self, contact: &mut Contact, bodies: [&PoseRow; 2]) {
        let (d, [a, b]) = poses(bodies);
        let normal = a.rotate(self.normal);
        contact.manifold.normal = normal;
        for p in 0..contact.manifold.count as usize {
            let [on_a, on_b] = self.anchors[p];
            let [anchor_a, anchor_b] = [a.rotate(on_a), b.rotate(on_b)];
            let point = &mut contact.manifold.points[p];
            (point.anchor_a, point.anchor_b) = (anchor_a, anchor_b);
            point.separation = self.separation[p] + normal.dot(d + anchor_b - anchor_a);
        }
    }
}

impl Recycled {
    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let lists = self.found.iter().chain(&self.last_found);
        lists.map(held).sum::<usize>() + held(&self.kept)
    }

    /// Updates kept manifolds to the current poses, and marks their candidates in `keep`. With a distance of
    /// zero none are kept.
    pub fn update(
        &mut self,
        candidates: Candidates<'_>,
        contacts: &mut [Contact],
        distance: f32,
        keep: &mut Vec<bool>,
    ) {
        if distance <= 0.0 {
            self.found.iter_mut().for_each(Vec::clear);
            self.is_used = false;
            return;
        }
        self.is_used = true;
        keep.resize(candidates.all.len(), false);
        for (found, kind) in self.found.iter().zip(KINDS) {
            let mut found = found.iter().peekable();
            for (place, candidate, bodies) in candidates.of(kind) {
                let pair = candidate.pair();
                while found.next_if(|f| f.pair < pair).is_some() {}
                let Some(found) = found.next_if(|f| f.pair == pair) else { continue };
                if candidate.contact != NO_CONTACT && found.is_near(bodies, distance) {
                    found.write(&mut contacts[candidate.contact as usize], bodies);
                    keep[place as usize] = true;
                }
            }
        }
        self.kept.clone_from(keep);
    }

    /// Stores the manifolds found in this step, and rounds the contacts as they will be rounded while kept,
    /// so that a second collision pass gives the same contacts.
    pub fn take_up(&mut self, candidates: Candidates<'_>, contacts: &mut [Contact]) {
        if !self.is_used {
            return;
        }
        std::mem::swap(&mut self.found, &mut self.last_found);
        for ((found, last), kind) in self.found.iter_mut().zip(&self.last_found).zip(KINDS) {
            found.clear();
            let mut last = last.iter().peekable();
            for (place, candidate, bodies) in candidates.of(kind) {
                if candidate.contact == NO_CONTACT {
                    continue;
                }
                let pair = candidate.pair();
                while last.next_if(|f| f.pair < pair).is_some() {}
                let old = last.next_if(|f| f.pair == pair).filter(|_| self.kept[place as usize]);
                found.push(old.copied().unwrap_or_else(|| {
                    let contact = &mut contacts[candidate.contact as usize];
                    let new = KeptManifold::new(pair, contact, bodies);
                    new.write(contact, bodies);
                    new
                }));
            }
        }
    }
}
