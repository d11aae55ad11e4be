//! A PNG file: signature and four chunks around data compressed by `miniz_oxide`.

/// CRC-32 of the PNG specification: the reflected polynomial 0xedb88320.
fn crc(bytes: impl IntoIterator<Item = u8>) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
        }
    }
    !crc
}

fn chunk(file: &mut Vec<u8>, kind: &[u8; 4], content: &[u8]) {
    file.extend((content.len() as u32).to_be_bytes());
    file.extend(kind);
    file.extend(content);
    file.extend(crc(kind.iter().chain(content).copied()).to_be_bytes());
}

/// A file of 8-bit RGB pixels, row by row.
pub fn png([width, height]: [u32; 2], pixels: &[[u8; 3]]) -> Vec<u8> {
    let mut header = Vec::new();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    // 8 bits, RGB, deflate, filters by row, not interlaced.
    header.extend([8, 2, 0, 0, 0]);
    // Each row is stored as differences to the one above (filter 2), because most of a picture repeats
    // downward.
    let mut rows = Vec::with_capacity(pixels.len() * 3 + height as usize);
    let width = width as usize;
    for (y, row) in pixels.chunks(width.max(1)).enumerate() {
        rows.push(2);
        for (x, pixel) in row.iter().enumerate() {
            let above = if y > 0 { pixels[(y - 1) * width + x] } else { [0; 3] };
            rows.extend((0..3).map(|k| pixel[k].wrapping_sub(above[k])));
        }
    }
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    chunk(&mut file, b"IHDR", &header);
    chunk(&mut file, b"IDAT", &miniz_oxide::deflate::compress_to_vec_zlib(&rows, 6));
    chunk(&mut file, b"IEND", &[]);
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_that_of_the_specification() {
        // The check value of CRC-32, and the well-known checksum of an empty IEND chunk.
        assert_eq!(crc(*b"123456789"), 0xcbf4_3926);
        let file = png([1, 1], &[[1, 2, 3]]);
        assert_eq!(file[file.len() - 4..], [0xae, 0x42, 0x60, 0x82]);
    }

    #[test]
    fn pixels_come_back() {
        let pixels: Vec<[u8; 3]> = (0..12).map(|i| [i * 20, 255 - i, i % 3]).collect();
        let file = png([4, 3], &pixels);
        assert_eq!(&file[..8], b"\x89PNG\r\n\x1a\n");
        assert_eq!(&file[12..24], b"IHDR\0\0\0\x04\0\0\0\x03");
        let length = u32::from_be_bytes(file[33..37].try_into().unwrap()) as usize;
        let rows = miniz_oxide::inflate::decompress_to_vec_zlib(&file[41..41 + length]).unwrap();
        let mut above = [[0_u8; 3]; 4];
        for (row, expected) in rows.chunks(13).zip(pixels.chunks(4)) {
            assert_eq!(row[0], 2);
            for x in 0..4 {
                let pixel = [0, 1, 2].map(|k| above[x][k].wrapping_add(row[1 + 3 * x + k]));
                assert_eq!(pixel, expected[x]);
                above[x] = pixel;
            }
        }
    }
}
