//! Both normal impulses of a contact.

/// Normal impulses N ≥ 0 (N·s) with which two points gain `wanted`, or more if a point has no impulse. `k`:
/// velocity that a unit impulse adds to its own point (1/kg); `coupling`: to the other point; `old`: impulses
/// so far; `wanted`: normal velocity still to gain (m/s).
///
/// ```text
/// k₀ N₀ + c N₁ = b₀,   c N₀ + k₁ N₁ = b₁,   b = wanted + what the old ones have given
/// ```
///
/// If neither impulse is negative, they are the solution. If one is negative, that point leaves and the other
/// is solved by its own row. `None` if neither case applies, or if both points coincide.
pub(super) fn impulses(k: [f32; 2], coupling: f32, old: [f32; 2], wanted: [f32; 2]) -> Option<[f32; 2]> {
    let determinant = k[0].mul_add(k[1], -(coupling * coupling));
    if determinant <= 0.0 {
        return None;
    }
    let b = [0, 1].map(|i| k[i].mul_add(old[i], coupling.mul_add(old[1 - i], wanted[i])));
    let both = [0, 1].map(|i| k[1 - i].mul_add(b[i], -(coupling * b[1 - i])) / determinant);
    match both.map(|impulse| impulse >= 0.0) {
        [true, true] => Some(both),
        [false, _] if b[1] > 0.0 => Some([0.0, b[1] / k[1]]),
        [_, false] if b[0] > 0.0 => Some([b[0] / k[0], 0.0]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::impulses;

    #[test]
    fn two_points_share_an_impulse_or_one_of_them_leaves() {
        // 7 N₀ + 6 N₁ = 13 and 6 N₀ + 7 N₁ = 13: one each, whatever they had.
        for old in [[0.0, 0.0], [1.5, 0.25]] {
            let left = [13.0 - 7.0 * old[0] - 6.0 * old[1], 13.0 - 6.0 * old[0] - 7.0 * old[1]];
            let new = impulses([7.0, 7.0], 6.0, old, left).unwrap();
            assert!(new.iter().all(|impulse| (impulse - 1.0).abs() < 1e-5), "{new:?}");
        }
        // What stops the second makes the first leave.
        assert_eq!(impulses([7.0, 7.0], 6.0, [0.0; 2], [1.0, 7.0]), Some([0.0, 1.0]));
        assert_eq!(impulses([7.0, 7.0], 6.0, [0.0; 2], [7.0, 1.0]), Some([1.0, 0.0]));
        // Nothing to gain; two points that are one.
        assert_eq!(impulses([7.0, 7.0], 6.0, [0.0; 2], [-1.0, -1.0]), None);
        assert_eq!(impulses([7.0, 7.0], 7.0, [0.0; 2], [1.0, 1.0]), None);
    }
}
