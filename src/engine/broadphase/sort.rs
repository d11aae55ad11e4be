//! Sorts pairs found in any order.

use crate::workers::Workers;
use std::ops::Range;
use wide::u32x16;

/// Most partners that are sorted in lanes.
const LANES: usize = 16;

/// Most partners that are sorted by insertion.
const FEW: usize = 4;

/// Least number of proxies that are worth a thread.
const LEAST_PROXIES: usize = 1024;

/// Pairs of proxies, each with the lower index first, in the order of that index. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(super) struct ByLower {
    /// First pair of each proxy, `[proxies + 2]`.
    first: Vec<u32>,
    pairs: Vec<[u32; 2]>,
}

impl ByLower {
    /// Sorts `found` by the lower index: a counting sort.
    pub fn sort(&mut self, proxies: usize, found: &[[u32; 2]]) {
        self.first.clear();
        self.first.resize(proxies + 2, 0);
        for pair in found {
            self.first[pair[0] as usize + 2] += 1;
        }
        let mut sum = 0;
        for first in &mut self.first {
            sum += *first;
            *first = sum;
        }
        self.pairs.resize(found.len(), [0; 2]);
        for &pair in found {
            let next = &mut self.first[pair[0] as usize + 1];
            self.pairs[*next as usize] = pair;
            *next += 1;
        }
    }

    /// Number of pairs of the proxies before `proxy`.
    fn before(&self, proxy: usize) -> usize {
        self.first[proxy] as usize
    }

    /// Pairs whose lower proxy is in this range.
    fn of(&self, proxies: Range<usize>) -> &[[u32; 2]] {
        &self.pairs[self.before(proxies.start)..self.before(proxies.end)]
    }
}

/// Merges lists that share no pair into `out`, in ascending order.
pub(super) fn merge<'a, L>(proxies: usize, lists: L, out: &mut Vec<[u32; 2]>, workers: &Workers)
where
    L: Iterator<Item = &'a ByLower> + Clone + Sync,
{
    let before = |proxy: usize| lists.clone().map(|list| list.before(proxy)).sum::<usize>();
    out.resize(before(proxies), [0; 2]);
    let size = workers.part(proxies, LEAST_PROXIES);
    let mut rest = &mut out[..];
    let parts = (0..proxies).step_by(size).map(|first| {
        let part = first..(first + size).min(proxies);
        let len = before(part.end) - before(part.start);
        (part, rest.split_off_mut(..len).expect("room for all pairs"))
    });
    workers.each(parts, |(part, mut out)| {
        let mut lists = lists.clone();
        let Some(first) = lists.next() else { return };
        let is_only = lists.clone().next().is_none();
        if is_only {
            out.copy_from_slice(first.of(part.clone()));
        }
        for proxy in part {
            let own = first.of(proxy..proxy + 1);
            let mut len = own.len();
            if !is_only {
                let partners = own.iter().chain(lists.clone().flat_map(|list| list.of(proxy..proxy + 1)));
                len = out.iter_mut().zip(partners).map(|(to, &pair)| *to = pair).count();
            }
            sort_partners(out.split_off_mut(..len).expect("room for all pairs"));
        }
    });
}

/// Sorts the partners of one proxy: the position of each is the number of lower ones. Without data-dependent
/// branches, this takes half the time of an insertion sort.
#[inline]
fn sort_partners(pairs: &mut [[u32; 2]]) {
    let count = pairs.len();
    if count > LANES {
        pairs.sort_unstable_by_key(|pair| pair[1]);
        return;
    }
    if count <= FEW {
        for i in 1..count {
            for hole in (1..=i).rev() {
                if pairs[hole - 1][1] <= pairs[hole][1] {
                    break;
                }
                pairs.swap(hole - 1, hole);
            }
        }
        return;
    }
    let mut partners = [u32::MAX; LANES];
    for (partner, pair) in partners.iter_mut().zip(pairs.iter()) {
        *partner = pair[1];
    }
    let all = u32x16::new(partners);
    for &partner in &partners[..count] {
        let lower = u32x16::splat(partner).simd_gt(all).to_bitmask().count_ones();
        pairs[lower as usize % LANES][1] = partner;
    }
}
