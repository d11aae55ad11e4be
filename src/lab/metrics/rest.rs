//! Rest: speed, creep and settling time.

use super::law::{PointStep, tangent};
use super::state::BodyState;
use glam::DVec2;
use std::collections::VecDeque;

/// Length of the window at the end of a run in which rest and creep are measured (s).
pub const REST_WINDOW: f64 = 1.0;

/// A scene has settled if its √(E_kin/M) stays below this (m/s).
pub const SETTLED_SPEED: f64 = 1e-3;

/// Time for which it must stay below [`SETTLED_SPEED`] (s).
pub const SETTLED_FOR: f64 = 1.0;

/// A speed with its uncertainty.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slope {
    /// m/s
    pub speed: f64,
    /// Half the width of the 95 % interval (m/s).
    pub half_width: f64,
}

/// The least-squares slope of `values` (m) at intervals of `dt` (s); `None` for fewer than three values.
///
/// With t̄ the middle of the times t_i and n values,
///
/// ```text
/// b = Σ (t_i − t̄) y_i / Σ (t_i − t̄)²,   s_b² = Σ (y_i − fit)² / ((n − 2) Σ (t_i − t̄)²)
/// ```
///
/// and the interval is b ± t_{0.975, n−2} s_b. It assumes independent residuals; if they are waves longer
/// than a step, it is too narrow.
pub fn slope(values: &[f64], dt: f64) -> Option<Slope> {
    let n = values.len();
    if n < 3 {
        return None;
    }
    let middle = 0.5 * (n - 1) as f64;
    let time = |i: usize| (i as f64 - middle) * dt;
    let mean = values.iter().sum::<f64>() / n as f64;
    let spread: f64 = (0..n).map(|i| time(i).powi(2)).sum();
    let speed = values.iter().enumerate().map(|(i, y)| time(i) * (y - mean)).sum::<f64>() / spread;
    let squares: f64 = values.iter().enumerate().map(|(i, y)| (y - mean - speed * time(i)).powi(2)).sum();
    let deviation = (squares / ((n - 2) as f64 * spread)).sqrt();
    Some(Slope { speed, half_width: student_975(n - 2) * deviation })
}

/// The 97.5 % quantile of Student's distribution with ν degrees of freedom: exact for ν ≤ 4, otherwise by the
/// Cornish–Fisher expansion in 1/ν, whose error is below 0.3 % at ν = 5.
pub(in crate::lab) fn student_975(nu: usize) -> f64 {
    const FEW: [f64; 4] = [12.7062, 4.3027, 3.1824, 2.7764];
    if let Some(&known) = nu.checked_sub(1).and_then(|i| FEW.get(i)) {
        return known;
    }
    let (z, nu): (f64, f64) = (1.959_964, nu as f64);
    let first = (z.powi(3) + z) / 4.0;
    let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
    let third = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
    z + first / nu + second / nu.powi(2) + third / nu.powi(3)
}

/// Tracks speeds and positions.
#[derive(Clone, Debug)]
pub struct Rest {
    dt: f64,
    steps: u64,
    /// 2 E_kin/M over the last [`REST_WINDOW`] (m²/s²).
    speeds: VecDeque<f64>,
    /// Centers of mass in the same window (m).
    positions: VecDeque<Vec<DVec2>>,
    /// Bodies that press on each other, with the tangent of their contact.
    touching: Vec<([usize; 2], DVec2)>,
    /// Step after which the speed has stayed low.
    calm_since: Option<u64>,
    settled: Option<f64>,
}

impl Rest {
    /// A tracker for steps of `dt` (s).
    pub fn new(dt: f64) -> Self {
        Rest {
            dt,
            steps: 0,
            speeds: VecDeque::new(),
            positions: VecDeque::new(),
            touching: Vec::new(),
            calm_since: None,
            settled: None,
        }
    }

    /// Adds the end of a step: 2 E_kin/M (m²/s²), bodies, contact points.
    pub fn add(&mut self, square: f64, bodies: &[BodyState], points: &[([usize; 2], PointStep)]) {
        self.steps += 1;
        self.speeds.push_back(square);
        self.positions.push_back(bodies.iter().map(|b| b.position).collect());
        if self.speeds.len() > (REST_WINDOW / self.dt).round().max(1.0) as usize {
            self.speeds.pop_front();
            self.positions.pop_front();
        }
        let pressing = points.iter().filter(|(_, p)| p.impulse[0] > 0.0);
        self.touching.clear();
        self.touching.extend(pressing.map(|&(bodies, p)| (bodies, tangent(p.normal))));
        // Both points of a manifold give the same entry.
        self.touching.dedup();

        if 0.5 * square >= SETTLED_SPEED.powi(2) {
            self.calm_since = None;
            return;
        }
        let since = *self.calm_since.get_or_insert(self.steps);
        // The speed was low at both ends of every one of these steps.
        if (self.steps - since) as f64 * self.dt >= SETTLED_FOR - 1e-9 && self.settled.is_none() {
            self.settled = Some(since as f64 * self.dt);
        }
    }

