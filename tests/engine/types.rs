//! A constraint type from outside: two points that keep a distance. It joins the colours, batches
//! and passes of every solver without a line in any of them.

use simpulse::engine::bodies::{BodyDef, BodyKind, ShapeDef};
use simpulse::engine::clock::Phase;
use simpulse::engine::constraints::SweepOrder;
use simpulse::engine::constraints::pass::PassWidth;
use simpulse::engine::constraints::types::{ConstraintType, TypeInput};
use simpulse::engine::lanes::{LaneWidth, Lanes};
use simpulse::engine::shapes::Shape;
use simpulse::engine::solvers::{Variant, find};
use simpulse::engine::world::{Order, Settings, World};
use std::sync::{Arc, Mutex};

/// Records: unit vector from a to b (2), error of the distance (m), effective mass (kg), impulse (N·s).
const STRIDE: usize = 5;

/// Centres of mass of bodies a and b at a fixed distance: (v_b − v_a)·u + β C/h = 0.
#[derive(Debug)]
struct Rods {
    ends: Vec<[u32; 2]>,
    /// Of each rod: u, C and the impulse of the last substep.
    state: Vec<[f32; 4]>,
    seen: Arc<Mutex<Vec<(Phase, usize)>>>,
}

impl ConstraintType for Rods {
    fn ends(&self) -> &[[u32; 2]] {
        &self.ends
    }

    fn stride(&self) -> usize {
        STRIDE
    }

    fn run(&mut self, on: TypeInput<'_>) {
        let PassWidth { width, .. } = on.width;
        self.seen.lock().unwrap().push((on.phase, on.batches.visits().iter().map(|s| s.contacts).sum()));
        match width {
            LaneWidth::W1 => self.at::<f32>(on),
            LaneWidth::W4 => self.at::<wide::f32x4>(on),
            LaneWidth::W8 => self.at::<wide::f32x8>(on),
            LaneWidth::W16 => self.at::<wide::f32x16>(on),
        }
    }

    fn boxed(&self) -> Box<dyn ConstraintType> {
        Box::new(Rods { ends: self.ends.clone(), state: self.state.clone(), seen: self.seen.clone() })
    }
}

impl Rods {
    fn at<L: Lanes>(&mut self, on: TypeInput<'_>) {
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
                if on.phase == Phase::Prepare {
                    let floats: &mut [f32] = bytemuck::cast_slice_mut(record);
                    floats.fill(0.0);
                    for (lane, &rod) in rods[..filled].iter().enumerate() {
                        let [x, y, c, impulse] = self.state[rod as usize];
                        let inverse = |row: u32| on.rows[row as usize].velocity[3];
                        let k = inverse(row_a.entries()[lane]) + inverse(row_b.entries()[lane]);
                        for (q, value) in [x, y, c, 1.0 / k, impulse].into_iter().enumerate() {
                            floats[q * L::WIDTH + lane] = value;
                        }
                    }
                    continue;
                }
                if on.phase == Phase::Store {
                    let floats: &[f32] = bytemuck::cast_slice(record);
                    for (lane, &rod) in rods[..filled].iter().enumerate() {
                        self.state[rod as usize][3] = floats[4 * L::WIDTH + lane];
                    }
                    continue;
                }
                let (a, b) = (L::gather(on.rows, row_a), L::gather(on.rows, row_b));
                let [x, y, c, mass, old] = [0, 1, 2, 3, 4].map(|q| record[q]);
                let v = x * (b[0] - a[0]) + y * (b[1] - a[1]);
                let bias = if on.phase == Phase::Solve { c * L::splat(0.2 / on.h) } else { L::zero() };
                let delta = match on.phase {
                    Phase::WarmStart => old,
                    Phase::Solve | Phase::Relax => {
                        let delta = -(mass * (v + bias));
                        record[4] = old + delta;
                        delta
                    }
                    _ => continue,
                };
                let push =
                    |row: [L; 8], d: L| [row[0] + row[3] * d * x, row[1] + row[3] * d * y, row[2], row[3]];
                L::scatter_velocity(on.rows, row_b, push(b, delta));
                L::scatter_velocity(on.rows, row_a, push(a, -delta));
            }
        }
    }
}

type Seen = Arc<Mutex<Vec<(Phase, usize)>>>;

/// A chain of six discs at distance 1 on the ground, each pair held by a rod, and a box on top.
fn chain(solver: &'static Variant, width: LaneWidth, order: Order) -> (World, Seen) {
    let mut world = World::new(Settings { order, ..Settings::new(solver).exactly(width) });
    let block = Shape::rectangle("box", glam::Vec2::new(20.0, 1.0), glam::Vec2::ZERO, 0.0, 0.0).unwrap();
    world.add_body(&BodyDef::new(BodyKind::Static, [0.0, -1.0], vec![ShapeDef::new(block)]));
    for i in 0..6 {
        let disc = Shape::circle("disc", glam::Vec2::ZERO, 0.4).unwrap();
        let mut body = BodyDef::new(BodyKind::Dynamic, [i as f64, 0.4], vec![ShapeDef::new(disc)]);
        body.velocity = [if i == 5 { 3.0 } else { 0.0 }, 0.0];
        world.add_body(&body);
    }
    let seen = Seen::default();
    let ends: Vec<[u32; 2]> = (1..6).map(|i| [i, i + 1]).collect();
    let rods = Rods { state: vec![[1.0, 0.0, 0.0, 0.0]; ends.len()], ends, seen: seen.clone() };
    world.add_constraints(Box::new(rods));
    (world, seen)
}

fn run(world: &mut World, steps: usize) {
    for _ in 0..steps {
        world.step().unwrap();
    }
}

#[test]
fn rods_hold_under_every_schedule_and_move_as_one() {
    for solver in ["pgs", "soft_step", "pgs_ngs_block", "tgs_ngs"] {
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
            // Arranging and going back changes nothing.
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

#[test]
fn rods_are_in_the_passes_and_colours_of_the_contacts() {
    let (mut world, seen) = chain(find("soft_step").unwrap(), LaneWidth::W8, Order::Colored);
    world.step().unwrap();
    // Six discs on the ground, and five rods in two colours.
    assert_eq!((world.counts.contacts, world.counts.colors, world.counts.overflow), (6, 3, 0));
    let of = |phase: Phase| -> usize {
        seen.lock().unwrap().iter().filter(|(p, _)| *p == phase).map(|(_, rods)| rods).sum()
    };
    let expected = [
        (Phase::Prepare, 5),
        (Phase::WarmStart, 5),
        (Phase::Solve, 4 * 5),
        (Phase::Relax, 4 * 5),
        (Phase::Position, 0),
        (Phase::Store, 5),
    ];
    for (phase, rods) in expected {
        assert_eq!(of(phase), rods, "{phase:?}");
    }
}

#[test]
fn a_held_world_brings_back_what_rods_keep() {
    let (mut held, _) = chain(find("soft_step").unwrap(), LaneWidth::W8, Order::Colored);
    let (mut free, _) = chain(find("soft_step").unwrap(), LaneWidth::W8, Order::Colored);
    run(&mut held, 10);
    run(&mut free, 10);
    let mut still = held.hold();
    for phase in [Phase::Prepare, Phase::WarmStart, Phase::Solve, Phase::Store] {
        still.repeat(phase, 7);
        still.reset(phase);
    }
    still.step(false);
    drop(still);
    run(&mut held, 10);
    run(&mut free, 10);
    assert_eq!(held.state_hash(), free.state_hash());
}
