//! The order in which a sweep visits contacts.
//!
//! Within a color, no two contacts push the same body, so only the order of colors matters. A color that is
//! visited k times in a row gets k local iterations of each of its contacts. Serial contacts are visited one
//! by one. The order does not depend on the width. Kernels do not depend on the order: they run over the
//! segments that they are given.

use crate::constraints::records::segment::Segment;

/// The order in which a sweep visits contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SweepOrder {
    /// As assigned: color by color, then the serial contacts.
    #[default]
    Forward,
    /// The reverse of [`Self::Forward`].
    Reverse,
    /// A random order with this seed.
    Random(u64),
    /// Forward, with this many visits of each contact before the next one.
    Local(u32),
    /// Forward, only the contacts of this level ([`Segment::level`]).
    Level(u32),
}

impl SweepOrder {
    /// Sort key of a stage: lower ranks come first.
    pub(crate) fn rank(self, stage: u32) -> u64 {
        match self {
            SweepOrder::Reverse => u64::from(u32::MAX - stage),
            SweepOrder::Random(seed) => mixed(seed ^ u64::from(stage)),
            _ => u64::from(stage),
        }
    }

    /// Lists in `visits` what a pass runs over, given the segments of batches of `width` lanes.
    pub(crate) fn arrange(self, segments: &[Segment], width: usize, visits: &mut Vec<Segment>) {
        visits.clear();
        // Contacts of a segment that may share bodies are visited one at a time.
        let serial = segments.iter().filter(|s| !s.disjoint);
        let single = |s: &Segment| {
            let s = *s;
            (0..s.batches).map(move |batch| Segment {
                first_lane: s.first_lane + batch * width,
                contacts: s.filled(batch, width),
                batches: 1,
                first_vector: s.first_vector + batch * s.stride,
                ..s
            })
        };
        match self {
            SweepOrder::Forward => visits.extend(segments),
            SweepOrder::Level(level) => visits.extend(segments.iter().filter(|s| s.level == level)),
            SweepOrder::Local(times) => {
                for s in segments {
                    if s.disjoint {
                        visits.extend((0..times).map(|_| s));
                    } else {
                        visits.extend(single(s).flat_map(|one| (0..times).map(move |_| one)));
                    }
                }
            }
            SweepOrder::Reverse | SweepOrder::Random(_) => {
                visits.extend(segments.iter().filter(|s| s.disjoint));
                visits.extend(serial.flat_map(single));
                let place = |s: &Segment| if s.disjoint { s.stage } else { s.first_lane as u32 };
                visits.sort_unstable_by_key(|s| (self.rank(place(s)), s.first_lane));
            }
        }
    }
}

/// `x` with its bits mixed: the finalizer of SplitMix64 (Steele, Lea & Flood 2014).
pub(crate) fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraints::records::features::PartnerKind;

    fn segment(stage: u32, first_lane: usize, contacts: usize, disjoint: bool) -> Segment {
        let partner = PartnerKind::Dynamic;
        let (batches, stride) = (contacts, 5);
        Segment {
            partner,
            first_lane,
            contacts,
            batches,
            first_slot: 0,
            first_vector: stride * first_lane,
            stride,
            stage,
            level: stage / 2,
            disjoint,
        }
    }

    fn visited(order: SweepOrder, segments: &[Segment]) -> Vec<(usize, usize)> {
        let mut visits = vec![segments[0]; 3];
        order.arrange(segments, 1, &mut visits);
        assert!(visits.iter().all(|v| v.first_vector == 5 * v.first_lane));
        visits.iter().map(|v| (v.first_lane, v.contacts)).collect()
    }

    #[test]
    fn colors_are_visited_whole_and_serial_contacts_one_by_one() {
        let colors = [segment(0, 0, 3, true), segment(1, 3, 2, true), segment(2, 5, 1, true)];
        assert_eq!(visited(SweepOrder::Forward, &colors), [(0, 3), (3, 2), (5, 1)]);
        assert_eq!(visited(SweepOrder::Reverse, &colors), [(5, 1), (3, 2), (0, 3)]);
        assert_eq!(visited(SweepOrder::Local(2), &colors), [(0, 3), (0, 3), (3, 2), (3, 2), (5, 1), (5, 1)]);
        assert_eq!(visited(SweepOrder::Level(0), &colors), [(0, 3), (3, 2)]);
        let serial = [segment(0, 0, 3, false)];
        assert_eq!(visited(SweepOrder::Reverse, &serial), [(2, 1), (1, 1), (0, 1)]);
        assert_eq!(visited(SweepOrder::Local(2), &serial)[..3], [(0, 1), (0, 1), (1, 1)]);
    }

    #[test]
    fn a_seed_is_an_order_and_another_seed_another() {
        let serial = [segment(0, 0, 40, false)];
        let [one, same, other] = [7, 7, 8].map(|seed| visited(SweepOrder::Random(seed), &serial));
        assert_eq!(one, same);
        assert_ne!(one, other);
        let mut sorted = one.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, visited(SweepOrder::Local(1), &serial));
        assert_ne!(one, sorted);
    }
}
