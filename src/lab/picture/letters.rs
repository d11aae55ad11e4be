//! Letters made of strokes, for bitmaps. Installed fonts are not used, so a picture has the same text on
//! every machine.
//!
//! A letter is defined on a grid, four units wide and six high. A point is two characters, x and y; `a` and
//! `b` are one and two units below the baseline. The points of a stroke follow each other, and strokes are
//! separated by spaces. A stroke of zero length is a dot.

/// Width of a digit including the space after it, in units.
const ADVANCE: f64 = 5.6;
/// Space after a letter.
const GAP: f64 = 1.7;
/// Height of a capital, in units.
pub const HEIGHT: f64 = 6.0;

const LETTERS: &[(char, &str)] = &[
    ('0', "100105163645413010 1433"),
    ('1', "042620 0040"),
    ('2', "05163645440040"),
    ('3', "05163645443313 334241301001"),
    ('4', "30360242"),
    ('5', "460603334241301001"),
    ('6', "453616050110304142331302"),
    ('7', "064610"),
    ('8', "13040516364544331302011030414233"),
    ('9', "011030414536160504133344"),
    ('a', "0314344340 421201103041"),
    ('b', "0600 0110304143341403"),
    ('c', "4334140301103041"),
    ('d', "4640 4130100103143443"),
    ('e', "02424334140301103041"),
    ('f', "46362520 1434"),
    ('g', "444a3b1b0a 4130100103143443"),
    ('h', "0600 0314344340"),
    ('i', "2420 2626"),
    ('j', "242a1b0b 2626"),
    ('k', "0600 4401 1240"),
    ('l', "16262130"),
    ('m', "0004 03142320 23344340"),
    ('n', "0004 0314344340"),
    ('o', "100103143443413010"),
    ('p', "040b 0314344341301001"),
    ('q', "444b 4334140301103041"),
    ('r', "0004 03143443"),
    ('s', "43341403123241301001"),
    ('t', "26213040 0444"),
    ('u', "0401103041 4440"),
    ('v', "042044"),
    ('w', "0410233044"),
    ('x', "0440 0044"),
    ('y', "0420 441b0b"),
    ('z', "04440040"),
    ('A', "002640 1232"),
    ('B', "00063645443303 3342413000"),
    ('C', "4536160501103041"),
    ('D', "00062644422000"),
    ('E', "46060040 0333"),
    ('F', "460600 0333"),
    ('G', "45361605011030414323"),
    ('H', "0600 4640 0343"),
    ('I', "2620 1636 1030"),
    ('J', "4641301001"),
    ('K', "0600 4602 1340"),
    ('L', "060040"),
    ('M', "0006234640"),
    ('N', "00064046"),
    ('O', "100105163645413010"),
    ('P', "00063645443303"),
    ('Q', "100105163645413010 2240"),
    ('R', "00063645443303 2340"),
    ('S', "453616050413334241301001"),
    ('T', "0646 2620"),
    ('U', "060110304146"),
    ('V', "062046"),
    ('W', "0610243046"),
    ('X', "0640 0046"),
    ('Y', "062346 2320"),
    ('Z', "06460040"),
    ('.', "2020"),
    (',', "201a"),
    (':', "2020 2323"),
    (';', "201a 2323"),
    ('·', "2323"),
    ('-', "1333"),
    ('−', "0343"),
    ('–', "0343"),
    ('—', "0343"),
    ('+', "0343 2125"),
    ('/', "0046"),
    ('\\', "0640"),
    ('(', "36252130"),
    (')', "16252110"),
    ('[', "36262030"),
    (']', "16262010"),
    ('%', "0046 0506160505 3031414130"),
    ('=', "0242 0444"),
    ('_', "0a4a"),
    ('±', "0444 2226 0040"),
    ('×', "0541 0145"),
    ('µ', "040b 0401103041 4440"),
    ('<', "450341"),
    ('>', "054301"),
    ('≤', "460442 0040"),
    ('≥', "064402 0040"),
    ('°', "1516262515"),
    ('\'', "2625"),
    ('"', "1615 3635"),
    ('#', "1016 3036 0242 0444"),
    ('!', "2622 2020"),
    ('?', "05163645442322 2020"),
    ('*', "2125 0442 0244"),
    ('|', "2b26"),
    ('→', "0343 254321"),
    (' ', ""),
];

/// Shown for an unknown letter.
const MISSING: &str = "0006464000";

/// The strokes of a letter, in units: y upward from the baseline.
pub fn strokes(letter: char) -> Vec<Vec<[f64; 2]>> {
    let code = LETTERS.iter().find(|(known, _)| *known == letter).map_or(MISSING, |(_, code)| code);
    let unit = |c: u8| match c {
        b'a' => -1.0,
        b'b' => -2.0,
        digit => f64::from(digit) - f64::from(b'0'),
    };
    let stroke = |text: &str| text.as_bytes().chunks(2).map(|p| [unit(p[0]), unit(p[p.len() - 1])]).collect();
    code.split(' ').filter(|s| !s.is_empty()).map(stroke).collect()
}

/// Left edge of the strokes of a letter, and the advance to the next letter. All digits have the same
/// advance, so that numbers align in columns.
pub fn extent(letter: char) -> [f64; 2] {
    let points = strokes(letter).concat();
    let least = points.iter().map(|p| p[0]).fold(f64::INFINITY, f64::min);
    let most = points.iter().map(|p| p[0]).fold(0.0, f64::max);
    match letter {
        ' ' => [0.0, 3.0],
        digit if digit.is_ascii_digit() => [0.0, ADVANCE],
        _ => [least, most - least + GAP],
    }
}

/// Width of a text (in units).
pub fn width(text: &str) -> f64 {
    (text.chars().map(|c| extent(c)[1]).sum::<f64>() - GAP).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_is_on_the_grid_and_none_is_like_another() {
        for (i, (letter, code)) in LETTERS.iter().enumerate() {
            assert!(code.split(' ').all(|stroke| stroke.len() % 2 == 0), "{letter}");
            for [x, y] in strokes(*letter).concat() {
                assert!((0.0..=4.0).contains(&x) && (-2.0..=6.0).contains(&y), "{letter}");
            }
            let dashes = ['-', '−', '–', '—'];
            let same = |other: &&(char, &str)| other.1 == *code && !dashes.contains(letter);
            assert_eq!(LETTERS[..i].iter().find(same), None, "{letter}");
        }
        let needed = ('a'..='z').chain('A'..='Z').chain('0'..='9').chain("µ·×±−.,:()%/_=<>≤".chars());
        for letter in needed {
            assert!(LETTERS.iter().any(|l| l.0 == letter), "{letter}");
        }
        assert_eq!(strokes('語').len(), 1);
        assert_eq!((extent('i'), extent('m')[1], extent('1')), ([2.0, GAP], 4.0 + GAP, extent('8')));
        assert_eq!((width(""), width("ii")), (0.0, GAP));
    }
}
