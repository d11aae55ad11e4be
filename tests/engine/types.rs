//! A constraint type defined outside the crate: two points at a fixed distance. It takes part in the colors,
//! batches and passes of every solver with no change to any solver.

use simpulse::engine::bodies::{BodyDef, BodyKind, ShapeDef};
use simpulse::engine::clock::Phase;
use simpulse::engine::constraints::SweepOrder;
use simpulse::engine::constraints::kernels::pass::PassMode;
use simpulse::engine::constraints::kernels::types::{ConstraintType, TypeInput};
use simpulse::engine::lanes::{LaneWidth, Lanes, RowStore};
use simpulse::engine::shapes::Shape;
use simpulse::engine::solvers::{Variant, find};
use simpulse::engine::world::{Order, Settings, World};
use std::sync::{Arc, Mutex};

/// Records: unit vector from a to b (2), distance error (m), effective mass (kg), impulse (N·s).
const STRIDE: usize = 5;

/// Keeps the centers of mass of bodies a and b at a fixed distance: (v_b − v_a)·u + β C/h = 0.
#[derive(Debug)]
struct Rods {
    ends: Vec<[u32; 2]>,
    /// Per rod: u, C and the impulse of the last substep.
    state: Vec<[f32; 4]>,
    seen: Arc<Mutex<Vec<(Phase, usize)>>>,
    /// Impulses at the end of the last step.
    impulses: Arc<Mutex<Vec<f32>>>,
    /// Position sweeps remove errors, instead of velocities.
    nonlinear: bool,
}

impl ConstraintType for Rods {
    fn ends(&self) -> &[[u32; 2]] {
        &self.ends
    }

    fn stride(&self) -> usize {
        STRIDE
    }

    fn run(&mut self, on: TypeInput<'_>) {
        let width = on.width;
        self.seen.lock().unwrap().push((on.phase, on.batches.visits().iter().map(|s| s.contacts).sum()));
        match width {
            LaneWidth::W1 => self.at::<f32>(on),
            LaneWidth::W4 => self.at::<wide::f32x4>(on),
            LaneWidth::W8 => self.at::<wide::f32x8>(on),
            LaneWidth::W16 => self.at::<wide::f32x16>(on),
        }
    }

    fn boxed(&self) -> Box<dyn ConstraintType> {
        Box::new(Rods {
            ends: self.ends.clone(),
            state: self.state.clone(),
            seen: self.seen.clone(),
            impulses: self.impulses.clone(),
            nonlinear: self.nonlinear,
        })
    }
}

