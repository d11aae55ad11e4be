//! Places of labels next to marks.

use super::{Pixel, PlotFrame, TICK};

/// Height of labels (pixels).
const LABEL: i32 = 11;

/// The most that a label is wide (pixels): the advances of DejaVu Sans, the widest common sans-serif font.
pub(super) fn width_of(label: &str) -> i32 {
    let advance = |c: char| match c {
        ' ' | '.' | ',' | '·' | ':' | 'i' | 'j' | 'l' => 0.34,
        '(' | ')' | '-' | 'f' | 'r' | 't' => 0.42,
        'a'..='z' if c != 'm' && c != 'w' => 0.64,
        '0'..='9' => 0.64,
        '@' | 'm' | 'M' | 'W' | '%' => 1.0,
        _ => 0.84,
    };
    (label.chars().map(advance).sum::<f64>() * f64::from(TICK) / 1.24).ceil() as i32
}

/// Places labels next to marks where there is room.
#[derive(Default)]
pub(super) struct Labels {
    /// Left, top, right and bottom of what is taken.
    taken: Vec<[i32; 4]>,
}

impl Labels {
    /// The left end of a label next to a mark of radius `r`, and, if it is far away, the end at which a line should
    /// lead to it. `None` if there is no free place.
    pub fn place(
        &mut self,
        (x, y): Pixel,
        r: i32,
        label: &str,
        frame: &PlotFrame,
    ) -> Option<(Pixel, Option<Pixel>)> {
        let (width, half) = (width_of(label), LABEL / 2);
        // Only a large chart has room for labels far away.
        let most = if frame.chart.size[0] > 600 { 4 } else { 1 };
        for away in [r + 3, 40, 80, 130].into_iter().take(most) {
            let (near, far, slant) = (x + away, x - away - width, away * 2 / 3);
            let places = [
                (near, y - slant),
                (near, y + slant),
                (far, y - slant),
                (far, y + slant),
                (x - width / 2, y - away - half),
                (x - width / 2, y + away + half),
            ];
            let free = |&(u, v): &Pixel| {
                let own = [u, v - half, u + width, v + half];
                let inside =
                    u > frame.left && own[2] < frame.right && own[1] > frame.top && own[3] < frame.bottom;
                let apart = |t: &[i32; 4]| own[0] > t[2] || own[2] < t[0] || own[1] > t[3] || own[3] < t[1];
                inside && self.taken.iter().all(apart)
            };
            if let Some(place) = places.into_iter().find(free) {
                self.taken.push([place.0, place.1 - half, place.0 + width, place.1 + half]);
                let end = if place.0 < x { (place.0 + width).min(x) } else { place.0 - 2 };
                return Some((place, (away >= 40).then_some((end, place.1))));
            }
        }
        None
    }

    /// Takes the place of a mark of radius `r`.
    pub fn block(&mut self, (x, y): Pixel, r: i32) {
        self.taken.push([x - r, y - r, x + r, y + r]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::chart::tests::chart;
    use crate::lab::chart::{Chart, FailStrip, LEFT};

    /// Widths of texts in DejaVu Sans at the size of labels, as a browser measures them (pixels).
    const MEASURED: [(&str, f64); 12] = [
        ("pgs", 20.2),
        ("pgs_ngs_block", 81.6),
        ("soft_step 12 of 14", 101.4),
        ("tgs_ngs", 43.3),
        ("@×·µs,", 41.0),
        ("WMWMW", 52.9),
        ("jacobi, xpbd", 68.8),
        ("4 × (1 + 1)", 63.6),
        ("1234567890", 71.8),
        ("nncg", 27.7),
        ("illijt(f)", 32.9),
        ("−1.5e−3 %", 65.3),
    ];

    #[test]
    fn labels_of_close_marks_do_not_touch() {
        for (name, width) in MEASURED {
            assert!(f64::from(width_of(name)) >= width, "{name}: {} < {width}", width_of(name));
        }
        let chart = Chart { size: [900, 500], ..chart(FailStrip::Right) };
        let frame = PlotFrame { chart: &chart, left: LEFT, right: 852, top: 30, bottom: 452 };
        let (mut labels, mut placed) = (Labels::default(), Vec::new());
        let marks: Vec<Pixel> = (0..40).map(|i| (400 + i * 7 % 30, 200 + i * 11 % 24)).collect();
        marks.iter().for_each(|&mark| labels.block(mark, 4));
        for (&mark, (name, width)) in marks.iter().zip(MEASURED.iter().cycle()) {
            let place = labels.place(mark, 4, name, &frame);
            placed.extend(place.map(|((x, y), _)| (f64::from(x), y, *width)));
        }
        assert!(placed.len() >= 12, "{}", placed.len());
        for (i, (x, y, width)) in placed.iter().enumerate() {
            let is_apart = |(u, v, other): &(f64, i32, f64)| {
                (y - v).abs() >= LABEL || x + width <= *u || u + other <= *x
            };
            assert!(placed[..i].iter().all(is_apart), "{placed:?}");
            assert!(*x >= 72.0 && x + width <= 852.0, "{placed:?}");
        }
    }
}
