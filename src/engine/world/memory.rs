//! Memory that a world allocates, and the part of it in use.

use super::World;
use crate::lanes::held;
use std::mem::size_of_val;

/// Memory of the arrays with one purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Component {
    /// Name for tables.
    pub name: &'static str,
    /// Bytes allocated: capacities, which grow by doubling and never shrink.
    pub held: usize,
    /// Bytes in use: lengths.
    pub used: usize,
}

/// Heap memory of a [`World`] by purpose, without the struct itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Memory {
    /// Bodies, shapes, broad phase, candidates, contacts, coloring, records, rows.
    pub components: Vec<Component>,
}

impl Memory {
    /// Bytes allocated by all components.
    pub fn held(&self) -> usize {
        self.components.iter().map(|c| c.held).sum()
    }

    /// Bytes in use by all components.
    pub fn used(&self) -> usize {
        self.components.iter().map(|c| c.used).sum()
    }

    /// The component called `name`; zero bytes if there is none.
    pub fn of(&self, name: &'static str) -> Component {
        let zero = Component { name, held: 0, used: 0 };
        self.components.iter().copied().find(|c| c.name == name).unwrap_or(zero)
    }
}

/// Held and used bytes of each array.
macro_rules! arrays {
    ($($array:expr),* $(,)?) => { [$((held(&$array), size_of_val($array.as_slice()))),*] };
}

impl World {
    /// Memory of the world by purpose.
    ///
    /// If the length of an array is not accessible, as in the broad phase, `used` equals `held`.
    pub fn memory(&self) -> Memory {
        let component = |name, arrays: &[(usize, usize)]| Component {
            name,
            held: arrays.iter().map(|a| a.0).sum(),
            used: arrays.iter().map(|a| a.1).sum(),
        };
        let opaque = |bytes: usize| (bytes, bytes);
        let b = &self.bodies;
        let mut bodies: Vec<_> = b.arrays().iter().map(|a| (a.bytes(), 4 * a.len())).collect();
        bodies.extend(arrays![b.local_center, b.kind, b.group, b.round]);
        let w = &self.work;
        let mut records = Vec::new();
        for batches in [&w.lanes, &w.serial] {
            records.extend(batches.memory());
        }
        records.push(opaque(w.impacts.held_bytes()));
        let mut components = vec![
            component("bodies", &bodies),
            component("shapes", &arrays![self.shapes, self.shape_body, self.surfaces]),
            component("bounds", &[arrays![self.proxies][0], opaque(self.fat_boxes.held_bytes())]),
            component("broad phase", &[opaque(self.broadphase.held_bytes())]),
            component("continuous collision", &[opaque(self.continuous.held_bytes())]),
            component("candidates", &[arrays![self.pairs][0], opaque(self.narrow.candidate_bytes())]),
            component("contacts", &[arrays![self.contacts][0], opaque(self.narrow.contact_bytes())]),
            component("coloring", &[opaque(self.assignment.held_bytes())]),
            component("records", &records),
            component("rows", &[arrays![w.rows][0], opaque(w.motion.held_bytes())]),
        ];
        // Most solvers have no state of their own.
        let own = w.own_bytes() + self.solver.held_bytes();
        if own > 0 {
            components.push(component("solver", &[opaque(own)]));
        }
        Memory { components }
    }
}