impl Rods {
    fn at<L: Lanes>(&mut self, mut on: TypeInput<'_>) {
        let relaxation = L::splat(match on.mode {
            PassMode::Jacobi { relaxation } => relaxation,
            _ => 1.0,
        });
        for i in 0..on.batches.visits().len() {
            let segment = on.batches.visits()[i];
            let parts = on.batches.records_with_stride::<L>(&segment, STRIDE);
            let indices =
                parts.contact.batches::<L::Index>().zip(parts.row_a.batches().zip(parts.row_b.batches()));
            for (batch, (record, (rod, (row_a, row_b)))) in
                parts.records.chunks_exact_mut(STRIDE).zip(indices).enumerate()
            {
                let filled = segment.filled(batch, L::WIDTH);
                let rods: &[u32] = rod.entries();
                let (a, b) = (on.rows.gather::<L>(row_a), on.rows.gather::<L>(row_b));
                // The inverse mass may be zero for a while, and is zero in padding.
                let k = a[3] + b[3];
                let mass = k.select_positive(L::splat(1.0) / k, L::zero());
                if on.mode == PassMode::Masses {
                    record[3] = mass;
                    continue;
                }
                if on.mode == PassMode::Forget {
                    record[4] = L::zero();
                    continue;
                }
                if on.phase == Phase::Prepare {
                    let floats: &mut [f32] = bytemuck::cast_slice_mut(record);
                    floats.fill(0.0);
                    for (lane, &rod) in rods[..filled].iter().enumerate() {
                        let [x, y, c, impulse] = self.state[rod as usize];
                        for (q, value) in [x, y, c, 0.0, impulse].into_iter().enumerate() {
                            floats[q * L::WIDTH + lane] = value;
                        }
                    }
                    record[3] = mass;
                    continue;
                }
                if on.phase == Phase::Store {
                    let floats: &[f32] = bytemuck::cast_slice(record);
                    for (lane, &rod) in rods[..filled].iter().enumerate() {
                        self.state[rod as usize][3] = floats[4 * L::WIDTH + lane];
                        self.impulses.lock().unwrap()[rod as usize] = self.state[rod as usize][3];
                    }
                    continue;
                }
                let [x, y, c, mass, old] = [0, 1, 2, 3, 4].map(|q| record[q]);
                if on.phase == Phase::Position && self.nonlinear {
                    // C at the current poses of this sweep.
                    let now = c + x * (b[4] - a[4]) + y * (b[5] - a[5]);
                    let move_by = |row: [L; 8], d: L| {
                        [row[4] + row[3] * d * x, row[5] + row[3] * d * y, row[6], row[7]]
                    };
                    on.rows.scatter_delta(row_b, move_by(b, -(mass * now)));
                    on.rows.scatter_delta(row_a, move_by(a, mass * now));
                    continue;
                }
                let v = x * (b[0] - a[0]) + y * (b[1] - a[1]);
                let bias = if on.phase == Phase::Solve && !self.nonlinear {
                    c * L::splat(0.2 / on.h)
                } else {
                    L::zero()
                };
                let delta = match on.phase {
                    Phase::WarmStart => old,
                    Phase::Solve | Phase::Relax => {
                        let delta = -(relaxation * mass * (v + bias));
                        record[4] = old + delta;
                        delta
                    }
                    _ => continue,
                };
                let push =
                    |row: [L; 8], d: L| [row[0] + row[3] * d * x, row[1] + row[3] * d * y, row[2], row[3]];
                on.rows.scatter_velocity(row_b, push(b, delta));
                on.rows.scatter_velocity(row_a, push(a, -delta));
            }
        }
    }
}

type Seen = Arc<Mutex<Vec<(Phase, usize)>>>;

/// A chain of six discs on the ground, 1 m apart, with a rod between neighbors and a box on top.
fn chain(solver: &'static Variant, width: LaneWidth, order: Order) -> (World, Seen) {
    let mut world = World::new(Settings { order, ..Settings::new(solver).exactly(width) });
    let block = Shape::rectangle("box", glam::Vec2::new(20.0, 1.0), glam::Vec2::ZERO, 0.0, 0.0).unwrap();
    world.add_body(&BodyDef::new(BodyKind::Static, [0.0, -1.0], vec![ShapeDef::new(block)])).unwrap();
    for i in 0..6 {
        let disc = Shape::circle("disc", glam::Vec2::ZERO, 0.4).unwrap();
        let mut body = BodyDef::new(BodyKind::Dynamic, [i as f64, 0.4], vec![ShapeDef::new(disc)]);
        body.velocity = [if i == 5 { 3.0 } else { 0.0 }, 0.0];
        world.add_body(&body).unwrap();
    }
    let seen = Seen::default();
    let ends: Vec<[u32; 2]> = (1..6).map(|i| [i, i + 1]).collect();
    let impulses = Arc::new(Mutex::new(vec![0.0; ends.len()]));
    let state = vec![[1.0, 0.0, 0.0, 0.0]; ends.len()];
    let rods = Rods { state, ends, seen: seen.clone(), impulses, nonlinear: false };
    world.add_constraints(Box::new(rods));
    (world, seen)
}

fn run(world: &mut World, steps: usize) {
    (0..steps).for_each(|_| world.step().unwrap());
}

