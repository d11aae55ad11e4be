//! One lane that counts its operations, so that floating-point operations are measured instead of estimated.
//!
//! The kernels are generic over [`Lanes`]. With [`Counted`] they perform on one lane the same operations as
//! on sixteen, and every operation is counted. Counts are per thread.
//!
//! Counts follow the source, although a compiler removes dead code. In a sweep that is the tangential part of
//! a motion (3 of some 140 operations against a dynamic body), and against a static body also the sine and
//! versine of its rotation (10 of some 100).

use super::index::LaneIndex;
use super::quads::Quad;
use super::rows::BodyRow;
use super::vector::Lanes;
use bytemuck::{Pod, Zeroable};
use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Operations on lanes, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Operations {
    /// Additions and subtractions.
    pub adds: u64,
    /// Multiplications.
    pub multiplies: u64,
    /// Multiply-adds, of either sign.
    pub multiply_adds: u64,
    /// Divisions and square roots.
    pub divisions: u64,
    /// Minima, maxima and selections: instructions, but not floating-point operations.
    pub choices: u64,
}

impl Operations {
    /// Floating-point operations. A multiply-add counts as two, a division or root as one; selections and
    /// sign changes do not count.
    pub fn flops(&self) -> u64 {
        self.adds + self.multiplies + 2 * self.multiply_adds + self.divisions
    }
}

thread_local! {
    static BOOK: Cell<Operations> = const {
        Cell::new(Operations { adds: 0, multiplies: 0, multiply_adds: 0, divisions: 0, choices: 0 })
    };
}

enum OperationKind {
    Add,
    Multiply,
    MultiplyAdd,
    Divide,
    Choose,
}

// Not inlined: inlined, the counting kernels made up half of the code of all kernels.
#[inline(never)]
fn book(kind: OperationKind) {
    let mut operations = BOOK.get();
    let count = match kind {
        OperationKind::Add => &mut operations.adds,
        OperationKind::Multiply => &mut operations.multiplies,
        OperationKind::MultiplyAdd => &mut operations.multiply_adds,
        OperationKind::Divide => &mut operations.divisions,
        OperationKind::Choose => &mut operations.choices,
    };
    *count += 1;
    BOOK.set(operations);
}

/// An `f32` that counts its operations. Results have the bits of `f32`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(transparent)]
pub struct Counted(pub f32);

impl Counted {
    /// Operations of this thread since the last call. Resets the counts.
    pub fn take() -> Operations {
        BOOK.take()
    }
}

impl Add for Counted {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        book(OperationKind::Add);
        Counted(self.0 + other.0)
    }
}

impl Sub for Counted {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        book(OperationKind::Add);
        Counted(self.0 - other.0)
    }
}

impl Mul for Counted {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        book(OperationKind::Multiply);
        Counted(self.0 * other.0)
    }
}

impl Div for Counted {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        book(OperationKind::Divide);
        Counted(self.0 / other.0)
    }
}

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Counted(-self.0)
    }
}

impl Lanes for Counted {
    const WIDTH: usize = 1;

    const COUNTS: bool = true;

    type Index = [u32; 1];

    fn splat(value: f32) -> Self {
        Counted(value)
    }

    fn mul_add(self, factor: Self, term: Self) -> Self {
        book(OperationKind::MultiplyAdd);
        Counted(Lanes::mul_add(self.0, factor.0, term.0))
    }

    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        book(OperationKind::MultiplyAdd);
        Counted(Lanes::neg_mul_add(self.0, factor.0, term.0))
    }

    fn max(self, other: Self) -> Self {
        book(OperationKind::Choose);
        Counted(Lanes::max(self.0, other.0))
    }

    fn min(self, other: Self) -> Self {
        book(OperationKind::Choose);
        Counted(Lanes::min(self.0, other.0))
    }

    fn sqrt(self) -> Self {
        book(OperationKind::Divide);
        Counted(self.0.sqrt())
    }

    fn select_positive(self, positive: Self, otherwise: Self) -> Self {
        book(OperationKind::Choose);
        Counted(Lanes::select_positive(self.0, positive.0, otherwise.0))
    }

    fn any_positive(self) -> bool {
        self.0 > 0.0
    }

    fn gather(rows: &[BodyRow], index: LaneIndex<[u32; 1]>) -> [Self; 8] {
        f32::gather(rows, index).map(Counted)
    }

    fn scatter_velocity(rows: &mut [BodyRow], index: LaneIndex<[u32; 1]>, velocity: [Self; 4]) {
        f32::scatter_velocity(rows, index, velocity.map(|v| v.0))
    }

    fn scatter_delta(rows: &mut [BodyRow], index: LaneIndex<[u32; 1]>, delta: [Self; 4]) {
        f32::scatter_delta(rows, index, delta.map(|v| v.0))
    }

    fn gather_quads<const S: usize, const O: usize>(quads: &[Quad], index: LaneIndex<[u32; 1]>) -> [Self; 4] {
        f32::gather_quads::<S, O>(quads, index).map(Counted)
    }

    fn scatter_quads<const S: usize, const O: usize>(
        quads: &mut [Quad],
        index: LaneIndex<[u32; 1]>,
        v: [Self; 4],
    ) {
        f32::scatter_quads::<S, O>(quads, index, v.map(|v| v.0))
    }

    fn scatter_halves<const S: usize, const O: usize, const P: usize>(
        quads: &mut [Quad],
        index: LaneIndex<[u32; 1]>,
        v: [Self; 4],
    ) {
        f32::scatter_halves::<S, O, P>(quads, index, v.map(|v| v.0))
    }

    fn load_at(values: &[f32], index: LaneIndex<[u32; 1]>) -> Self {
        Counted(f32::load_at(values, index))
    }

    fn store_at(values: &mut [f32], index: LaneIndex<[u32; 1]>, v: Self) {
        f32::store_at(values, index, v.0)
    }

    fn select_equal(self, other: Self, yes: Self, no: Self) -> Self {
        book(OperationKind::Choose);
        Counted(Lanes::select_equal(self.0, other.0, yes.0, no.0))
    }

    fn integer_bits(self) -> Self {
        Counted(Lanes::integer_bits(self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_operation_is_booked_once_and_computed_as_f32_does() {
        Counted::take();
        let (a, b, c) = (Counted(1.5), Counted(-2.25), Counted(0.7));
        let cases = [
            (a + b, 1.5 + -2.25),
            (a - b, 1.5 - -2.25),
            (a * b, 1.5 * -2.25),
            (a / b, 1.5 / -2.25),
            (-a, -1.5),
            (a.mul_add(b, c), Lanes::mul_add(1.5_f32, -2.25, 0.7)),
            (a.neg_mul_add(b, c), Lanes::neg_mul_add(1.5_f32, -2.25, 0.7)),
            (a.max(b), 1.5),
            (a.min(b), -2.25),
            (a.sqrt(), 1.5_f32.sqrt()),
            (b.select_positive(a, c), 0.7),
        ];
        for (i, (counted, plain)) in cases.into_iter().enumerate() {
            assert_eq!(counted.0.to_bits(), plain.to_bits(), "{i}");
        }
        let counted = Counted::take();
        let expected = Operations { adds: 2, multiplies: 1, multiply_adds: 2, divisions: 2, choices: 3 };
        assert_eq!(counted, expected);
        assert_eq!(counted.flops(), 2 + 1 + 4 + 2);
        assert_eq!(Counted::take(), Operations::default());
    }
}
