//! Contact problems with hand-derived solutions.
//!
//! All start from rest unless stated, with gravity 10 m/s² downward. The docs of each function derive its
//! solution. The problems are used to test references and to check exact convergence rates.

use super::joints::{BlockLaw, ProblemBlock, ProblemJoint, ProblemRow};
use super::problem::{ContactProblem, ProblemBody, ProblemContact, Velocity};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Gravitational acceleration (m/s²).
pub const GRAVITY: f64 = 10.0;

/// Builds a problem body by body and contact by contact. Static bodies are left out.
struct Builder {
    problem: ContactProblem,
    centers: Vec<[f64; 2]>,
}

impl Builder {
    fn new(name: String, h: f64) -> Self {
        let problem = ContactProblem { name, h, bodies: vec![], contacts: vec![], joints: vec![] };
        Builder { problem, centers: Vec::new() }
    }

    /// A body of `mass` and `inertia` (infinite allowed) with velocity v before the step.
    fn body(&mut self, center: [f64; 2], mass: f64, inertia: f64, velocity: Velocity) -> u32 {
        let h = self.problem.h;
        let [vx, vy, w] = velocity;
        let free_velocity = [vx, vy - h * GRAVITY, w];
        let body = ProblemBody { inv_mass: 1.0 / mass, inv_inertia: 1.0 / inertia, velocity, free_velocity };
        self.problem.bodies.push(body);
        self.centers.push(center);
        self.problem.bodies.len() as u32 - 1
    }

    /// A contact at `point` in a manifold of its own, with `normal` from a to b. `None` stands for a static
    /// body.
    fn contact(&mut self, a: Option<u32>, b: Option<u32>, point: [f64; 2], normal: [f64; 2], friction: f64) {
        let manifold = self.problem.contacts.last().map_or(0, |c| c.manifold + 1);
        let r = self.arms([a, b], point);
        self.problem.contacts.push(ProblemContact::touching([a, b], manifold, normal, r, friction));
    }

    /// A manifold of two points.
    fn manifold(&mut self, a: Option<u32>, b: Option<u32>, points: [[f64; 2]; 2], normal: [f64; 2], mu: f64) {
        self.contact(a, b, points[0], normal, mu);
        let manifold = self.problem.contacts.last().map_or(0, |c| c.manifold);
        self.contact(a, b, points[1], normal, mu);
        self.problem.contacts.last_mut().expect("just pushed").manifold = manifold;
    }

    /// From the centers of mass to `point` (m); zero for static bodies.
    fn arms(&self, bodies: [Option<u32>; 2], point: [f64; 2]) -> [[f64; 2]; 2] {
        bodies.map(|body| {
            let [x, y] = body.map_or(point, |body| self.centers[body as usize]);
            [point[0] - x, point[1] - y]
        })
    }

    /// Adds a hinge at `point` and returns its index among the joints.
    fn hinge(&mut self, a: Option<u32>, b: u32, point: [f64; 2]) -> usize {
        let r = self.arms([a, Some(b)], point);
        self.problem.joints.push(ProblemJoint::revolute([a, Some(b)], r));
        self.problem.joints.len() - 1
    }

    /// Adds an angular row to a joint, solved before its other rows.
    fn angle(&mut self, joint: usize, law: BlockLaw, error: f64) {
        let row = ProblemRow { axis: [0.0; 2], arm_a: 1.0, arm_b: 1.0, error, warm_impulse: 0.0 };
        self.problem.joints[joint].blocks.insert(0, ProblemBlock { law, rows: vec![row] });
    }

    /// A row along `axis` from the world to the center of mass of a body.
    fn line(&mut self, b: u32, axis: [f64; 2], law: BlockLaw, error: f64) {
        let row = ProblemRow { axis, arm_a: 0.0, arm_b: 0.0, error, warm_impulse: 0.0 };
        let blocks = vec![ProblemBlock { law, rows: vec![row] }];
        self.problem.joints.push(ProblemJoint { body_a: None, body_b: Some(b), reach: [0.0; 2], blocks });
    }
}

const UP: [f64; 2] = [0.0, 1.0];
const H: f64 = 1.0 / 240.0;