#[test]
fn rods_hold_under_every_schedule_and_move_as_one() {
    for solver in ["pgs", "soft_step", "pgs_ngs_block", "tgs_ngs", "shock"] {
        let (mut free, _) = chain(find(solver).unwrap(), LaneWidth::W4, Order::Colored);
        free.workspace().types.clear();
        let (mut held, _) = chain(find(solver).unwrap(), LaneWidth::W4, Order::Colored);
        run(&mut free, 60);
        run(&mut held, 60);
        let spread = |world: &World| world.bodies.position_x[6] - world.bodies.position_x[1];
        assert!(spread(&free) > 6.5, "{solver}: {}", spread(&free));
        assert!((spread(&held) - 5.0).abs() < 0.05, "{solver}: {}", spread(&held));
        assert!(held.bodies.position_x[1] > 0.3, "{solver}: the chain moves");
    }
}

#[test]
fn types_have_the_same_bits_at_every_width_and_in_every_order() {
    let hash = |width, order, sweeps: Option<SweepOrder>| {
        let (mut world, _) = chain(find("soft_step").unwrap(), width, order);
        world.step().unwrap();
        if let Some(sweeps) = sweeps {
            // Rearranging the batches and back changes nothing.
            world.workspace().lanes.arrange(sweeps);
        }
        run(&mut world, 40);
        world.state_hash()
    };
    let one = hash(LaneWidth::W1, Order::Colored, None);
    for width in LaneWidth::ALL {
        assert_eq!(hash(width, Order::Colored, None), one, "{width:?}");
    }
    assert_eq!(hash(LaneWidth::W8, Order::Colored, Some(SweepOrder::Random(3))), one);
    assert_ne!(hash(LaneWidth::W1, Order::Natural, None), one, "another order");
}

fn summed(solver: &str, width: LaneWidth, order: Order) -> World {
    let solver = find(solver).unwrap();
    let (mut world, _) = chain(solver, width, order);
    (world.settings.budget.velocity_iterations, world.settings.budget.relax_iterations) = (60, 30);
    if let Ok(relaxation) = solver.parameter("relaxation") {
        // Below 2/λ_max: each disc has three constraints.
        world.settings.parameters[relaxation] = 0.5;
    }
    world
}

/// In one summing sweep, a rod does not see what its neighbors do.
#[test]
fn one_jacobi_sweep_moves_the_neighbors_of_what_moves_and_no_others() {
    let speeds = |solver: &str| {
        let (mut world, _) = chain(find(solver).unwrap(), LaneWidth::W8, Order::Natural);
        let budget = &mut world.settings.budget;
        (budget.substeps, budget.velocity_iterations, budget.relax_iterations) = (1, 1, 0);
        (world.settings.gravity, world.bodies.velocity_x[6], world.bodies.velocity_x[3]) =
            ([0.0; 2], 0.0, 3.0);
        world.step().unwrap();
        [1, 2, 3, 4, 5, 6].map(|i| world.bodies.velocity_x[i])
    };
    let close = |found: [f32; 6], expected: [f32; 6]| {
        // A few roundings at 3 m/s.
        let off = found.iter().zip(expected).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max);
        assert!(off < 1e-6, "{found:?}");
    };
    // Rods 2–3 and 3–4 join equal masses. Each takes half of 3 m/s from disc 3 and gives it to its other
    // disc.
    close(speeds("jacobi"), [0.0, 1.5, 0.0, 1.5, 0.0, 0.0]);
    // In turn: rod 2–3 halves 3 m/s, rod 3–4 halves the rest, and so on to the end of the chain.
    close(speeds("pgs"), [0.0, 1.5, 0.75, 0.375, 0.1875, 0.1875]);
}

#[test]
fn split_masses_count_rods_and_come_back() {
    let mut world = summed("mass_splitting", LaneWidth::W1, Order::Natural);
    world.settings.budget.velocity_iterations = 1;
    world.settings.budget.relax_iterations = 0;
    world.settings.gravity = [0.0; 2];
    world.step().unwrap();
    // Disc 6, at 3 m/s, has one rod and the ground: its mass is split in two. Disc 5 has two rods and the
    // ground: three parts. The rod's impulse is 3/(2 + 3) of m: disc 6 slows down from 3 m/s by 3/5, and disc
    // 5 reaches 3/5.
    let [x5, x6] = [5, 6].map(|i| world.bodies.velocity_x[i]);
    assert!((x5 - 0.6).abs() < 1e-6 && (x6 - 2.4).abs() < 1e-6, "{x5} {x6}");
}

