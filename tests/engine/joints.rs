//! Joints: what they hold, by hand-made truths.

use simpulse::engine::bodies::{BodyDef, BodyHandle, ShapeDef};
use simpulse::engine::joints::{Joint, JointHandle};
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::{VARIANTS, Variant, find};
use simpulse::engine::world::{Settings, World};

fn empty(solver: &'static Variant) -> (World, BodyHandle) {
    let mut world = World::new(Settings::new(solver));
    let ground = world.add_body(&BodyDef::fixed([0.0, 0.0])).unwrap();
    (world, ground)
}

/// Capsules of 1 m from (0, 20) to the right, with a disc at the end.
fn chain(world: &mut World, ground: BodyHandle, links: usize, radius: f32) -> Vec<JointHandle> {
    let mut before = ground;
    let mut joints = vec![];
    let damped = |body: BodyDef| BodyDef { linear_damping: 0.1, angular_damping: 0.1, ..body };
    for i in 0..links {
        let x = i as f64;
        let link = ShapeDef::capsule([-0.5, 0.0], [0.5, 0.0], 0.125).unwrap().with_density(20.0);
        let body = world.add_body(&damped(BodyDef::dynamic([x + 0.5, 20.0]).with(link))).unwrap();
        joints.push(world.add_joint(&Joint::revolute(before, body).anchor([x, 20.0])).unwrap());
        before = body;
    }
    let x = links as f64;
    let ball = ShapeDef::circle(radius).unwrap().with_density(20.0);
    let ball = world.add_body(&damped(BodyDef::dynamic([x + f64::from(radius), 20.0]).with(ball))).unwrap();
    joints.push(world.add_joint(&Joint::revolute(before, ball).anchor([x, 20.0])).unwrap());
    joints
}

/// 160 planks between two points at their distance.
fn bridge(world: &mut World, ground: BodyHandle) -> Vec<JointHandle> {
    let mut before = ground;
    let mut joints = vec![];
    for i in 0..160 {
        let x = -80.0 + i as f64;
        let plank = ShapeDef::rectangle(0.5, 0.125).unwrap().with_density(20.0);
        let body = BodyDef { linear_damping: 0.1, angular_damping: 0.1, ..BodyDef::dynamic([x + 0.5, 20.0]) };
        let body = world.add_body(&body.with(plank)).unwrap();
        joints.push(world.add_joint(&Joint::revolute(before, body).anchor([x, 20.0])).unwrap());
        before = body;
    }
    joints.push(world.add_joint(&Joint::revolute(before, ground).anchor([80.0, 20.0])).unwrap());
    joints
}

#[test]
#[ignore = "prints"]
fn print_chain() {
    let names =
        std::env::var("S").unwrap_or("shim,soft_step,pgs,tgs_soft,xpbd,pgs_ngs,tgs_ngs,nncg,jacobi".into());
    for name in names.split(',') {
        for what in ["chain", "bridge"] {
            let (mut world, ground) = empty(find(name).unwrap());
            let joints =
                if what == "chain" { chain(&mut world, ground, 40, 8.0) } else { bridge(&mut world, ground) };
            let mut worst: f64 = 0.0;
            let mut sum = 0.0;
            let mut n = 0;
            let start = std::time::Instant::now();
            for step in 0..1200 {
                if let Err(e) = world.step() {
                    println!("{name}: {e}");
                    break;
                }
                let gaps = joints.iter().map(|&j| world.joint_state(j).unwrap().gap);
                let sq: f64 = gaps.clone().map(|g| g * g).sum();
                worst = worst.max(gaps.fold(0.0, f64::max));
                if step > 10 {
                    sum += sq;
                    n += joints.len();
                }
            }
            let time = start.elapsed().as_secs_f64() / 1.2e-3;
            println!(
                "{name} {what}: rms {:.4} mm, worst {:.3} mm, {time:.0} us",
                1e3 * (sum / n as f64).sqrt(),
                1e3 * worst
            );
        }
    }
}

#[test]
#[ignore = "prints"]
fn print_pendulum() {
    let names =
        std::env::var("S").unwrap_or("shim,soft_step,pgs,tgs_soft,xpbd,pgs_ngs,tgs_ngs,nncg,jacobi".into());
    for name in names.split(',') {
        let (mut world, ground) = empty(find(name).unwrap());
        // A point mass at 120° from the lowest place.
        let (s, c) = 120f64.to_radians().sin_cos();
        let bob = world.add_body(&BodyDef::dynamic([s, -c]).with(ShapeDef::circle(0.05).unwrap())).unwrap();
        let joint = world.add_joint(&Joint::revolute(ground, bob).anchor([0.0, 0.0])).unwrap();
        let g = -f64::from(world.settings.gravity[1]);
        let i = bob.index();
        let energy = |w: &World| {
            let b = &w.bodies;
            let m = f64::from(b.inv_mass[i]).recip();
            let inertia = f64::from(b.inv_inertia[i]).recip();
            let v = b.velocity(i).as_dvec2().length_squared();
            0.5 * m * v
                + 0.5 * inertia * f64::from(b.angular_velocity[i]).powi(2)
                + m * g * (b.center(i)[1] + 1.0)
        };
        let begin = energy(&world);
        let mut worst: f64 = 0.0;
        for step in 0..3600 {
            world.step().unwrap();
            worst = worst.max(world.joint_state(joint).unwrap().gap);
            if step % 900 == 899 {
                print!("{:.5} ", energy(&world) / begin - 1.0);
            }
        }
        println!("{name}: worst gap {:.4} mm", 1e3 * worst);
    }
}

#[test]
fn same_bits_at_every_width() {
    for solver in ["shim", "soft_step", "pgs", "tgs_ngs", "xpbd", "jacobi", "mass_splitting"] {
        let hash = |width| {
            let mut world = World::new(Settings::new(find(solver).unwrap()).exactly(width));
            let ground = world.add_body(&BodyDef::fixed([0.0, 0.0])).unwrap();
            chain(&mut world, ground, 10, 0.3);
            for _ in 0..60 {
                world.step().unwrap();
            }
            world.state_hash()
        };
        for width in LaneWidth::ALL {
            assert_eq!(hash(width), hash(LaneWidth::W1), "{solver} {width:?}");
        }
    }
}

#[test]
fn a_chain_hangs_together_under_every_solver_that_holds_joints() {
    for solver in VARIANTS {
        let (mut world, ground) = empty(solver);
        if let Some(reason) = solver.holds_no_joints {
            let body = BodyDef::dynamic([1.0, 0.0]).with(ShapeDef::circle(0.1).unwrap());
            let body = world.add_body(&body).unwrap();
            let error = world.add_joint(&Joint::revolute(ground, body)).unwrap_err().to_string();
            assert!(error.contains(reason) && error.contains(solver.name), "{error}");
            continue;
        }
        let joints = chain(&mut world, ground, 4, 0.1);
        for _ in 0..120 {
            world.step().unwrap_or_else(|e| panic!("{}: {e}", solver.name));
        }
        let gap = joints.iter().map(|&j| world.joint_state(j).unwrap().gap).fold(0.0, f64::max);
        println!("{}: {:.3} mm", solver.name, 1e3 * gap);
        assert!(gap < 0.1, "{}: {gap} m", solver.name);
    }
}