/// A frictionless column of discs of the given masses (kg), contacts listed bottom-up.
///
/// At rest contact i carries the weight of the discs i, i + 1, …: λ_i = g h ∑_{j ≥ i} m_j.
pub fn column(masses: &[f64]) -> ContactProblem {
    let mut p = Builder::new(format!("column of {} discs", masses.len()), H);
    let mut below = None;
    for (i, &m) in masses.iter().enumerate() {
        let disc = p.body([0.0, 0.5 + i as f64], m, 0.5 * m * 0.25, [0.0; 3]);
        p.contact(below, Some(disc), [0.0, i as f64], UP, 0.0);
        below = Some(disc);
    }
    p.problem
}

/// `n` equal discs of 1 kg. G is tridiagonal, and the Jacobi iteration matrix is a random walk that reflects
/// at the ground and is absorbed above the top. With θ = π/(2n) its spectral radius is cos θ. That of
/// Gauss–Seidel (consistently ordered, Young 1954) is cos² θ.
pub fn disc_column(n: usize) -> ContactProblem {
    column(&vec![1.0; n])
}

/// A disc of `ratio` = R kg on one of 1 kg. G = [[1, −1], [−1, 1 + 1/R]], so the Jacobi matrix has
/// off-diagonal entries 1 and R/(1 + R); their product R/(1 + R) is the Gauss–Seidel rate.
pub fn heavy_on_light(ratio: f64) -> ContactProblem {
    let mut problem = column(&[1.0, ratio]);
    problem.name = format!("{ratio} kg on 1 kg");
    problem
}

/// A disc of 1 kg on one of `ratio` kg; the Gauss–Seidel rate is 1/(1 + ratio).
pub fn light_on_heavy(ratio: f64) -> ContactProblem {
    let mut problem = column(&[ratio, 1.0]);
    problem.name = format!("1 kg on {ratio} kg");
    problem
}

/// A box of 2 kg, 1 m × 1 m, sliding to the right at 1 m/s on level ground with µ = 0.3; contacts rear,
/// front. Friction µ m g acts half a height below the center and turns the box forward: N_front,rear = m g/2
/// (1 ± µ) = 13 N, 7 N. The box slows by µ g h.
pub fn sliding_box() -> ContactProblem {
    let mut p = Builder::new("sliding box".into(), H);
    let b = p.body([0.0, 0.5], 2.0, 2.0 / 6.0, [1.0, 0.0, 0.0]);
    p.manifold(None, Some(b), [[-0.5, 0.0], [0.5, 0.0]], UP, 0.3);
    p.problem
}

/// A plank (1 kg, 4 m × 0.2 m) on static supports at the given x (m, from its middle). It rests if they lie
/// on both sides. With three or more supports, only the sum and the moment of the impulses are determined.
/// λ_max(D⁻¹G) exceeds 2 for three supports close together: Jacobi diverges.
pub fn plank(supports: &[f64], friction: f64) -> ContactProblem {
    let mut p = Builder::new(format!("plank on {} supports", supports.len()), H);
    let b = p.body([0.0, 0.1], 1.0, (16.0 + 0.04) / 12.0, [0.0; 3]);
    for &x in supports {
        p.contact(None, Some(b), [x, 0.0], UP, friction);
    }
    p.problem
}

/// A pyramid of unit boxes of 1 kg with `base` boxes at the bottom and touching neighbors in each row. It
/// rests; impulses are highly hyperstatic.
pub fn box_pyramid(base: usize, friction: f64) -> ContactProblem {
    let mut p = Builder::new(format!("pyramid of boxes, base {base}"), H);
    let mut below: Vec<u32> = Vec::new();
    for row in 0..base {
        let (y, x0) = (row as f64, 0.5 * row as f64);
        let boxes: Vec<u32> =
            (0..base - row).map(|i| p.body([x0 + i as f64, y + 0.5], 1.0, 1.0 / 6.0, [0.0; 3])).collect();
        for (i, &b) in boxes.iter().enumerate() {
            let x = x0 + i as f64;
            if i > 0 {
                let points = [[x - 0.5, y], [x - 0.5, y + 1.0]];
                p.manifold(Some(boxes[i - 1]), Some(b), points, [1.0, 0.0], friction);
            }
            if row == 0 {
                p.manifold(None, Some(b), [[x - 0.5, y], [x + 0.5, y]], UP, friction);
            } else {
                p.manifold(Some(below[i]), Some(b), [[x - 0.5, y], [x, y]], UP, friction);
                p.manifold(Some(below[i + 1]), Some(b), [[x, y], [x + 0.5, y]], UP, friction);
            }
        }
        below = boxes;
    }
    p.problem
}

