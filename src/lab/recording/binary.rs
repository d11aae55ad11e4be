//! Encoding of numbers in a payload: groups of seven bits, and halves of an `f32`.

/// Appends an unsigned number.
pub fn put(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

/// Appends a signed number: 0, −1, 1, −2, … become 0, 1, 2, 3, ….
pub fn put_signed(bytes: &mut Vec<u8>, value: i64) {
    put(bytes, ((value << 1) ^ (value >> 63)) as u64);
}

/// The upper half of an `f32`, rounded to nearest: eight significant bits.
pub fn half(value: f32) -> u16 {
    let bits = value.to_bits();
    if value.is_finite() { ((bits.saturating_add(0x7fff + ((bits >> 16) & 1))) >> 16) as u16 } else { 0 }
}

/// The number encoded by [`half`].
pub fn whole(half: u16) -> f32 {
    f32::from_bits(u32::from(half) << 16)
}

/// Adler-32 of RFC 1950, the last four bytes of a zlib stream, highest byte first.
pub fn adler32(bytes: &[u8]) -> u32 {
    const PRIME: u32 = 65_521;
    // 5552 bytes are the most whose sums do not overflow before the remainder is taken.
    let (a, b) = bytes.chunks(5552).fold((1, 0), |(a, b), chunk| {
        let sums = chunk.iter().fold((a, b), |(a, b), &byte| (a + u32::from(byte), b + a + u32::from(byte)));
        (sums.0 % PRIME, sums.1 % PRIME)
    });
    (b << 16) | a
}

/// Reads from the front of a slice; `None` at its end.
pub struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Reader { bytes }
    }

    pub fn remaining(&self) -> usize {
        self.bytes.len()
    }

    pub fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.bytes.split_at_checked(count)?;
        self.bytes = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub fn f32(&mut self) -> Option<f32> {
        self.array().map(f32::from_le_bytes)
    }

    pub fn unsigned(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..=56).step_by(7) {
            let [byte] = self.array()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }

    pub fn signed(&mut self) -> Option<i64> {
        self.unsigned().map(|v| (v >> 1) as i64 ^ -((v & 1) as i64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back() {
        let mut bytes = Vec::new();
        let values = [0, 1, -1, 63, -64, 64, 1 << 50, -(1 << 50), 123_456_789];
        values.iter().for_each(|&v| put_signed(&mut bytes, v));
        // 0 to ±63 take one byte.
        assert_eq!(&bytes[..5], [0, 2, 1, 126, 127]);
        let mut reader = Reader::new(&bytes);
        assert_eq!(values.map(|_| reader.signed().unwrap()), values);
        assert_eq!((reader.remaining(), reader.signed()), (0, None));
        assert_eq!(Reader::new(&[0x80; 20]).unsigned(), None);
    }

    #[test]
    fn the_checksum_is_that_of_the_rfc() {
        assert_eq!(adler32(b"Wikipedia"), 0x11e6_0398);
        let bytes = vec![255; 100_000];
        let stream = miniz_oxide::deflate::compress_to_vec_zlib(&bytes, 6);
        assert_eq!(adler32(&bytes).to_be_bytes(), stream[stream.len() - 4..]);
    }

    #[test]
    fn half_of_a_float_keeps_eight_bits() {
        for value in [0.0_f32, 1.0, -2.5, 1e-7, 3.3e6, 0.333_333] {
            assert!((whole(half(value)) - value).abs() <= value.abs() / 256.0, "{value}");
        }
        assert_eq!([half(f32::NAN), half(f32::INFINITY)].map(whole), [0.0; 2]);
    }
}
