//! Brute-force test of every pair: the reference for the other kinds.

use super::Proxy;

/// Writes every `[i, j]`, i < j, with `proxies[i].may_touch(&proxies[j])` to `out`, ascending.
///
/// n(n − 1)/2 tests; nothing is kept between calls.
pub fn all_pairs(proxies: &[Proxy], out: &mut Vec<[u32; 2]>) {
    out.clear();
    for (i, a) in proxies.iter().enumerate() {
        for (j, b) in proxies.iter().enumerate().skip(i + 1) {
            if a.may_touch(b) {
                out.push([i as u32, j as u32]);
            }
        }
    }
}
