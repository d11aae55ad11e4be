//! Frozen contacts: while two bodies hardly move, their contact keeps its normal and its lever arms.
//!
//! The narrow phase skips a pair as long as, since its manifold was found,
//!
//! ```text
//! |Δd| + ρ |sin Δθ| < distance,    |Δθ_a|, |Δθ_b| < turn
//! ```
//!
//! d is the center of b in the frame of a, Δθ the turn of b relative to a, and ρ the larger extent of the two
//! bodies, 0 for one that is static (`catto2024box2d`, `b2CollideTask`; `crozet2025rapier`, whose bound uses the chord
//! 2 ρ sin Δθ/2 instead). Normal n and arms r stay as they are **in the world**. Only the separations follow
//! the bodies:
//!
//! ```text
//! s = s₀ + n·(d + R(Δθ_b) r_b − R(Δθ_a) r_a),    d = x_b − x_a
//! ```
//!
//! s₀ is chosen such that s is the separation that was found. Points keep their feature ids and impulses.
//!
//! # What it changes
//!
//! A body that leans by Δθ shifts the arms of its loads by h Δθ, where h is their height above its center. Fresh
//! arms carry the moment F h Δθ of this shift into the sweeps, frozen ones do not. This moment is what makes a
//! column of soft contacts buckle (Greenhill's beam), so frozen columns stand. The same moment tips a box over
//! its edge, so frozen boxes tip late.
//!
//! A contact with two loaded points can take up the missing moment: it moves the load F between its points, by
//! F δ/2b for arms that are δ off on a base of half-width b. Nothing has to move for that. A contact on one point
//! has no such reserve: the whole missing moment acts on the motion. With [`FreezeLimits::loaded_only`], only
//! contacts whose two points both carry load are therefore frozen, and the error of a tipping moment is bounded
//! by δ/b, with δ ≤ distance.
//!
//! Contacts of discs are never frozen: their points do not stay fixed on them.

use super::batch::{NO_CONTACT, PairKind};
use super::candidate::{Candidate, Candidates};
use super::lanes::PoseRow;
use crate::contacts::Contact;
use glam::Vec2;

/// Motion within which a contact stays frozen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FreezeLimits {
    /// Motion of b relative to a (m for bodies of about a meter, see `Settings::length_unit`).
    pub distance: f32,
    /// Rotation of each body (rad).
    pub turn: f32,
    /// Whether only contacts with two points, both of which carried load in the last step, are frozen.
    #[cfg_attr(feature = "serde", serde(default))]
    pub loaded_only: bool,
}

impl FreezeLimits {
    /// Those of Box2D and rapier: 5 cm, and acos 0.98 (`catto2024box2d`, `crozet2025rapier`).
    pub const BOX2D: FreezeLimits = FreezeLimits { distance: 0.05, turn: 0.200_335, loaded_only: false };

    /// Where only contacts with two loaded points are frozen: 1 mm errs by 0.2 % of a tipping moment on a base of a meter,
    /// and 4 mrad by 1 % of the angle of friction for µ = 0.5.
    pub const LOADED: FreezeLimits = FreezeLimits { distance: 0.001, turn: 0.004, loaded_only: true };
}

/// Whether the contacts of a world are frozen while bodies hardly move, see the [module](self).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum Freezing {
    /// As in the solver's source.
    #[default]
    Own,
    /// Never: every manifold is found again in every step.
    Off,
    /// Within these limits.
    Within(FreezeLimits),
}

impl Freezing {
    /// The limits of a run under a solver whose source has `own`; `None` if nothing is frozen. A distance of
    /// zero freezes nothing.
    pub fn limits(self, own: Option<FreezeLimits>) -> Option<FreezeLimits> {
        let limits = match self {
            Freezing::Own => own,
            Freezing::Off => None,
            Freezing::Within(limits) => Some(limits),
        };
        limits.filter(|l| l.distance > 0.0)
    }
}

/// As on the command line: own, off, or distance (m) and turn (rad).
impl std::fmt::Display for Freezing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Freezing::Own => write!(f, "own"),
            Freezing::Off => write!(f, "off"),
            Freezing::Within(FreezeLimits { distance, turn, loaded_only }) => {
                write!(f, "{distance},{turn}{}", if *loaded_only { ",loaded" } else { "" })
            }
        }
    }
}

/// Kinds of pairs whose contacts are frozen.
const KINDS: [PairKind; 2] = [PairKind::Rectangles, PairKind::Hulls];

/// The poses at which a manifold was found.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct FrozenManifold {
    /// Sort key of [`Candidates`].
    pair: u64,
    /// d, in the frame of a (m).
    offset: Vec2,
    /// Cosine and sine of the rotations of a and b.
    turns: [Vec2; 2],
    /// s₀ of each point (m).
    separation: [f32; 2],
}

