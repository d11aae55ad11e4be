//! Which settings nobody would give up: the front of speed against error.
//!
//! A setting is dominated if another one is at least as good in time and in error, and
//! better in one of them. Times closer than 3 %, or than twice the spread of either, are
//! a tie, so that noise neither wins nor loses a place. Without ties this is the usual
//! front; with them, a setting that is faster by noise alone must have the smaller error.

/// Times closer than this share are a tie (1).
pub const TIE: f64 = 0.03;

/// What a setting costs and how wrong it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Time of a step, of the setting's fastest lane width (ns).
    pub time: f64,
    /// Spread of that time (ns).
    pub spread: f64,
    /// Any error ≥ 0.
    pub error: f64,
}

/// Whether two times with their spreads differ by no more than noise; all in one unit.
pub fn tie(one: [f64; 2], other: [f64; 2]) -> bool {
    let noise = 2.0 * one[1].max(other[1]);
    (one[0] - other[0]).abs() <= (TIE * one[0].min(other[0])).max(noise)
}

impl Point {
    fn dominates(&self, other: &Point) -> bool {
        let tie = tie([self.time, self.spread], [other.time, other.spread]);
        let earlier = self.time < other.time;
        let faster = earlier && !tie;
        (faster && self.error <= other.error) || ((earlier || tie) && self.error < other.error)
    }
}

/// For each point, whether no other dominates it.
pub fn front(points: &[Point]) -> Vec<bool> {
    points.iter().map(|p| !points.iter().any(|q| q.dominates(p))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(time: f64, error: f64) -> Point {
        Point { time, spread: 0.0, error }
    }

    #[test]
    fn the_front_is_what_no_other_beats_in_both() {
        let points =
            [point(10.0, 3.0), point(20.0, 2.0), point(30.0, 2.0), point(40.0, 1.0), point(50.0, 4.0)];
        assert_eq!(front(&points), [true, true, false, true, false]);
        assert!(front(&[]).is_empty());
    }

    #[test]
    fn noise_wins_no_place() {
        // 2 % faster, but worse: dominated. 4 % faster: on the front.
        assert_eq!(front(&[point(98.0, 2.0), point(100.0, 1.0)]), [false, true]);
        assert_eq!(front(&[point(96.0, 2.0), point(100.0, 1.0)]), [true, true]);
        // The same 4 % with a spread of 3.
        let noisy = Point { spread: 3.0, ..point(96.0, 2.0) };
        assert_eq!(front(&[noisy, point(100.0, 1.0)]), [false, true]);
        // Equal in error and tied in time: both stay.
        assert_eq!(front(&[point(100.0, 1.0), point(101.0, 1.0)]), [true, true]);
    }
}