#[test]
fn rods_are_in_the_passes_and_colors_of_the_contacts() {
    let (mut world, seen) = chain(find("soft_step").unwrap(), LaneWidth::W8, Order::Colored);
    world.step().unwrap();
    // Six discs on the ground, and five rods in two colors.
    assert_eq!((world.counts().contacts, world.counts().colors, world.counts().overflow), (6, 3, 0));
    let of = |phase: Phase| -> usize {
        seen.lock().unwrap().iter().filter(|(p, _)| *p == phase).map(|(_, rods)| rods).sum()
    };
    let expected = [
        (Phase::Prepare, 5),
        // Arms of constraints may have turned, so each substep runs a warm-start pass.
        (Phase::WarmStart, 4 * 5),
        (Phase::Solve, 4 * 5),
        (Phase::Relax, 4 * 5),
        (Phase::Position, 0),
        (Phase::Store, 5),
    ];
    for (phase, rods) in expected {
        assert_eq!(of(phase), rods, "{phase:?}");
    }
}

/// Two discs of mass m, 1 m apart, without gravity: the second at `speed`, with a rod whose error is `c`.
fn pair(solver: &str, width: LaneWidth, c: f32, speed: f64) -> (World, Arc<Mutex<Vec<f32>>>) {
    let mut world = World::new(Settings::new(find(solver).unwrap()).exactly(width));
    world.settings.gravity = [0.0; 2];
    for i in 0..2 {
        let disc = Shape::circle("disc", glam::Vec2::ZERO, 0.3).unwrap();
        let mut body = BodyDef::new(BodyKind::Dynamic, [f64::from(i), 0.0], vec![ShapeDef::new(disc)]);
        body.velocity = [f64::from(i) * speed, 0.0];
        world.add_body(&body).unwrap();
    }
    let impulses = Arc::new(Mutex::new(vec![0.0]));
    let rods = Rods {
        ends: vec![[0, 1]],
        state: vec![[1.0, 0.0, c, 0.0]],
        seen: Seen::default(),
        impulses: impulses.clone(),
        nonlinear: true,
    };
    world.add_constraints(Box::new(rods));
    (world, impulses)
}

/// With equal masses, each disc moves by half of the error. The error is linear in their positions, so one
/// sweep removes it.
#[test]
fn position_sweeps_move_bodies_of_other_types_and_leave_velocities() {
    for solver in ["pgs_ngs", "pgs_ngs_block", "tgs_ngs"] {
        for width in LaneWidth::ALL {
            let (mut world, _) = pair(solver, width, 0.1, 0.0);
            world.step().unwrap();
            let b = &world.bodies;
            let off = (b.position_x[0] - 0.05).abs().max((b.position_x[1] - 0.95).abs());
            // A few roundings at 1 m.
            assert!(off < 1e-6, "{solver}, {width:?}: {:?}", b.position_x);
            assert_eq!((b.velocity_x[0], b.velocity_x[1]), (0.0, 0.0), "{solver}, {width:?}");
        }
    }
}

/// In the first step a rod stops its discs from moving apart. The next step has no sweeps that could undo its
/// impulse.
#[test]
fn solvers_that_forget_impulses_forget_those_of_other_types() {
    for (solver, forgets) in [("projection", true), ("tgs_sticky", true), ("pgs", false)] {
        let (mut world, impulses) = pair(solver, LaneWidth::W8, 0.0, 1.0);
        // If substeps start cold, a second substep would have nothing to do.
        world.settings.budget.substeps = 1;
        world.step().unwrap();
        let first = impulses.lock().unwrap()[0];
        assert!(first < -0.1, "{solver}: {first}");
        world.settings.budget.velocity_iterations = 0;
        run(&mut world, 1);
        let last = impulses.lock().unwrap()[0];
        assert_eq!(last.abs() < 1e-5, forgets, "{solver}: {first}, then {last}");
    }
}
