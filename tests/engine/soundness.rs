//! Law: safe functions are sound for any input. Bad rows, bad contacts, wrong widths, short arrays and
//! batches that were never filled panic with a message that names the problem. No read or write is out of
//! bounds.

use simpulse::engine::clock::Clock;
use simpulse::engine::constraints::ImpactLaw;
use simpulse::engine::constraints::impacts::restitution::{self, ReadApproach, Rebound};
use simpulse::engine::constraints::kernels::position::position_sweep;
use simpulse::engine::constraints::kernels::velocity::rules::Rigid;
use simpulse::engine::constraints::kernels::velocity::sweep::sweep;
use simpulse::engine::constraints::kernels::velocity::warm_start::warm_start;
use simpulse::engine::constraints::records::bounces::Bounces;
use simpulse::engine::constraints::{
    Batches, Features, Kernel, Layout, PartnerKind, Passes, PositionSweep, StepInput, Workspace,
    kernels::prepare,
};
use simpulse::engine::contacts::{Contact, quad};
use simpulse::engine::lanes::{
    BodyRow, IndexList, Indices, LaneIndex, LaneWidth, Lanes, MOST_LANES, Quad, RowStore, Shared, prefetch,
    prefetch_records,
};
use simpulse::engine::narrowphase::Margins;
use simpulse::engine::narrowphase::batch::{Input, Jobs, NO_CONTACT, PairKind, Shapes, update};
use simpulse::engine::narrowphase::hull::{Hull, HullRow};
use simpulse::engine::narrowphase::lanes::{PoseRow, Poses, ShapeRow};
use simpulse::engine::params::{Budget, Without};
use simpulse::engine::shapes::Shape;
use simpulse::engine::workers::Workers;
use std::hint::black_box;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use wide::{f32x4, f32x8, f32x16};

type Full = Kernel<true, true, 2>;
type Bare = Kernel<false, false, 1>;

const RULE: Rigid = Rigid { inv_h: 60.0 };
const POSITION: PositionSweep =
    PositionSweep { fraction: 0.2, slop: 0.005, max_correction: [0.2; 2], turned: true };
/// The largest possible index, a large one, and one just past the end of the rows below.
const FAR: [u32; 3] = [u32::MAX, 1_000_000_000, ROWS as u32];
/// Rows (including the inert one) and contacts of the good batches.
const ROWS: usize = 24;
const CONTACTS: usize = 20;

/// Panic message of `run`.
#[track_caller]
fn panic_of<T>(run: impl FnOnce() -> T) -> String {
    let payload = catch_unwind(AssertUnwindSafe(|| drop(black_box(run())))).expect_err("no panic");
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or(payload.downcast_ref::<&str>().copied()).unwrap_or("?").to_string()
}

/// Checks that `run` panics with a message that contains `words`.
#[track_caller]
fn panics<T>(words: &str, run: impl FnOnce() -> T) {
    let text = panic_of(run);
    assert!(text.contains(words), "{text:?} does not say {words:?}");
}

fn layout(partner: PartnerKind) -> Layout {
    Layout::for_features(&Features::FULL, partner)
}

fn rows() -> Vec<BodyRow> {
    vec![BodyRow { velocity: [1.0; 4], delta: [0.5; 4] }; ROWS]
}

/// One segment per kind of opposite body, with `contact`, `a` and `b` in one lane of each.
fn batches(width: usize, contact: u32, a: u32, b: u32) -> Batches {
    let mut batches = Batches::default();
    batches.clear(width);
    for partner in PartnerKind::ALL {
        let pairs = (0..CONTACTS as u32).map(|i| if i == 9 { (contact, [a, b]) } else { (i, [i, i + 1]) });
        batches.push_segment(partner, &layout(partner), pairs, ROWS as u32 - 1);
    }
    batches.reserve_buffer();
    batches
}

fn good(width: usize) -> Batches {
    batches(width, 9, 9, 10)
}

/// Input of a pass over constraints.
struct Given {
    rows: Vec<BodyRow>,
    batches: Batches,
    bounces: Bounces,
    contacts: Vec<Contact>,
}

impl Given {
    fn new(batches: Batches) -> Self {
        Given {
            rows: rows(),
            batches,
            bounces: Bounces::default(),
            contacts: vec![Contact::default(); CONTACTS],
        }
    }

    fn prepare_bounces<L: Lanes>(&mut self) {
        let Given { rows, batches, bounces, contacts } = self;
        let rebound = Rebound { threshold: 1.0, only_new: false };
        let begin = ReadApproach { rebound, stride: ImpactLaw::BOX2D.stride(2), found: 0.0 };
        restitution::prepare::<L, Full>(rows, batches, bounces, contacts, &begin);
    }

