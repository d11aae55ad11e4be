//! Laws of a coloring, for any graph of constraints.

use proptest::prelude::*;
use simpulse::engine::coloring::{Coloring, EXEMPT, MAX_COLORS, OVERFLOW};

const BODIES: usize = 24;

/// Number of edges at each body. Exempt sides do not count.
fn degrees(edges: &[[u32; 2]]) -> [usize; BODIES] {
    let mut degrees = [0; BODIES];
    for &[a, b] in edges {
        for body in [a, b] {
            if let Some(degree) = degrees.get_mut(body as usize) {
                *degree += 1;
            }
        }
    }
    degrees
}

/// Body pairs, some with exempt sides. There are few bodies, so long lists overflow.
fn graph() -> impl Strategy<Value = Vec<[u32; 2]>> {
    let body = || prop_oneof![8 => 0u32..BODIES as u32, 1 => Just(EXEMPT)];
    let edge = (body(), body()).prop_filter_map("a body is no neighbor of itself", |(a, b)| {
        (a != b || a == EXEMPT).then_some([a, b])
    });
    prop_oneof![proptest::collection::vec(edge.clone(), 0..60), proptest::collection::vec(edge, 500..1500)]
}

proptest! {
    #[test]
    fn no_body_twice_in_a_color(edges in graph()) {
        let mut coloring = Coloring::new();
        coloring.assign(edges.iter().copied(), BODIES);
        for color in 0..coloring.colors() {
            let mut seen = [false; BODIES];
            prop_assert!(!coloring.color(color).is_empty(), "color {} is empty", color);
            for &edge in coloring.color(color) {
                prop_assert_eq!(coloring.color_of()[edge as usize] as usize, color);
                for body in edges[edge as usize] {
                    if let Some(seen) = seen.get_mut(body as usize) {
                        prop_assert!(!*seen, "body {} twice in color {}", body, color);
                        *seen = true;
                    }
                }
            }
        }
    }

    #[test]
    fn every_edge_once_and_in_order(edges in graph()) {
        let mut coloring = Coloring::new();
        coloring.assign(edges.iter().copied(), BODIES);
        let mut parts: Vec<&[u32]> = (0..coloring.colors()).map(|c| coloring.color(c)).collect();
        parts.push(coloring.overflow());
        prop_assert!(parts.iter().all(|part| part.is_sorted()));
        prop_assert_eq!(&parts.concat(), coloring.order());
        let mut order = coloring.order().to_vec();
        order.sort();
        prop_assert_eq!(order, (0..edges.len() as u32).collect::<Vec<_>>());
        for &edge in coloring.overflow() {
            prop_assert_eq!(coloring.color_of()[edge as usize], OVERFLOW);
        }
    }

    /// When an edge is colored, it sees at most deg(a) − 1 + deg(b) − 1 others. This bounds its color, and
    /// overflow requires all 64 colors in use.
    #[test]
    fn colors_within_the_greedy_bound(edges in graph()) {
        let mut coloring = Coloring::new();
        coloring.assign(edges.iter().copied(), BODIES);
        let degrees = degrees(&edges);
        let others = |body: u32| degrees.get(body as usize).map_or(0, |&degree| degree - 1);
        for (&[a, b], &color) in edges.iter().zip(coloring.color_of()) {
            if color == OVERFLOW {
                prop_assert!(others(a) + others(b) >= MAX_COLORS);
            } else {
                prop_assert!(color as usize <= others(a) + others(b));
            }
        }
        let most = degrees.into_iter().max().unwrap_or(0);
        prop_assert!(coloring.colors() <= (2 * most).saturating_sub(1).max(1));
    }

    #[test]
    fn history_does_not_show(graphs in proptest::collection::vec(graph(), 1..4)) {
        let mut kept = Coloring::new();
        for edges in graphs.iter().flat_map(|g| [g, g]) {
            kept.assign(edges.iter().copied(), BODIES);
            prop_assert!(kept.is_current(edges.iter().copied(), BODIES));
            let mut fresh = Coloring::new();
            fresh.assign(edges.iter().copied(), BODIES);
            prop_assert_eq!(kept.order(), fresh.order());
            prop_assert_eq!(kept.starts(), fresh.starts());
            prop_assert_eq!(kept.color_of(), fresh.color_of());
        }
    }
}

#[test]
fn no_edges() {
    let mut coloring = Coloring::new();
    assert!(!coloring.is_current([].into_iter(), 0), "nothing was assigned yet");
    assert_eq!((coloring.colors(), coloring.overflow().len(), coloring.color(0).len()), (0, 0, 0));
    coloring.assign([].into_iter(), 3);
    assert!(coloring.is_current([].into_iter(), 3) && !coloring.is_current([].into_iter(), 4));
    assert_eq!(coloring.starts(), [0]);
    assert_eq!((coloring.colors(), coloring.overflow().len(), coloring.lane_slots(8)), (0, 0, 0));
}

#[test]
fn a_star_overflows() {
    let edges: Vec<[u32; 2]> = (1..=1000).map(|i| [0, i]).collect();
    let mut coloring = Coloring::new();
    coloring.assign(edges.iter().copied(), 1001);
    assert_eq!(coloring.colors(), MAX_COLORS);
    assert_eq!(coloring.overflow(), (64..1000).collect::<Vec<u32>>());
    // Overflow at the star's center does not affect the colors of its points.
    let mut more = edges;
    more.push([999, 1000]);
    coloring.assign(more.iter().copied(), 1001);
    assert_eq!(coloring.color_of()[1000], 0);
}

#[test]
fn exempt_sides_share_a_color() {
    let edges: Vec<[u32; 2]> = (0..100).map(|i| [EXEMPT, i]).collect();
    let mut coloring = Coloring::new();
    coloring.assign(edges.iter().copied(), 100);
    assert_eq!((coloring.colors(), coloring.lane_slots(8), coloring.lane_slots(16)), (1, 104, 112));
    assert_eq!(coloring.lane_slots(0), 0);
    coloring.assign([[EXEMPT, EXEMPT], [5, EXEMPT]].into_iter(), 2);
    assert_eq!(coloring.color_of(), [0, 0], "a body past the end is exempt");
}

/// A path uses its colors in turn. The expected colors are computed by hand.
#[test]
fn a_path() {
    let mut coloring = Coloring::new();
    coloring.assign([[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]].into_iter(), 4);
    assert_eq!(coloring.color_of(), [0, 1, 0, 1, 2]);
    assert_eq!(coloring.order(), [0, 2, 1, 3, 4]);
    assert_eq!(coloring.starts(), [0, 2, 4, 5]);
}

/// Three bodies in a row, with three contacts between neighbors: the pairs take turns.
#[test]
fn repeated_pairs_take_turns() {
    let mut coloring = Coloring::new();
    coloring.assign([[0, 1], [0, 1], [0, 1], [1, 2], [1, 2], [1, 2]].into_iter(), 3);
    assert_eq!(coloring.color_of(), [0, 2, 4, 1, 3, 5]);
}
