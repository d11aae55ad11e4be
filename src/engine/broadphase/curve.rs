//! Hilbert's curve, and sorting along it.

/// Bits of a coordinate on the curve.
pub const BITS: u32 = 10;

/// Distance along Hilbert's curve of a cell of the square of 2^[`BITS`] cells.
///
/// From the largest quadrants to the smallest: the curve passes the quadrants (0,0), (0,1),
/// (1,1), (1,0), mirrored in the first and the last so that it joins its neighbors.
pub fn hilbert(mut x: u32, mut y: u32) -> u32 {
    let mut along = 0;
    for bit in (0..BITS).rev() {
        let (right, top) = (x >> bit & 1, y >> bit & 1);
        along = along << 2 | ((3 * right) ^ top);
        if top == 0 {
            if right == 1 {
                (x, y) = (!x, !y);
            }
            (x, y) = (y, x);
        }
    }
    along
}

/// Stable counting sort by [`BITS`] + 1 bits of the first number from bit `shift` on.
pub fn sort_digit(from: &[[u32; 2]], to: &mut Vec<[u32; 2]>, shift: u32) {
    let digit = |pair: &[u32; 2]| (pair[0] >> shift) as usize & ((2 << BITS) - 1);
    let mut next = [0u32; (2 << BITS) + 1];
    for pair in from {
        next[digit(pair) + 1] += 1;
    }
    for i in 1..next.len() {
        next[i] += next[i - 1];
    }
    to.clear();
    to.resize(from.len(), [0; 2]);
    for pair in from {
        let next = &mut next[digit(pair)];
        to[*next as usize] = *pair;
        *next += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Neighbors on the curve are neighbors in the square, and every cell is passed once.
    #[test]
    fn the_curve_is_hilberts() {
        let side = 1u32 << BITS;
        let mut cells = vec![[0, 0]; (side * side) as usize];
        for x in 0..side {
            for y in 0..side {
                cells[hilbert(x, y) as usize] = [x, y];
            }
        }
        for step in cells.windows(2) {
            assert_eq!(step[0][0].abs_diff(step[1][0]) + step[0][1].abs_diff(step[1][1]), 1, "{step:?}");
        }
    }
}