    /// Adds side records, as `restitution::prepare` makes them for good batches.
    fn with_bounces<L: Lanes>(mut self) -> Self {
        let mut of = Given::new(good(L::WIDTH));
        of.prepare_bounces::<L>();
        self.bounces = of.bounces;
        self
    }
}

/// What a pass reads, and what of it is checked: rows, contacts, side records.
#[derive(Clone, Copy, PartialEq)]
enum Reads {
    Rows,
    Contacts,
    Both,
    Bounces,
}

type Pass = (&'static str, Reads, fn(&mut Given));

/// Every pass over constraints.
fn passes<L: Lanes>() -> [Pass; 8] {
    use Reads::{Both, Bounces, Contacts, Rows};
    [
        ("sweep", Rows, |g| sweep::<L, Full, _>(Shared::from(&mut g.rows[..]), &mut g.batches, RULE)),
        ("warm_start", Rows, |g| warm_start::<L, Full>(Shared::from(&mut g.rows[..]), &mut g.batches)),
        ("position_sweep", Rows, |g| {
            position_sweep::<L, Full>(Shared::from(&mut g.rows[..]), &mut g.batches, POSITION)
        }),
        ("restitution::apply", Rows, |g| {
            restitution::apply::<L, Full>(&mut g.rows, &mut g.batches, &mut g.bounces);
        }),
        ("prepare", Both, |g| {
            prepare::prepare::<L, Full>(Shared::from(&mut g.rows[..]), &mut g.batches, &g.contacts)
        }),
        ("restitution::prepare", Both, |g| g.prepare_bounces::<L>()),
        ("store", Contacts, |g| prepare::store::<L, Full>(&mut g.batches, &mut g.contacts)),
        ("restitution::track", Bounces, |g| {
            restitution::track::<L, Full>(&mut g.batches, &mut g.bounces);
        }),
    ]
}

/// Every pass that reads rows, or contacts.
fn reading<L: Lanes>(what: Reads) -> impl Iterator<Item = (&'static str, fn(&mut Given))> {
    let all = passes::<L>().into_iter();
    all.filter(move |(_, reads, _)| [what, Reads::Both].contains(reads)).map(|(name, _, pass)| (name, pass))
}

/// Runs a test body at every width.
macro_rules! at_every_width {
    ($($test:ident: $body:ident;)*) => { $(
        #[test]
        fn $test() {
            $body::<f32>();
            $body::<f32x4>();
            $body::<f32x8>();
            $body::<f32x16>();
        }
    )* };
}

at_every_width! {
    good_batches_run: run_good;
    a_row_that_does_not_exist_panics: bad_rows;
    a_contact_that_does_not_exist_panics: bad_contacts;
    fewer_rows_than_batches_name_panic: short_rows;
    batches_of_another_width_panic: wrong_width;
    records_of_another_layout_panic: wrong_layout;
    batches_without_a_buffer_panic: no_buffer;
    bounces_that_were_not_prepared_panic: no_bounces;
    lanes_gather_nothing_out_of_place: bad_gathers;
}

fn run_good<L: Lanes>() {
    for (name, _, pass) in passes::<L>() {
        let mut given = Given::new(good(L::WIDTH)).with_bounces::<L>();
        pass(&mut given);
        assert!(given.rows[0].velocity[3] == 1.0, "{name}");
    }
    // Batches that were never filled contain no work.
    for (.., pass) in passes::<L>() {
        pass(&mut Given { rows: vec![], contacts: vec![], ..Given::new(Batches::default()) });
    }
}

fn bad_rows<L: Lanes>() {
    for far in FAR {
        for (name, pass) in reading::<L>(Reads::Rows) {
            // Against a dynamic body, row a is read too.
            for [a, b] in [[9, far], [far, 10]] {
                let mut given = Given::new(batches(L::WIDTH, 9, a, b)).with_bounces::<L>();
                let text = panic_of(|| pass(&mut given));
                assert!(text.contains(&far.to_string()), "{name}: {text}");
            }
        }
    }
}

fn bad_contacts<L: Lanes>() {
    for far in FAR {
        for (name, pass) in reading::<L>(Reads::Contacts) {
            let mut given = Given::new(batches(L::WIDTH, far, 9, 10));
            let text = panic_of(|| pass(&mut given));
            assert!(text.contains(&far.to_string()), "{name}: {text}");
        }
    }
    for (_, pass) in reading::<L>(Reads::Contacts) {
        panic_of(|| pass(&mut Given { contacts: vec![], ..Given::new(good(L::WIDTH)) }));
    }
}

fn short_rows<L: Lanes>() {
    for (name, pass) in reading::<L>(Reads::Rows) {
        for count in [0, 1, CONTACTS] {
            let rows = vec![BodyRow::default(); count];
            let mut given = Given { rows, ..Given::new(good(L::WIDTH)) }.with_bounces::<L>();
            let text = panic_of(|| pass(&mut given));
            assert!(text.contains(&count.to_string()), "{name}: {text}");
        }
    }
}

fn wrong_width<L: Lanes>() {
    for width in [1, 2, 3, 4, 8, 16, 32, 1000].into_iter().filter(|&w| w != L::WIDTH) {
        for (.., pass) in passes::<L>() {
            let mut given = Given::new(good(width)).with_bounces::<L>();
            panics(&format!("batches of {width} lanes for a kernel of {}", L::WIDTH), || pass(&mut given));
        }
    }
}

fn wrong_layout<L: Lanes>() {
    let words = "layout";
    let mut g = Given::new(good(L::WIDTH)).with_bounces::<L>();
    panics(words, || sweep::<L, Bare, _>(Shared::from(&mut g.rows[..]), &mut g.batches, RULE));
    panics(words, || prepare::prepare::<L, Bare>(Shared::from(&mut g.rows[..]), &mut g.batches, &g.contacts));
    panics(words, || prepare::store::<L, Bare>(&mut g.batches, &mut g.contacts));
    panics(words, || restitution::track::<L, Bare>(&mut g.batches, &mut g.bounces));
    panics(words, || g.batches.for_each_lane(&Features::NONE, |_, _, _, _| {}));
    // A layout that no kernel uses.
    for stride in [0, 1, usize::MAX / 2, usize::MAX] {
        let mut batches = Batches::default();
        batches.clear(L::WIDTH);
        let layout = Layout { stride, ..layout(PartnerKind::Dynamic) };
        let pushed = catch_unwind(AssertUnwindSafe(|| {
            batches.push_segment(PartnerKind::Dynamic, &layout, [(0, [0, 1])].into_iter(), 2);
            batches.push_segment(PartnerKind::Dynamic, &layout, [(0, [0, 1])].into_iter(), 2);
        }));
        if pushed.is_ok() {
            panics(words, || sweep::<L, Full, _>(Shared::from(&mut g.rows[..]), &mut batches, RULE));
        }
    }
}

fn no_buffer<L: Lanes>() {
    for (.., pass) in passes::<L>() {
        let mut batches = Batches::default();
        batches.clear(L::WIDTH);
        let kind = PartnerKind::Dynamic;
        batches.push_segment(kind, &layout(kind), (0..CONTACTS as u32).map(|i| (i, [i, i + 1])), 0);
        let mut given = Given::new(batches).with_bounces::<L>();
        panics("no room for records", || pass(&mut given));
        panic_of(|| given.batches.for_each_lane(&Features::FULL, |_, _, _, _| {}));
        panic_of(|| given.batches.records().to_vec());
    }
}

fn no_bounces<L: Lanes>() {
    for (name, _, pass) in passes::<L>() {
        if ["restitution::apply", "restitution::track"].contains(&name) {
            panics("`prepare` makes them", || pass(&mut Given::new(good(L::WIDTH))));
        }
    }
}

/// Gathers and scatters of lanes. The index of the last lane is past the end, by one or by more.
fn bad_gathers<L: Lanes>() {
    for far in FAR {
        let mut list = [0; MOST_LANES];
        list[L::WIDTH - 1] = far;
        let index = LaneIndex::<L::Index>::new(&list);
        assert_eq!(index.bound(), far as usize + 1);
        let words = format!("index {far} where there are {ROWS} rows");
        let mut rows = rows();
        panics(&words, || L::gather(&rows, index));
        panics(&words, || L::scatter_velocity(&mut rows, index, [L::zero(); 4]));
        panics(&words, || L::scatter_delta(&mut rows, index, [L::zero(); 4]));
        panics(&words, || RowStore::gather::<L>(rows.as_slice(), index));
        let mut values = [0.0; ROWS];
        panics(&words, || L::load_at(&values, index));
        panics(&words, || L::store_at(&mut values, index, L::zero()));
        // Records of three quads, the last one incomplete.
        let mut quads = [Quad::default(); 3 * ROWS + 2];
        panics(&words, || L::gather_quads::<3, 0>(&quads, index));
        panics(&words, || L::scatter_quads::<3, 2>(&mut quads, index, [L::zero(); 4]));
        panics(&words, || L::scatter_halves::<3, 0, 1>(&mut quads, index, [L::zero(); 4]));
        panics(&words, || ShapeRow::gather::<L>(&[ShapeRow::default(); ROWS], index));
        panics(&words, || Poses::<L>::gather(&[PoseRow::default(); ROWS], [index, index]));
        let hulls = [HullRow::default(); ROWS];
        let mut hull = Hull::<L>::empty();
        panic_of(|| hull.gather_heads(&hulls, index));
        panic_of(|| hull.gather_corners(&hulls, index, 8, |corner| corner));
        panic_of(|| hull.gather_corners(&hulls, index, 9, |corner| corner));
    }
    // The last record itself is in bounds.
    let list = [ROWS as u32 - 1; MOST_LANES];
    let index = LaneIndex::<L::Index>::new(&list);
    assert_eq!(index.only(), Some(ROWS - 1));
    assert!(bytemuck::bytes_of(&L::gather(&rows(), index)[7]) == bytemuck::bytes_of(&L::splat(0.5)));
}

#[test]
fn the_bound_of_a_list_is_never_below_an_entry() {
    let mut list = Indices::default();
    assert_eq!(list.list().bound(), 0);
    for (i, bound) in [(3, 4), (1, 4), (7, 8), (u32::MAX, (u32::MAX as usize).saturating_add(1))] {
        list.extend(&[i]);
        assert_eq!(list.list().bound(), bound);
    }
    list.clear();
    list.fill_to(5, 9);
    list.fill_to(3, 100);
    assert_eq!((&list[..], list.list().bound()), (&[9; 5][..], 10));
    let part = IndexList::new(&[1, 2, 3, 50, 4, 5]).part(1..3);
    assert_eq!((part.entries(), part.bound()), (&[2, 3][..], 51));
    // A batch that the list does not fill repeats the batch's first entry.
    let mut room = [0; MOST_LANES];
    let batch = IndexList::new(&[9, 8, 7]).batch_at::<[u32; 4]>(1, &mut room);
    assert_eq!((*batch.array(), batch.bound()), ([8, 7, 8, 8], 10));
    panics("out of range", || part.part(0..3));
    panics("out of bounds", || part.batch_at::<[u32; 4]>(2, &mut [0; MOST_LANES]).bound());
    panics("out of range", || part.batch_at::<[u32; 4]>(3, &mut [0; MOST_LANES]).bound());
    panic_of(|| part.batches::<[u32; 4]>().count());
}

#[test]
fn batches_without_a_width_take_no_segment() {
    let layout = layout(PartnerKind::Dynamic);
    let push = |mut b: Batches| {
        b.push_segment(PartnerKind::Dynamic, &layout, [(0, [1_000_000_000, 2])].into_iter(), 0);
    };
    panics("without lanes", || push(Batches::default()));
    panics("without lanes", || Batches::default().clear(0));
}

#[test]
fn a_step_says_what_is_wrong_before_it_begins() {
    let input = StepInput {
        impacts: ImpactLaw::Waves,
        features: Features::FULL,
        budget: Budget { substeps: 1, velocity_iterations: 1, relax_iterations: 1, position_iterations: 1 },
        h: 0.01,
        length_unit: 1.0,
        parameters: [0.0; 8],
        without: Without::default(),
        record_impulses: true,
        points: 0,
        has_discs: false,
    };
    let new = |lanes: Batches, serial: Batches, contacts: usize| {
        let mut work = Workspace { rows: rows(), lanes, serial, ..Workspace::default() };
        let mut contacts = vec![Contact::default(); contacts];
        Passes::new(&mut work, &mut contacts, &mut Clock::start(false), &input, LaneWidth::W8).finish();
    };
    panics("batches name row 24 of 24", || new(batches(8, 9, 9, 24), good(1), CONTACTS));
    panics("batches name row 24 of 24", || new(good(8), batches(1, 9, 24, 10), CONTACTS));
    panics("batches name contact 19 of 5", || new(good(8), Batches::default(), 5));
    panics("batches of 4 lanes for kernels of 8", || new(good(4), Batches::default(), CONTACTS));
    panics("batches of 8 lanes for kernels of 1", || new(Batches::default(), good(8), CONTACTS));
}

/// Collides `pairs` pairs of the same body and shape, after `spoil` has changed one list.
fn collide(kind: PairKind, width: LaneWidth, pairs: u32, contacts: usize, spoil: impl Fn(&mut Jobs)) {
    let mut shapes = Shapes::default();
    let shape = match kind {
        PairKind::Circles => Shape::circle("c", glam::Vec2::ZERO, 0.5),
        _ => Shape::rectangle("r", glam::Vec2::ONE, glam::Vec2::ZERO, 0.0, 0.0),
    };
    shapes.push(&shape.expect("valid"));
    let mut jobs = Jobs::default();
    let names: Vec<u32> = (0..pairs).collect();
    jobs.list(&names, &Workers::default(), |_| (true, [0, 0], [0, 0], NO_CONTACT));
    spoil(&mut jobs);
    let input = Input {
        poses: &[PoseRow::default()],
        displacements: &[Quad::default()],
        rolling: None,
        shapes: &shapes,
        margins: Margins::within(0.02),
        freezing: None,
        workers: &Workers::default(),
    };
    let mut contacts = vec![Contact::default(); contacts];
    update(kind, width, &mut jobs, input, &mut contacts, &mut vec![], &mut |_, _, _| {});
}

#[test]
fn the_narrow_phase_refuses_pairs_of_what_does_not_exist() {
    for kind in PairKind::ALL {
        for width in LaneWidth::ALL {
            for pairs in [1, 16, 21] {
                collide(kind, width, pairs, 0, |_| {});
                collide(kind, width, pairs, 1, |jobs| jobs.contact[0] = 0);
                for (far, end) in [1, 1_000_000_000, u32::MAX]
                    .into_iter()
                    .flat_map(|far| [0, pairs as usize - 1].map(|end| (far, end)))
                {
                    let refused = |what: &str, contacts: usize, spoil: &dyn Fn(&mut Jobs)| {
                        let words = format!("a pair of {what} {far} of 1");
                        panics(&words, || collide(kind, width, pairs, contacts, spoil));
                    };
                    for side in [0, 1] {
                        refused("bodies", 0, &|jobs| jobs.bodies[side][end] = far);
                        refused("shapes", 0, &|jobs| jobs.shapes[side][end] = far);
                    }
                    if far != NO_CONTACT {
                        refused("contact", 1, &|jobs| jobs.contact[end] = far);
                    }
                }
                for list in 0..5 {
                    for add in [false, true] {
                        panics(&format!("{pairs} pairs, and "), || {
                            collide(kind, width, pairs, 0, |jobs| {
                                let Jobs { bodies: [a, b], shapes: [c, d], contact, .. } = jobs;
                                let list = [a, b, c, d, contact].into_iter().nth(list).expect("five lists");
                                list.pop();
                                if add {
                                    list.extend([0, 0]);
                                }
                            });
                        });
                    }
                }
            }
        }
    }
}

#[test]
fn prefetches_are_hints_at_any_address() {
    let quads = [Quad::default(); 3];
    prefetch_records::<{ quad::STRIDE }>(&quads, [0, 1, u32::MAX].into_iter());
    prefetch_records::<1>(&[], [7].into_iter());
    for (start, end) in [(0, 0), (0, 3), (2, usize::MAX), (usize::MAX, 3), (usize::MAX, usize::MAX)] {
        let range = start..end;
        prefetch(&quads, range.clone());
        prefetch::<u8>(&[], range.clone());
        prefetch(&[(), ()], range);
    }
}

/// Files below a folder that allow unsafe code, which is denied everywhere else.
fn allowing(folder: &Path, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            allowing(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&path).expect("a source file");
            let names_it =
                |line: &str| line.split("//").next().is_some_and(|code| code.contains("unsafe_code"));
            if !path.ends_with(file!()) && text.lines().any(names_it) {
                found.push(path.strip_prefix(ROOT).expect("below the root").display().to_string());
            }
        }
    }
}

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// The complete list of files with unsafe code. Each gives its reason.
#[test]
fn unsafe_code_is_only_in_listed_files() {
    let manifest = std::fs::read_to_string(Path::new(ROOT).join("Cargo.toml")).expect("the manifest");
    assert!(manifest.contains("unsafe_code = \"deny\""));
    let mut found = vec![];
    for folder in ["src", "tests", "benches"] {
        allowing(&Path::new(ROOT).join(folder), &mut found);
    }
    found.sort();
    let listed = [
        "benches/peers/src/box2d.rs",
        "src/engine/constraints/kernels/stages.rs",
        "src/engine/lanes/quads.rs",
        "src/engine/lanes/rows.rs",
        "src/engine/lanes/shared.rs",
        "src/engine/narrowphase/batch.rs",
        "src/engine/workers.rs",
        "src/engine/world/groups.rs",
        "tests/allocations.rs",
        "tests/lab/flush_to_zero.rs",
    ];
    assert_eq!(found, listed);
}

/// A world can be stepped on any thread.
#[test]
fn a_world_is_send() {
    fn is_send<T: Send>() {}
    is_send::<simpulse::engine::world::World>();
}
