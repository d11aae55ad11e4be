//! The lane kernel on random contacts: every width gives the same bits, and padding stays inert. That the bits are right,
//! `tests/lab/agree` checks against sweeps in `f64`.

use glam::Vec2;
use proptest::prelude::*;
use simpulse::engine::coloring::{Coloring, EXEMPT};
use simpulse::engine::constraints::kernels::velocity::rules::Rigid;
use simpulse::engine::constraints::kernels::velocity::warm_start::warm_start;
use simpulse::engine::constraints::{
    Batches, Features, Kernel, Layout, NormalRule, PartnerKind, kernels::prepare, kernels::velocity::sweep,
};
use simpulse::engine::contacts::{Contact, Manifold, ManifoldPoint};
use simpulse::engine::lanes::{BodyRow, Lanes, Shared};

const BODIES: usize = 24;
const INV_H: f32 = 60.0;
/// Bodies 0 and 1 are static, the others dynamic.
const STATIC: u32 = 2;

type Full = Kernel<true, true, 2>;

#[derive(Clone, Debug)]
struct Setup {
    rows: Vec<BodyRow>,
    contacts: Vec<Contact>,
}

fn row() -> impl Strategy<Value = BodyRow> {
    ([-3.0_f32..3.0, -3.0..3.0, -4.0..4.0], 0.1_f32..4.0, 0.1_f32..9.0)
        .prop_map(|(v, m, i)| BodyRow { velocity: [v[0], v[1], v[2], m], delta: [0.0, 0.0, 0.0, i] })
}

fn point() -> impl Strategy<Value = ManifoldPoint> {
    let anchor = || (-0.8_f32..0.8, -0.8_f32..0.8).prop_map(|(x, y)| Vec2::new(x, y));
    (anchor(), anchor(), -0.02_f32..0.02, 0.0_f32..0.5).prop_map(|(a, b, separation, normal_impulse)| {
        let tangent_impulse = 0.3 * normal_impulse;
        ManifoldPoint { anchor_a: a, anchor_b: b, separation, normal_impulse, tangent_impulse, feature_id: 0 }
    })
}

fn contact() -> impl Strategy<Value = Contact> {
    let bodies = (0..BODIES as u32, STATIC..BODIES as u32).prop_filter("distinct", |(a, b)| a != b);
    (bodies, 0.0_f32..6.3, 1..3_u32, [point(), point()], 0.0_f32..1.0).prop_map(
        |((body_a, body_b), angle, count, points, friction)| Contact {
            body_a,
            body_b,
            friction,
            manifold: Manifold { normal: Vec2::from_angle(angle), count, points },
            ..Contact::default()
        },
    )
}

fn setup() -> impl Strategy<Value = Setup> {
    (prop::collection::vec(row(), BODIES), prop::collection::vec(contact(), 1..60)).prop_map(
        |(mut rows, contacts)| {
            for row in &mut rows[..STATIC as usize] {
                *row = BodyRow::default();
            }
            rows.push(BodyRow::default());
            Setup { rows, contacts }
        },
    )
}

/// Colors the contacts as a world does, dynamic ones first.
fn batches(setup: &Setup, width: usize) -> Batches {
    let mut batches = Batches::default();
    batches.clear(width);
    for (kind, partner) in [(false, PartnerKind::Dynamic), (true, PartnerKind::Static)] {
        let members: Vec<u32> = (0..setup.contacts.len() as u32)
            .filter(|&i| (setup.contacts[i as usize].body_a < STATIC) == kind)
            .collect();
        let edges: Vec<[u32; 2]> = members
            .iter()
            .map(|&i| &setup.contacts[i as usize])
            .map(|c| [if kind { EXEMPT } else { c.body_a }, c.body_b])
            .collect();
        let mut coloring = Coloring::new();
        coloring.assign(edges.iter().copied(), BODIES);
        assert!(coloring.overflow().is_empty());
        let layout = Layout::for_features(&Features::FULL, partner);
        for color in 0..coloring.colors() {
            let contacts = coloring.color(color).iter().map(|&edge| {
                let contact = &setup.contacts[members[edge as usize] as usize];
                (members[edge as usize], [contact.body_a, contact.body_b])
            });
            batches.push_segment(partner, &layout, contacts, BODIES as u32);
        }
    }
    batches.reserve_buffer();
    batches
}

