//! The limit of a phase, in terms of the roofline.

use super::PhaseReport;

/// The resource that limits a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Moving bytes between the level of memory that holds the working set and the core.
    Bandwidth,
    /// Floating-point operations.
    Compute,
    /// Neither: chains of dependent operations, gathers, branches.
    Latency,
    /// Not bandwidth. Operations are not counted in this phase, so compute and latency cannot be
    /// distinguished.
    NotBandwidth,
    /// Within the noise of the ceilings and of the passes, more than one verdict is possible.
    CannotTell,
}

/// Relative error of a ceiling (1): measured twice on a shared machine, bandwidths differ by a tenth.
const NOISE: f64 = 0.1;

/// A phase that reaches this fraction of a ceiling is bound by it (1).
pub const REACHED: f64 = 0.5;

impl Limit {
    /// The limit of a phase, from its bandwidth and `multiply_adds` (GFLOP/s). `None` if the phase does
    /// nothing or ceilings were not measured.
    pub fn of(phase: &PhaseReport, multiply_adds: Option<f64>) -> Option<Limit> {
        let peak = multiply_adds?;
        let bandwidth = phase.bandwidth?.of_mix(&phase.traffic);
        if phase.pass_ns <= 0.0 || phase.traffic.total() <= 0.0 {
            return None;
        }
        let memory = phase.traffic.total() / bandwidth / phase.pass_ns;
        let arithmetic = phase.flops.map(|flops| flops / peak / phase.pass_ns);
        // Ceilings vary from run to run with the machine's clock, independently of each other.
        let noise = 1.0 + NOISE + phase.spread_ns / phase.pass_ns;
        let corners =
            [(noise, 1.0 / noise), (1.0 / noise, noise), (noise, noise), (1.0 / noise, 1.0 / noise)];
        let verdict = |a: f64, b: f64| Limit::at(a * memory, arithmetic.map(|x| b * x));
        let own = verdict(1.0, 1.0);
        let is_sure = corners.into_iter().all(|(a, b)| verdict(a, b) == own);
        Some(if is_sure { own } else { Limit::CannotTell })
    }

    /// From the fractions of both ceilings that are reached (1).
    fn at(memory: f64, arithmetic: Option<f64>) -> Limit {
        match arithmetic {
            None if memory >= REACHED => Limit::Bandwidth,
            None => Limit::NotBandwidth,
            Some(arithmetic) if memory.max(arithmetic) < REACHED => Limit::Latency,
            Some(arithmetic) if memory >= arithmetic => Limit::Bandwidth,
            Some(_) => Limit::Compute,
        }
    }

    /// The usual term, such as `latency-bound`.
    pub fn word(self) -> &'static str {
        match self {
            Limit::Bandwidth => "bandwidth-bound",
            Limit::Compute => "compute-bound",
            Limit::Latency => "latency-bound",
            Limit::NotBandwidth => "latency- or compute-bound",
            Limit::CannotTell => "cannot tell",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::traffic::Traffic;
    use super::super::{Bandwidth, PhaseReport};
    use super::*;
    use crate::engine::clock::Phase;
    use crate::engine::world::Probe;

    #[test]
    fn the_lower_ceiling_binds_if_half_of_it_is_reached() {
        let phase = |pass_ns: f64, flops: Option<f64>| PhaseReport {
            probe: Probe {
                phase: Phase::Solve,
                passes: 1,
                rows: 1,
                operations: None,
                counted_contacts: 1,
                per_contact: [[0.0; 4]; 3],
                bytes: [0.0; 2],
            },
            // 100 ns at 10 GB/s.
            traffic: Traffic { read: 1000.0, written: 0.0, working_set: 1000.0 },
            pass_ns,
            mean_ns: pass_ns,
            longest_ns: pass_ns,
            spread_ns: 0.0,
            passes: 1,
            bandwidth: Some(Bandwidth { read: 10.0, update: 10.0 }),
            flops,
        };
        let of = |pass_ns, flops| Limit::of(&phase(pass_ns, flops), Some(2.0)).map(Limit::word);
        assert_eq!(of(170.0, Some(10.0)), Some("bandwidth-bound"));
        assert_eq!(of(230.0, Some(10.0)), Some("latency-bound"));
        // Within a tenth of half the ceiling, or of each other, the noise decides.
        assert_eq!([of(195.0, Some(10.0)), of(205.0, Some(10.0))], [Some("cannot tell"); 2]);
        assert_eq!([of(150.0, Some(190.0)), of(150.0, Some(210.0))], [Some("cannot tell"); 2]);
        // 400 operations take 200 ns.
        assert_eq!(of(250.0, Some(400.0)), Some("compute-bound"));
        assert_eq!(of(150.0, None), Some("bandwidth-bound"));
        assert_eq!(of(900.0, None), Some("latency- or compute-bound"));
        assert_eq!(Limit::of(&phase(1.0, None), None), None);
    }
}