    /// Root mean square of √(2 E_kin/M) over the window (m/s).
    pub fn speed(&self) -> f64 {
        (self.speeds.iter().sum::<f64>() / self.speeds.len().max(1) as f64).sqrt()
    }

    /// First time from which √(E_kin/M) stayed below [`SETTLED_SPEED`] for [`SETTLED_FOR`] (s).
    pub fn settled(&self) -> Option<f64> {
        self.settled
    }

    /// The fastest creep: the slope of a center of mass relative to that of a body it presses on, along the
    /// tangent of their contact, among bodies that press on each other at the end. Bodies that roll or slide
    /// on purpose count as creeping, too.
    pub fn creep(&self) -> Slope {
        let slopes = self.touching.iter().filter_map(|&([a, b], tangent)| {
            let along: Vec<f64> = self.positions.iter().map(|x| (x[b] - x[a]).dot(tangent)).collect();
            slope(&along, self.dt)
        });
        slopes.fold(Slope::default(), |worst, s| if s.speed.abs() > worst.speed.abs() { s } else { worst })
    }
}

#[cfg(test)]
mod tests {
    use super::super::law::tests::point;
    use super::super::state::tests::body;
    use super::*;

    #[test]
    fn a_line_has_its_slope_and_no_uncertainty() {
        let line: Vec<f64> = (0..9).map(|i| 2.0 - 0.75 * i as f64).collect();
        assert_eq!(slope(&line, 0.5), Some(Slope { speed: -1.5, half_width: 0.0 }));
        assert_eq!(slope(&[1.0, 2.0], 1.0), None);
    }

    #[test]
    fn the_interval_is_students() {
        // y = 0, 1, 0, 1, 0 about t = −2 … 2: slope 0, Σ(y − 0.4)² = 1.2, s_b² = 1.2/(3·10).
        let s = slope(&[0.0, 1.0, 0.0, 1.0, 0.0], 1.0).unwrap();
        assert!(s.speed.abs() < 1e-16);
        assert!((s.half_width - 3.1824 * 0.2).abs() < 1e-12, "{s:?}");
        // y = 0, 0, 3 about t = −1, 0, 1: slope 1.5, residuals ½, −1, ½, s_b² = 1.5/2.
        let s = slope(&[0.0, 0.0, 3.0], 1.0).unwrap();
        assert!((s.speed - 1.5).abs() < 1e-15 && (s.half_width - 12.7062 * 0.75_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn quantiles_are_those_of_tables() {
        for (nu, table) in [(3, 3.1824), (5, 2.5706), (10, 2.2281), (30, 2.0423), (58, 2.0017)] {
            assert!((student_975(nu) / table - 1.0).abs() < 3e-3, "{nu}: {}", student_975(nu));
        }
    }

    /// The body slides on body 0 along −x at `speed`, for `steps` of 0.1 s.
    fn sliding(speed: f64, steps: u32) -> Rest {
        let mut rest = Rest::new(0.1);
        for i in 1..=steps {
            let moved = BodyState { position: DVec2::new(-speed * 0.1 * i as f64, 7.0), ..body() };
            rest.add(speed * speed, &[body(), moved], &[([0, 1], point(0.0, [1.0, 0.0]))]);
        }
        rest
    }

    #[test]
    fn creep_is_the_slope_along_the_tangent() {
        // The tangent of the normal +y is +x.
        let creep = sliding(0.25, 30).creep();
        assert!((creep.speed + 0.25).abs() < 1e-14 && creep.half_width < 1e-13, "{creep:?}");
        let mut apart = sliding(0.25, 30);
        apart.add(0.0, &[body(), body()], &[([0, 1], point(0.0, [0.0, 0.0]))]);
        assert_eq!(apart.creep(), Slope::default());
    }

    #[test]
    fn the_speed_is_of_the_window_only() {
        let mut rest = sliding(2.0, 30);
        assert!((rest.speed() - 2.0).abs() < 1e-15);
        for _ in 0..10 {
            rest.add(0.0, &[], &[]);
        }
        assert_eq!(rest.speed(), 0.0);
    }

    #[test]
    fn it_settles_when_it_stays_slow_for_a_second() {
        let mut rest = Rest::new(0.1);
        let mut add = |square: f64, steps: u32| {
            (0..steps).for_each(|_| rest.add(square, &[], &[]));
            rest.settled()
        };
        // ½ (1.5e-3)² > (1e-3)², but ½ (1.4e-3)² is less.
        assert_eq!(add(1.4e-3 * 1.4e-3, 9), None);
        assert_eq!(add(1.5e-3 * 1.5e-3, 4), None);
        assert_eq!(add(0.0, 10), None);
        // Low since the end of step 14; a second after it is the end of step 24.
        assert_eq!(add(0.0, 1), Some(14.0 * 0.1));
        // Once settled, a kick does not unsettle.
        assert_eq!(add(9.0, 1), Some(14.0 * 0.1));
    }
}