/// The frozen contacts of a world, see the [module](self).
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FrozenContacts {
    /// By kind, sorted by pair.
    found: [Vec<FrozenManifold>; KINDS.len()],
    #[cfg_attr(feature = "serde", serde(skip))]
    last_found: [Vec<FrozenManifold>; KINDS.len()],
    /// Whether the manifold of each candidate is kept in this step; empty if nothing is frozen. `[candidates]`
    #[cfg_attr(feature = "serde", serde(skip))]
    keep: Vec<bool>,
    /// Farthest point of each body from its center, 0 if it is static (m).
    #[cfg_attr(feature = "serde", serde(skip))]
    extents: Vec<f32>,
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

impl FrozenManifold {
    fn new(pair: u64, contact: &mut Contact, bodies: [&PoseRow; 2]) -> Self {
        let (d, turns) = poses(bodies);
        let offset = unrotate(turns[0], d);
        let mut found = FrozenManifold { pair, offset, turns, separation: [0.0; 2] };
        let fresh = contact.manifold.points.map(|p| p.separation);
        // The result of the formula without s₀.
        found.follow(contact, bodies);
        for (s, (fresh, point)) in
            found.separation.iter_mut().zip(fresh.into_iter().zip(&contact.manifold.points))
        {
            *s = fresh - point.separation;
        }
        // Rounded as in later steps, so that a second collision pass gives the same contacts.
        found.follow(contact, bodies);
        found
    }

    /// Whether the bodies have moved by less than a distance (m) and turned by less than the angle of this cosine;
    /// `extent` is ρ (m).
    fn is_near(&self, bodies: [&PoseRow; 2], extent: f32, distance: f32, least_cosine: f32) -> bool {
        let (d, [a, b]) = poses(bodies);
        let [a_0, b_0] = self.turns;
        let sine = unrotate(a, b).perp_dot(unrotate(a_0, b_0)).abs();
        (unrotate(a, d) - self.offset).length() + extent * sine < distance
            && a.dot(a_0) > least_cosine
            && b.dot(b_0) > least_cosine
    }

    /// Writes the separations for the current poses of the bodies.
    fn follow(&self, contact: &mut Contact, bodies: [&PoseRow; 2]) {
        let (d, [a, b]) = poses(bodies);
        let [turn_a, turn_b] = [unrotate(self.turns[0], a), unrotate(self.turns[1], b)];
        let manifold = &mut contact.manifold;
        for (point, s) in manifold.points.iter_mut().zip(self.separation).take(manifold.count as usize) {
            let gap = d + turn_b.rotate(point.anchor_b) - turn_a.rotate(point.anchor_a);
            point.separation = s + manifold.normal.dot(gap);
        }
    }
}

impl FrozenContacts {
    /// For each candidate, whether its manifold is kept in this step; empty if nothing is frozen.
    pub fn keep(&self) -> &[bool] {
        &self.keep
    }

    /// Updates the separations of frozen contacts to the current poses, and thaws those whose bodies have moved.
    /// `reaches`: the body of each shape, and its farthest point from the center of that body, 0 if the body is
    /// static (m).
    pub fn update(
        &mut self,
        candidates: Candidates<'_>,
        contacts: &mut [Contact],
        limits: Option<FreezeLimits>,
        reaches: impl Iterator<Item = (u32, f32)>,
    ) {
        self.keep.clear();
        let Some(FreezeLimits { distance, turn, loaded_only }) = limits else {
            self.found.iter_mut().for_each(Vec::clear);
            return;
        };
        self.keep.resize(candidates.all.len(), false);
        self.extents.clear();
        self.extents.resize(candidates.poses.len(), 0.0);
        for (body, reach) in reaches {
            let extent = &mut self.extents[body as usize];
            *extent = extent.max(reach);
        }
        let least_cosine = turn.cos();
        for (found, kind) in self.found.iter().zip(KINDS) {
            for (place, candidate, bodies, found) in touching(candidates, kind, found) {
                let Some(found) = found else { continue };
                let contact = &mut contacts[candidate.contact as usize];
                let [a, b] = candidate.bodies.map(|body| self.extents[body as usize]);
                let bears = contact.manifold.points().iter().filter(|p| p.normal_impulse > 0.0).count() == 2;
                if found.is_near(bodies, a.max(b), distance, least_cosine) && (bears || !loaded_only) {
                    found.follow(contact, bodies);
                    self.keep[place] = true;
                }
            }
        }
    }

    /// Notes the poses of the manifolds that were found in this step.
    pub fn note(&mut self, candidates: Candidates<'_>, contacts: &mut [Contact]) {
        if self.keep.is_empty() {
            return;
        }
        for ((found, last), kind) in self.found.iter_mut().zip(&mut self.last_found).zip(KINDS) {
            let pairs = with_contact(candidates, kind).map(|(_, candidate, _)| candidate.pair());
            let is_same = pairs.eq(found.iter().map(|f| f.pair));
            if !is_same {
                std::mem::swap(found, last);
                found.clear();
                found.extend(touching(candidates, kind, last).map(|(place, candidate, bodies, old)| {
                    let contact = &mut contacts[candidate.contact as usize];
                    let old = old.filter(|_| self.keep[place]).copied();
                    old.unwrap_or_else(|| FrozenManifold::new(candidate.pair(), contact, bodies))
                }));
                continue;
            }
            for ((place, candidate, bodies), found) in with_contact(candidates, kind).zip(found) {
                if !self.keep[place as usize] {
                    let contact = &mut contacts[candidate.contact as usize];
                    *found = FrozenManifold::new(candidate.pair(), contact, bodies);
                }
            }
        }
    }
}

/// The candidates of a kind that have a contact: index, candidate and poses.
fn with_contact(
    candidates: Candidates<'_>,
    kind: PairKind,
) -> impl Iterator<Item = (u32, &Candidate, [&PoseRow; 2])> {
    candidates.of(kind).filter(|(_, candidate, _)| candidate.contact != NO_CONTACT)
}

/// As [`with_contact`], with the entry of the pair in `found`, which is sorted by pair.
fn touching<'a>(
    candidates: Candidates<'a>,
    kind: PairKind,
    found: &'a [FrozenManifold],
) -> impl Iterator<Item = (usize, &'a Candidate, [&'a PoseRow; 2], Option<&'a FrozenManifold>)> {
    let mut found = found.iter().peekable();
    with_contact(candidates, kind).map(move |(place, candidate, bodies)| {
        let pair = candidate.pair();
        while found.next_if(|f| f.pair < pair).is_some() {}
        (place as usize, candidate, bodies, found.next_if(|f| f.pair == pair))
    })
}