/// Painlevé's rod: 1 kg, half-length 1 m, leaning at θ = atan 2. Its lower end slides on the ground at 1 m/s
/// such that friction (µ = 2) presses it down.
///
/// With rn = −cos θ, rt = sin θ and I = 1/3: G_nn = 1 + 3 cos² θ = 1.6, G_tt = 3.4, G_nt = −3 sin θ cos θ =
/// −1.2. Slipping would need (1.6 − 1.2 µ) λn = g h, impossible for µ > 4/3. Lift-off would need un = −g h.
/// The end therefore sticks, with λ = G⁻¹ (g h, 1): λn = (3.4 g h + 1.2)/4 = 0.3 + 0.85 g h, λt = 0.4 + 0.3 g
/// h, an impact without a collision.
pub fn painleve_rod(h: f64) -> ContactProblem {
    let mut p = Builder::new(format!("Painlevé rod, h {h} s"), h);
    let (sin, cos) = (2.0 / 5.0f64.sqrt(), 1.0 / 5.0f64.sqrt());
    let rod = p.body([cos, sin], 1.0, 1.0 / 3.0, [-1.0, 0.0, 0.0]);
    p.contact(None, Some(rod), [0.0, 0.0], UP, 2.0);
    p.problem
}

/// `n` rods of 1 kg and 1 m hanging from each other, hinges listed from the ceiling down.
///
/// Hinge i, counted from 0, carries the rods below it: λ = (0, (n − i) g h) on the lower one. Vertical
/// impulses pass through all centers of mass, so they cause no rotation and are decoupled from horizontal
/// ones, which stay zero. For vertical impulses G is that of [`disc_column`], with the ceiling instead of the
/// ground, so Gauss–Seidel converges by cos²(π/2n) per sweep. With ln cos²θ = −θ² − O(θ⁴), a residual falls
/// to ε of its start in
///
/// ```text
/// k = ln ε / ln cos²(π/2n) ≈ 4 n² ln(1/ε)/π²
/// ```
///
/// sweeps: twice as many links take four times as many sweeps.
pub fn hanging_chain(n: usize) -> ContactProblem {
    let mut p = Builder::new(format!("chain of {n} hanging rods"), H);
    let mut above = None;
    for i in 0..n {
        let y = -(i as f64);
        let rod = p.body([0.0, y - 0.5], 1.0, 1.0 / 12.0, [0.0; 3]);
        p.hinge(above, rod, [0.0, y]);
        above = Some(rod);
    }
    p.problem
}

/// A rod of 1 kg and 1 m, hinged at the left end and released at `angle` (rad) above the horizontal.
///
/// With r = −½ (cos, sin) from its center to the hinge, K = 1 + 12 (r_y², −r_x r_y; ·, r_x²) in 1/kg and K λ
/// = (0, g h). If the rod is level, K is diagonal, 1 and 1 + 12/4 = 4: the hinge bears a quarter of the
/// weight.
pub fn pendulum_rod(angle: f64) -> ContactProblem {
    let mut p = Builder::new(format!("rod let go at {angle} rad"), H);
    let rod = p.body([0.5 * angle.cos(), 0.5 * angle.sin()], 1.0, 1.0 / 12.0, [0.0; 3]);
    p.hinge(None, rod, [0.0, 0.0]);
    p.problem
}

