//! Lists of pairs of one kind, as kernels read them.

use crate::lanes::IndexList;

/// Pairs of one kind, one entry each in every list; first those with a contact.
#[derive(Clone, Debug, Default)]
pub struct Jobs {
    /// The caller's index of the pair.
    pub name: Vec<u32>,
    /// Bodies of a and b.
    pub bodies: [Vec<u32>; 2],
    /// Numbers of shapes a and b ([`super::batch::Shapes::push`]).
    pub shapes: [Vec<u32>; 2],
    /// The contact that stores the manifold, or [`NO_CONTACT`].
    pub contact: Vec<u32>,
    /// Number of pairs with a contact.
    pub touching: usize,
}

/// Index of a pair without a contact.
pub const NO_CONTACT: u32 = u32::MAX;

/// Number of lists of [`Jobs`].
pub(super) const LISTS: usize = 6;
/// The last of [`JobLists::lists`].
pub(super) const CONTACT: usize = LISTS - 1;

/// [`Jobs`] with checked bounds.
#[derive(Clone, Copy)]
pub(super) struct JobLists<'a> {
    /// Bodies and shapes of a and b, names, and contacts.
    pub lists: [IndexList<'a>; LISTS],
    /// [`Jobs::touching`].
    pub touching: usize,
}

impl Jobs {
    /// Replaces the jobs by those of `pairs` that `job` keeps. `job` returns whether to keep a pair, and its
    /// bodies, shapes and contact.
    ///
    /// Every pair is written, whether kept or not, which avoids a branch: after the last kept one with a contact, or before
    /// the last kept one without.
    #[inline(always)]
    pub fn list(&mut self, pairs: &[u32], mut job: impl FnMut(u32) -> (bool, [u32; 2], [u32; 2], u32)) {
        let Jobs { name, bodies: [a, b], shapes: [c, d], contact, touching } = self;
        let mut lists = [name, a, b, c, d, contact];
        let (mut front, mut back) = (0, pairs.len());
        {
            let [name, a, b, c, d, contact] = lists.each_mut().map(|list| {
                list.resize(pairs.len(), 0);
                &mut list[..pairs.len()]
            });
            for &pair in pairs {
                let (keep, bodies, shapes, of_pair) = job(pair);
                let touches = of_pair != NO_CONTACT;
                let at = if touches { front } else { back - 1 };
                name[at] = pair;
                [a[at], b[at]] = bodies;
                [c[at], d[at]] = shapes;
                contact[at] = of_pair;
                front += usize::from(keep & touches);
                back -= usize::from(keep & !touches);
            }
        }
        for list in lists {
            list.copy_within(back.., front);
            list.truncate(front + pairs.len() - back);
        }
        *touching = front;
    }
}
