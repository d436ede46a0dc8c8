//! A table with a row per quantity and a column per item, so that registers hold consecutive items.

use crate::elements::LANES;
use crate::kernel::lane::{Lane, Real};

/// The table. Rows are whole registers of the widest kind.
#[derive(Default)]
pub struct Table<R> {
    values: Vec<R>,
    /// Numbers per row.
    row: usize,
}

impl<R: Real> Table<R> {
    /// Makes room for `items` in each of `rows`. Values are whatever they were.
    pub fn reserve(&mut self, rows: usize, items: usize) {
        self.row = items.next_multiple_of(LANES);
        if self.values.len() < rows * self.row {
            self.values.resize(rows * self.row, R::from_f64(0.0));
        }
    }

    #[inline(always)]
    pub fn get(&self, row: usize, item: usize) -> R {
        self.values[row * self.row + item]
    }

    /// Consecutive rows of an item.
    #[inline(always)]
    pub fn array<const N: usize>(&self, row: usize, item: usize) -> [R; N] {
        let mut values = [R::from_f64(0.0); N];
        for k in 0..N {
            values[k] = self.get(row + k, item);
        }
        values
    }

    /// Writes the register of items that starts at `first`.
    #[inline(always)]
    pub fn store<L: Lane<Scalar = R>>(&mut self, row: usize, first: usize, value: L) {
        value.store(&mut self.values[row * self.row + first..]);
    }

    /// Consecutive rows of a register.
    #[inline(always)]
    pub fn store_array<L: Lane<Scalar = R>, const N: usize>(&mut self, row: usize, first: usize, values: [L; N]) {
        for k in 0..N {
            self.store(row + k, first, values[k]);
        }
    }
}
