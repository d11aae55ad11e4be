//! Sorts pairs found in any order.

use wide::u32x16;

/// Most partners that are sorted in lanes.
const LANES: usize = 16;

/// Most partners that are sorted by insertion.
const FEW: usize = 4;

/// Sorts pairs of proxies, each with the lower index first. Buffers are reused.
#[derive(Clone, Debug, Default)]
pub(super) struct PairSort {
    /// First pair of each proxy in the sorted list, `[proxies + 2]`.
    first: Vec<u32>,
}

impl PairSort {
    /// Sorts `found` into `out`: a counting sort by the lower index, then a sort of each proxy's few
    /// partners.
    pub fn sort(&mut self, proxies: usize, found: &[[u32; 2]], out: &mut Vec<[u32; 2]>) {
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
        out.resize(found.len(), [0; 2]);
        for &pair in found {
            let next = &mut self.first[pair[0] as usize + 1];
            out[*next as usize] = pair;
            *next += 1;
        }
        for range in self.first[..=proxies].windows(2) {
            sort_partners(&mut out[range[0] as usize..range[1] as usize]);
        }
    }
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