/// Four bodies of 1 kg, each with a joint at a bound or with a spring. With g h = 1/24 m/s:
///
/// * a disc of I = ½ kg·m², hinged at its center, with a motor of 10 rad/s and 0.01 N·m·s: the motor reaches
///   its maximum and the disc turns at 0.02 rad/s; the hinge bears g h;
/// * a level rod of 1 m, hinged at its left end, 0.1 mrad above a limit, which it reaches: ω = −0.0001/h =
///   −0.024 rad/s. Without the limit it would have ω* = −(g h/2)/(1/3). The limit's impulse is (ω − ω*)/3,
///   the hinge's g h + ω/2;
/// * a point on a vertical spring of S = 20/s and D = ½, stretched by 10 mm: λ = (D g h + S 0.01)/(1 + D);
/// * a box on a floor with µ = ½. A spring pulls it to the left with at most 0.01 N·s, less than the floor's
///   µ g h. It stays, and friction on the floor balances the spring.
pub fn machine() -> ContactProblem {
    let mut p = Builder::new("joints at their bounds".into(), H);
    let disc = p.body([0.0, 0.0], 1.0, 0.5, [0.0; 3]);
    let axle = p.hinge(None, disc, [0.0, 0.0]);
    p.angle(axle, BlockLaw::Motor { speed: 10.0, cap: 0.01 }, 0.0);
    let rod = p.body([3.5, 0.0], 1.0, 1.0 / 12.0, [0.0; 3]);
    let hinge = p.hinge(None, rod, [3.0, 0.0]);
    p.angle(hinge, BlockLaw::Limit, 1e-4);
    let point = p.body([6.0, 0.0], 1.0, f64::INFINITY, [0.0; 3]);
    p.line(point, UP, BlockLaw::Spring { stiffness: 20.0, damping: 0.5, cap: None }, -0.01);
    let cube = p.body([9.0, 0.0], 1.0, f64::INFINITY, [0.0; 3]);
    p.contact(None, Some(cube), [9.0, -0.5], UP, 0.5);
    p.line(cube, [1.0, 0.0], BlockLaw::Spring { stiffness: 20.0, damping: 0.5, cap: Some(0.01) }, 0.5);
    p.problem
}

/// A wedge (1 kg, not rotating) between walls leaning outward by `half_angle` from the vertical. If it does
/// not slip, it rests with impulses that self-stress leaves undetermined: with friction, any squeeze may be
/// added once µ > tan(half_angle).
///
/// At half angle 0 the walls are parallel, and every fall speed from 0 to g h has impulses: 2 µ λn ≥ m g h at
/// rest, λ = 0 in free fall. The velocities are not unique.
pub fn wedge(half_angle: f64, friction: f64) -> ContactProblem {
    let mut p = Builder::new(format!("wedge of half angle {half_angle} rad, µ {friction}"), H);
    let b = p.body([0.0, 0.0], 1.0, f64::INFINITY, [0.0; 3]);
    let (sin, cos) = half_angle.sin_cos();
    p.contact(None, Some(b), [-0.5, 0.0], [cos, sin], friction);
    p.contact(None, Some(b), [0.5, 0.0], [-cos, sin], friction);
    p.problem
}

/// The problem with small random changes, the same for the same `seed`: velocities by up to
/// `velocity_increment`/2 (m/s, rad/s), normals by 0.5 mrad, arms by 0.5 mm, gaps from −1.4 mm to 0.6 mm,
/// friction by 20 %. Walls that happen to lean jam the piles, with G close to singular: the hardest problems
/// here. Their solutions are known only through their certificates.
pub fn shaken(mut problem: ContactProblem, seed: u64, velocity_increment: f64) -> ContactProblem {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    // 53 bits, in [−½, ½).
    let mut next = || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
    problem.name = format!("{}, shaken by {velocity_increment}, seed {seed}", problem.name);
    for b in &mut problem.bodies {
        for k in 0..3 {
            let change = velocity_increment * next();
            b.velocity[k] += change;
            b.free_velocity[k] += change;
        }
    }
    let mut previous: Option<ProblemContact> = None;
    for c in &mut problem.contacts {
        let (sin, cos) = (1e-3 * next()).sin_cos();
        c.normal = match previous {
            Some(p) if p.manifold == c.manifold => p.normal,
            _ => [cos * c.normal[0] - sin * c.normal[1], sin * c.normal[0] + cos * c.normal[1]],
        };
        c.arm_a[0] += 1e-3 * next();
        c.arm_b[0] += 1e-3 * next();
        c.gap = 2e-3 * (next() - 0.2);
        c.friction *= 1.0 + 0.4 * next();
        previous = Some(*c);
    }
    problem
}

/// The problems that ship as frozen files, with their file names.
pub fn library() -> Vec<(&'static str, ContactProblem)> {
    vec![
        ("disc-column-10", disc_column(10)),
        ("heavy-on-light-100", heavy_on_light(100.0)),
        ("sliding-box", sliding_box()),
        ("plank-4-supports", plank(&[-1.5, -0.5, 0.5, 1.5], 0.5)),
        ("box-pyramid-5", box_pyramid(5, 0.6)),
        ("painleve-rod", painleve_rod(1e-3)),
        ("wedge", wedge(0.25, 0.5)),
        ("hanging-chain-10", hanging_chain(10)),
        ("hanging-chain-20", hanging_chain(20)),
        ("machine", machine()),
    ]
}

