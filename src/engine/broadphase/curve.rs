//! Hilbert's curve.

/// Bits per coordinate on the curve.
pub const BITS: u32 = 10;

/// Distance along Hilbert's curve of a cell of the square of 2^[`BITS`] cells per side.
///
/// Proceeds from the largest quadrants to the smallest. The curve passes the quadrants (0,0), (0,1), (1,1),
/// (1,0), mirrored in the first and the last so that the parts connect.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Neighbors on the curve are neighbors in the square, and every cell is visited once.
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
