//! Stability against the order of contacts: the same settings in every order, as one table.

use super::table::{finish, table};
use super::units::si;
use crate::engine::world::Order;
use crate::lab::study::curve::{ErrorAxis, solvers_of};
use crate::lab::study::{Record, answer};

/// The text above the table.
const LEGEND: &str = "\
Order of contacts.  Settings that hold, of those that ran; median over these of the penetration and of the contact-law residual
(weights of the lighter body)
";

/// A table per scene with a line per solver. Empty unless orders other than natural and colored ran.
pub fn text(records: &[Record]) -> String {
    let orders: Vec<Order> =
        Order::ALL.into_iter().filter(|order| records.iter().any(|r| r.order == *order)).collect();
    if !orders.iter().any(|order| matches!(order, Order::Reversed | Order::Shuffled)) {
        return String::new();
    }
    let mut text = format!("\n{LEGEND}");
    for scene in records.chunk_by(|a, b| a.scene == b.scene) {
        let mut head = vec![scene[0].scene.as_str()];
        head.extend(orders.iter().map(|order| order.name()));
        let mut rows = table(&head);
        for solver in solvers_of(scene) {
            let cells = orders.iter().map(|&order| cell(scene, solver, order));
            rows.add_row(std::iter::once(solver.to_string()).chain(cells));
        }
        text += &format!("{}\n", finish(rows, 1));
    }
    text
}

/// `2 of 3, 1.2 mm, 4e-3` for the settings of a solver in an order. A setting at several lane widths counts
/// once.
fn cell(scene: &[Record], solver: &str, order: Order) -> String {
    let mut own: Vec<&Record> = Vec::new();
    for record in scene.iter().filter(|r| r.solver == solver && r.order == order) {
        if !own.iter().any(|other| answer::same(other, record)) {
            own.push(record);
        }
    }
    let held: Vec<&Record> = own.iter().copied().filter(|r| r.holds()).collect();
    let median = |axis: ErrorAxis| {
        let mut values: Vec<f64> = held.iter().filter_map(|r| axis.of(r)).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let mut text = format!("{} of {}", held.len(), own.len());
    if let (Some(depth), Some(residual)) = (median(ErrorAxis::Penetration), median(ErrorAxis::Law)) {
        text += &format!(", {}, {residual:.0e}", si(depth, "m"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{fell, record};

    #[test]
    fn each_order_has_what_holds_in_it() {
        let in_order = |order: Order, own: Record| Record { order, ..own };
        let mut records = vec![
            in_order(Order::Natural, record(1, 1, 9.0, 2e-3)),
            in_order(Order::Natural, record(1, 2, 9.0, 1e-3)),
            in_order(Order::Reversed, fell(1, 1, 9.0, 2e-3)),
            in_order(Order::Reversed, record(1, 2, 9.0, 4e-3)),
            record(4, 1, 9.0, 3e-3),
            record(8, 1, 9.0, 3e-3),
        ];
        let line = |records: &[Record]| {
            let text = text(records);
            let line = text.lines().find(|l| l.starts_with("pgs")).unwrap().to_string();
            line.split_whitespace().collect::<Vec<_>>().join(" ")
        };
        let natural = "2 of 2, 2.00 mm, 0e0";
        assert_eq!(line(&records), format!("pgs {natural} 1 of 2, 4.00 mm, 0e0 1 of 1, 3.00 mm, 0e0"));
        records.retain(|r| r.order != Order::Reversed);
        assert_eq!(text(&records), "");
    }
}