/// Three sweeps in lanes. Returns the rows, and the impulses per contact and point.
fn in_lanes<L: Lanes>(setup: &Setup) -> (Vec<BodyRow>, Vec<[[f32; 2]; 2]>, Batches) {
    let mut rows = setup.rows.clone();
    let mut batches = batches(setup, L::WIDTH);
    prepare::prepare::<L, Full>(Shared::from(&mut rows[..]), &mut batches, &setup.contacts);
    warm_start::<L, Full>(Shared::from(&mut rows[..]), &mut batches);
    for _ in 0..3 {
        sweep::sweep::<L, Full, _>(Shared::from(&mut rows[..]), &mut batches, Rigid { inv_h: INV_H });
    }
    let mut impulses = vec![[[0.0; 2]; 2]; setup.contacts.len()];
    batches.for_each_lane(&Features::FULL, |contact, layout, record, lane| {
        for p in 0..2 {
            let at = |quantity| record[layout.at(p, quantity) * L::WIDTH + lane];
            impulses[contact as usize][p] = [at(layout.normal_impulse), at(layout.tangent_impulse)];
        }
    });
    (rows, impulses, batches)
}

proptest! {
    #[test]
    fn every_width_gives_the_same_bits(setup in setup()) {
        let (rows, impulses, _) = in_lanes::<f32>(&setup);
        for (other, other_impulses) in [
            { let (r, i, _) = in_lanes::<wide::f32x4>(&setup); (r, i) },
            { let (r, i, _) = in_lanes::<wide::f32x8>(&setup); (r, i) },
            { let (r, i, _) = in_lanes::<wide::f32x16>(&setup); (r, i) },
        ] {
            let bits = |rows: &[BodyRow]| bytemuck::cast_slice::<_, u32>(rows).to_vec();
            prop_assert_eq!(bits(&rows), bits(&other));
            prop_assert_eq!(&impulses, &other_impulses);
        }
    }

    /// Lanes without a contact, and the row they point to, stay zero whatever runs.
    #[test]
    fn padding_is_inert(setup in setup()) {
        let (rows, _, batches) = in_lanes::<wide::f32x16>(&setup);
        prop_assert_eq!(rows[BODIES], BodyRow::default());
        prop_assert_eq!(&rows[..STATIC as usize], &[BodyRow::default(); STATIC as usize]);
        let floats: &[f32] = bytemuck::cast_slice(batches.records());
        for segment in batches.segments() {
            let layout = Layout::for_features(&Features::FULL, segment.partner);
            for batch in 0..segment.batches {
                for lane in segment.filled(batch, 16)..16 {
                    for vector in 0..layout.stride {
                        let at = (segment.first_vector + batch * layout.stride + vector) * 16 + lane;
                        prop_assert_eq!(floats[at], 0.0);
                    }
                }
            }
        }
    }
}

/// A rule that pushes every lane still leaves padding alone, because its effective mass is zero.
#[test]
fn an_eager_rule_cannot_move_padding() {
    #[derive(Clone, Copy)]
    struct Eager;
    impl NormalRule for Eager {
        const FRICTION: bool = false;
        fn line<L: Lanes>(&self, _: bool, _: L, mass: L, old: L) -> [L; 2] {
            [mass.mul_add(L::splat(7.0), old), L::zero()]
        }
    }
    let body = BodyRow { velocity: [0.0, 0.0, 0.0, 1.0], delta: [0.0, 0.0, 0.0, 1.0] };
    let mut rows = vec![BodyRow::default(); BODIES + 1];
    rows[2] = body;
    let manifold = Manifold { normal: Vec2::Y, count: 1, ..Manifold::default() };
    let contacts = vec![Contact { body_b: 2, manifold, ..Contact::default() }];
    let setup = Setup { rows, contacts };
    let mut rows = setup.rows.clone();
    let mut batches = batches(&setup, 8);
    prepare::prepare::<wide::f32x8, Full>(Shared::from(&mut rows[..]), &mut batches, &setup.contacts);
    sweep::sweep::<wide::f32x8, Full, _>(Shared::from(&mut rows[..]), &mut batches, Eager);
    assert_eq!(rows[2].velocity, [0.0, 7.0, 0.0, 1.0]);
    assert_eq!(rows[BODIES], BodyRow::default());
}
