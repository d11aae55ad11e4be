//! The frozen problems in `tests/frozen`: their stored solutions are valid, and every family of methods finds
//! them again.

use simpulse::lab::reference::Target;
use simpulse::lab::reference::certify::{AGREED, CERTIFIED, certify, reference};
use simpulse::lab::reference::frozen::Frozen;
use simpulse::lab::reference::gallery;
use simpulse::lab::reference::iterate::{Iteration, Stop, iterate};
use simpulse::lab::reference::stewart_trinkle::stewart_trinkle;
use std::path::PathBuf;

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/frozen").join(format!("{name}.frozen"))
}

fn library() -> Vec<Frozen> {
    gallery::library().iter().map(|(name, _)| Frozen::read(&path(name)).unwrap()).collect()
}

/// Writes the library. The files are test inputs: run this only to extend them.
#[test]
#[ignore = "rewrites tests/frozen"]
fn generate() {
    for (name, problem) in gallery::library() {
        let reference = Some(reference(&problem).unwrap());
        Frozen { problem, reference }.write(&path(name)).unwrap();
    }
}

#[test]
fn files_hold_the_problems_of_the_gallery() {
    for (name, problem) in gallery::library() {
        let frozen = Frozen::read(&path(name)).unwrap();
        assert_eq!((&frozen.problem.name, frozen.problem.h), (&problem.name, problem.h));
        assert_eq!(frozen.problem.contacts.len(), problem.contacts.len());
        assert_eq!(frozen.problem.joints, problem.joints);
        // sin, cos and atan may differ by a rounding between platforms.
        for (a, b) in frozen.problem.contacts.iter().zip(&problem.contacts) {
            for (x, y) in [(a.normal, b.normal), (a.arm_a, b.arm_a), (a.arm_b, b.arm_b)] {
                assert!((x[0] - y[0]).abs() < 1e-15 && (x[1] - y[1]).abs() < 1e-15, "{name}");
            }
        }
    }
}

#[test]
fn stored_solutions_keep_their_certificates() {
    for Frozen { problem, reference } in library() {
        let reference = reference.expect("every file of the library has a reference");
        reference.check(&problem).unwrap();
        assert!(certify(&problem, &reference.impulses) <= CERTIFIED, "{}", problem.name);
    }
}

#[test]
fn every_family_reproduces_the_stored_velocities() {
    for Frozen { problem, reference } in library() {
        let reference = reference.unwrap();
        let by = |method| {
            let stop = Stop { tolerance: 1e-12, iterations: 20_000 };
            iterate(&problem, Target::Rigid, &problem.no_impulses(), method, stop).impulses
        };
        let lemke = problem.joints.is_empty().then(|| stewart_trinkle(&problem, Target::Rigid).unwrap());
        let iterations = [
            ("PGS", by(Iteration::Symmetric)),
            ("NNCG", by(Iteration::Conjugate)),
            ("Anderson", by(Iteration::Anderson(20))),
        ];
        for (name, impulses) in iterations.into_iter().chain(lemke.map(|impulses| ("Lemke", impulses))) {
            let distance = problem.velocity_error(&problem.velocities(&impulses), &reference.velocities);
            assert!(distance <= AGREED, "{name} on {}: {distance:e}", problem.name);
        }
    }
}

/// Lemke's method must certify a solution of every shaken pyramid, jammed or not: in theory there is one
/// (copositive matrix, right-hand sides ≥ 0). An artificial variable that vanishes has left the basis; otherwise
/// paths end on spurious rays.
#[test]
fn shaken_pyramids_are_certified() {
    for (base, friction) in [(2, 0.6), (3, 0.6), (4, 0.6), (6, 0.6), (6, 0.1), (6, 1.5)] {
        for (seed, velocity_increment) in [(1, 0.01), (2, 1.0), (3, 0.01), (4, 1.0)] {
            let p = gallery::shaken(gallery::box_pyramid(base, friction), seed, velocity_increment);
            p.validate().unwrap();
            let residual = certify(&p, &stewart_trinkle(&p, Target::Rigid).unwrap());
            assert!(residual <= CERTIFIED, "{}: {residual:e}", p.name);
        }
    }
}

/// Energy after a step never exceeds that of the free velocities: λᵀ(u⁺ + u*)/2 = T⁺ − T*, and
/// u⁺ᵀλ ≤ 0 where all b are 0.
#[test]
fn solutions_dissipate() {
    for seed in 1..=4 {
        let mut p = gallery::shaken(gallery::box_pyramid(4, 0.6), seed, 1.0);
        p.contacts.iter_mut().for_each(|c| c.gap = c.gap.min(0.0));
        let free: Vec<_> = p.bodies.iter().map(|b| b.free_velocity).collect();
        let velocities = p.velocities(&stewart_trinkle(&p, Target::Rigid).unwrap());
        assert!(p.mass_norm(&velocities) < p.mass_norm(&free), "seed {seed}");
    }
}