/// Every method finds the solutions that the docs derive.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::certify::{Uniqueness, reference};
    use crate::lab::reference::iterate::{Iteration, Stop, iterate};
    use crate::lab::reference::residual::natural_map;
    use crate::lab::reference::rows::OwnRow;
    use crate::lab::reference::stewart_trinkle::stewart_trinkle;
    use crate::lab::reference::{DPair, Target};

    /// Impulses by Lemke's method, or with joints by the first method that certifies them, checked by the
    /// residual code, which shares nothing with the LCP.
    fn solve(p: &ContactProblem) -> Vec<DPair> {
        p.validate().unwrap();
        let lemke = p.joints.is_empty().then(|| stewart_trinkle(p, Target::Rigid).unwrap());
        let impulses = lemke.unwrap_or_else(|| reference(p).unwrap().impulses);
        let residual = natural_map(p, Target::Rigid, &p.velocities(&impulses), &impulses) / p.impulse_unit();
        assert!(residual < 1e-12, "{}: natural map {residual:e}", p.name);
        impulses
    }

    fn close(what: &str, found: f64, expected: f64) {
        let error = (found - expected).abs();
        assert!(error <= 1e-12 * expected.abs().max(1e-3), "{what}: {found} is not {expected}");
    }

    /// Impulses by hand: point or row, direction, N·s.
    type ByHand = Vec<(usize, usize, f64)>;

    fn by_hand() -> Vec<(ContactProblem, ByHand)> {
        let load = GRAVITY * H;
        let mut all = Vec::new();
        let forces = [(0, 0, 7.0), (1, 0, 13.0), (0, 1, -0.3 * 7.0), (1, 1, -0.3 * 13.0)];
        all.push((sliding_box(), forces.map(|(i, axis, force)| (i, axis, force * H)).to_vec()));
        let column = |n: usize| (0..n).map(move |i| (i, 0, (n - i) as f64 * load)).collect();
        all.extend([1, 10].map(|n| (disc_column(n), column(n))));
        for (h, force) in [(1e-2, 0.385), (1e-3, 0.3085), (1e-4, 0.30085)] {
            all.push((painleve_rod(h), vec![(0, 0, force), (0, 1, 0.4 + 0.3 * GRAVITY * h)]));
        }
        // The classical quarter of the weight, and oblique rods, by Cramer's rule.
        for angle in [0.0_f64, 0.7, -1.2] {
            let (x, y) = (0.5 * angle.cos(), 0.5 * angle.sin());
            let k = [1.0 + 12.0 * y * y, -12.0 * x * y, 1.0 + 12.0 * x * x];
            let determinant = k[0] * k[2] - k[1] * k[1];
            let hinge = vec![(0, 0, -k[1] * load / determinant), (1, 0, k[0] * load / determinant)];
            all.push((pendulum_rod(angle), hinge));
        }
        close("a quarter", all[all.len() - 3].1[1].2, load / 4.0);
        let chain = |i: usize| [(2 * i, 0, 0.0), (2 * i + 1, 0, (6 - i) as f64 * load)];
        all.push((hanging_chain(6), (0..6).flat_map(chain).collect()));
        // The contact, the motor and its hinge, the limit and its hinge, the springs.
        let omega = -1e-4 / H;
        let limit = [(4, 0, (omega + 1.5 * load) / 3.0), (6, 0, load + 0.5 * omega)];
        let machine_by_hand = [(0, 0, load), (0, 1, 0.01), (1, 0, 0.01), (2, 0, 0.0), (3, 0, load)];
        let springs = [(7, 0, (0.5 * load + 0.2) / 1.5), (8, 0, -0.01)];
        all.push((machine(), [&machine_by_hand[..], &limit, &springs].concat()));
        // Without damping a spring pushes with −S C, whatever the velocity.
        let mut stiff = machine();
        stiff.joints[2].blocks[0].law = BlockLaw::Spring { stiffness: 20.0, damping: 0.0, cap: None };
        all.push((stiff, vec![(7, 0, 0.2)]));
        all
    }

    #[test]
    fn every_method_finds_the_solutions_by_hand() {
        for (p, expected) in by_hand() {
            let stop = Stop { tolerance: 1e-15, iterations: 4000 };
            let by = |method| iterate(&p, Target::Rigid, &p.no_impulses(), method, stop).impulses;
            let methods =
                [Iteration::Conjugate, Iteration::Anderson(10), Iteration::Symmetric, Iteration::SplitJacobi];
            for (i, axis, impulse) in expected {
                let name = format!("{}, {i} {axis}", p.name);
                if p.joints.is_empty() {
                    close(&format!("{name}, Lemke"), solve(&p)[i][axis], impulse);
                }
                for method in methods {
                    let found = by(method)[i][axis];
                    assert!((found - impulse).abs() < 1e-11, "{name}, {method:?}: {found} is not {impulse}");
                }
            }
        }
        let v = machine().velocities(&solve(&machine()));
        assert!((v[0][2] - 0.02).abs() < 1e-11 && (v[1][2] + 1e-4 / H).abs() < 1e-11, "{v:?}");
    }

    /// Large columns, mass ratios, pyramids; hyperstatic planks and a rod on two identical hinges.
    #[test]
    fn exact_solutions_where_sweeps_are_slow_or_impulses_not_unique() {
        let load = GRAVITY * H;
        for (i, l) in solve(&disc_column(60)).iter().enumerate() {
            close("column", l[0], (60 - i) as f64 * load);
        }
        // The scaled G has the condition number 4 R = 4e4, which multiplies rounding (1e-16).
        for (l, mass) in solve(&heavy_on_light(1e4)).iter().zip([10001.0, 10000.0]) {
            assert!((l[0] / (mass * load) - 1.0).abs() < 1e-11, "{} is not {mass}", l[0]);
        }
        for mu in [0.0, 0.5] {
            let p = plank(&[-1.5, -0.5, 0.5, 1.5], mu);
            let l = solve(&p);
            close("plank", l.iter().map(|l| l[0]).sum(), load);
            assert!(p.mass_norm(&p.velocities(&l)) < 1e-15);
        }
        let mut p = pendulum_rod(0.0);
        p.joints.push(p.joints[0].clone());
        let l = solve(&p);
        assert!((l[1][0] + l[3][0] - load / 4.0).abs() < 1e-11, "{l:?}");
        assert_eq!(reference(&p).unwrap().certificate.uniqueness, Uniqueness::Proven);
        // 21 boxes fall at 1/24 m/s; rest to rounding.
        let p = box_pyramid(6, 0.6);
        assert!(p.contacts.len() > 100 && p.contacts.len() < 150, "{}", p.contacts.len());
        assert!(p.mass_norm(&p.velocities(&solve(&p))) < 1e-13);
    }

    #[test]
    fn targets_yield_close_and_rebound() {
        // u + b + c λ = 0 with u = −g h + λ: λ = (g h − b)/(1 + c).
        let p = disc_column(1);
        let rows = [OwnRow { bias: -0.01, compliance: 0.5 }];
        let own = Target::Own(&rows);
        let stop = Stop { tolerance: 1e-15, iterations: 100 };
        let swept = iterate(&p, own, &p.no_impulses(), Iteration::Forward, stop).impulses;
        for l in [stewart_trinkle(&p, own).unwrap(), swept] {
            close("compliant", l[0][0], (GRAVITY * p.h + 0.01) / 1.5);
            assert!(natural_map(&p, own, &p.velocities(&l), &l) < 1e-15);
            assert!(natural_map(&p, Target::Rigid, &p.velocities(&l), &l) > 1e-3);
        }
        // A disc falls at 2 m/s; h = 1/240 s.
        let disc = |gap: f64, rebound: f64| {
            let mut p = disc_column(1);
            p.bodies[0].free_velocity[1] = -2.0;
            (p.contacts[0].gap, p.contacts[0].rebound) = (gap, rebound);
            p.velocities(&solve(&p))[0][1]
        };
        close("a gap closes", disc(1.0 / 480.0, 0.0), -0.5);
        close("a gap is open", disc(0.1, 0.0), -2.0);
        assert!(disc(-0.1, 0.0).abs() < 1e-15);
        close("a rebound", disc(0.0, 1.5), 1.5);
    }
}
