//! Vectors over contact points in lane order, so that arithmetic on their entries runs in lanes.
//!
//! Sixteen contacts in a row in a segment share four blocks: λn of their first points, λt of their first
//! points, then the same of their second points. Each segment of colored batches starts with a new block,
//! whatever the width, so a contact has the same slot at every width. Contacts in natural order follow each
//! other without gaps. Slots without a point are zero.
//!
//! Sums are kept in `f64` in sixteen parts, one for each slot within a block, in the order of the blocks.
//! Then the parts are added in order. So the result has the same bits at every width.
//!
//! Constraints of other types, if the scene has any, come after the contacts: a row of sixteen of them has
//! two blocks, the second of which is zero. Arithmetic on single entries does not depend on the width, so it
//! always uses [`Wide`], which a build lowers to the instructions that it has.

use crate::constraints::records::batches::Batches;
use crate::lanes::{Block, Lanes, held};
use wide::f32x16;

/// Lanes for arithmetic on single entries.
pub type Wide = f32x16;

/// Sixteen points: their normal and their tangential entries.
pub type PointEntry = [Wide; 2];

/// Entries of all contact points; see the [module](self).
#[derive(Debug, Default)]
pub struct PointVector {
    blocks: Vec<Block>,
}

impl Clone for PointVector {
    fn clone(&self) -> Self {
        PointVector { blocks: self.blocks.clone() }
    }

    /// Reuses the memory of `self`.
    fn clone_from(&mut self, from: &Self) {
        self.blocks.clone_from(&from.blocks);
    }
}

/// Blocks that sixteen contacts share.
const SHARED: usize = 4;

impl PointVector {
    /// Sets zeros for the contacts of both sets of batches and for `rows` rows of sixteen other constraints.
    pub(crate) fn reset(&mut self, batches: [&Batches; 2], rows: usize) {
        self.blocks.clear();
        let contacts = SHARED * batches.map(Batches::groups).iter().sum::<usize>();
        self.blocks.resize(contacts + 2 * rows, Block::default());
    }

    /// Entries of other constraints, which come after the contacts of both sets of batches.
    pub(crate) fn others(&mut self, batches: [&Batches; 2]) -> &mut [Block] {
        &mut self.blocks[SHARED * batches.map(Batches::groups).iter().sum::<usize>()..]
    }

    /// Entries of the contacts of each set of batches.
    pub(crate) fn parts(&mut self, batches: [&Batches; 2]) -> [&mut [Block]; 2] {
        let [lanes, serial] = batches.map(Batches::groups);
        assert!(self.blocks.len() >= SHARED * (lanes + serial), "a vector of other contacts");
        self.blocks[..SHARED * (lanes + serial)].split_at_mut(SHARED * lanes).into()
    }

    /// Removes all entries.
    pub(crate) fn clear(&mut self) {
        self.blocks.clear();
    }

    /// Whether it has no entries.
    pub(crate) fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// All entries.
    pub fn entries(&self) -> &[PointEntry] {
        bytemuck::cast_slice(&self.blocks)
    }

    fn entries_mut(&mut self) -> &mut [PointEntry] {
        bytemuck::cast_slice_mut(&mut self.blocks)
    }

    /// Bytes held.
    pub(crate) fn held_bytes(&self) -> usize {
        held(&self.blocks)
    }
}

/// Indices of the lane vectors `[normal, tangential]` of point `point`, for the batch that begins at slot
/// `slot`. In lane vectors, within the entries of its set of batches.
#[inline(always)]
pub(crate) fn places<L: Lanes>(slot: usize, point: usize) -> [usize; 2] {
    let per_block = 16 / L::WIDTH;
    let first = (SHARED * (slot / 16) + 2 * point) * per_block + slot % 16 / L::WIDTH;
    [first, first + per_block]
}

/// Replaces every entry of `to` by the result of `f`, given the entries of `to` and of `from`.
///
/// # Panics
/// If a vector is shorter than the first.
#[inline(always)]
pub fn update<const M: usize, const N: usize>(
    to: [&mut PointVector; M],
    from: [&PointVector; N],
    f: impl Fn([PointEntry; M], [PointEntry; N]) -> [PointEntry; M],
) {
    let count = to.first().map_or(0, |v| v.entries().len());
    let mut to = to.map(|v| &mut v.entries_mut()[..count]);
    let from = from.map(|v| &v.entries()[..count]);
    for i in 0..count {
        let new = f(std::array::from_fn(|k| to[k][i]), std::array::from_fn(|k| from[k][i]));
        to.iter_mut().zip(new).for_each(|(to, new)| to[i] = new);
    }
}

/// x·y.
pub fn dot(x: &PointVector, y: &PointVector) -> f64 {
    sum_of_products([x, y], |both| both)
}

/// Σ x y/m, which adds N·s and N·m·s as energies; x·y without masses.
pub fn energy(x: &PointVector, y: &PointVector, masses: Option<&PointVector>) -> f64 {
    match masses {
        Some(masses) => sum_of_products([x, y, masses], |[x, y, m]| [x, quotient(y, m)]),
        None => dot(x, y),
    }
}

/// Sum over all entries of the product of the two results of `f`, given the entries of `from`.
///
/// # Panics
/// If a vector is shorter than the first.
#[inline(always)]
pub fn sum_of_products<const N: usize>(
    from: [&PointVector; N],
    f: impl Fn([PointEntry; N]) -> [PointEntry; 2],
) -> f64 {
    let count = from.first().map_or(0, |v| v.entries().len());
    let from = from.map(|v| &v.entries()[..count]);
    let mut sums = [0.0_f64; 16];
    for [x, y] in (0..count).map(|i| f(std::array::from_fn(|k| from[k][i]))) {
        for (x, y) in x.iter().zip(&y) {
            let (x, y) = (x.as_array(), y.as_array());
            for k in 0..16 {
                sums[k] += f64::from(x[k]) * f64::from(y[k]);
            }
        }
    }
    sums.iter().sum()
}

/// x + y.
#[inline(always)]
pub fn sum(x: PointEntry, y: PointEntry) -> PointEntry {
    [x[0] + y[0], x[1] + y[1]]
}

/// x − y.
#[inline(always)]
pub fn difference(x: PointEntry, y: PointEntry) -> PointEntry {
    [x[0] - y[0], x[1] - y[1]]
}

/// factor x.
#[inline(always)]
pub fn scaled(factor: f32, x: PointEntry) -> PointEntry {
    let factor = Wide::splat(factor);
    [factor * x[0], factor * x[1]]
}

/// x + factor y.
#[inline(always)]
pub fn plus_scaled(x: PointEntry, factor: f32, y: PointEntry) -> PointEntry {
    sum(x, scaled(factor, y))
}

/// `x / y` where y > 0, and 0 elsewhere, entry by entry.
#[inline(always)]
pub fn quotient(x: PointEntry, y: PointEntry) -> PointEntry {
    [0, 1].map(|axis| Lanes::select_positive(y[axis], x[axis] / y[axis], Wide::zero()))
}
